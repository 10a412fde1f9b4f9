"""What a small mistake of the calibration does to the end of a run and to its stability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.analysis.explanation.text_format import format_offset
from robsim.analysis.linearisation.gain_dependence import GainDependence
from robsim.analysis.linearisation.linear_loop import LinearLoop
from robsim.analysis.linearisation.perturbations import BeliefPerturbation, generate_perturbations
from robsim.analysis.linearisation.stability_limit import find_mode_limit
from robsim.analysis.vector_fields import VectorField
from robsim.base.arrays import Array
from robsim.run import end_variables

NOTABLE_CHANGE = 5e-4  # relative change that is told
ROUNDING = 1e-8  # metres and radians, below which a change is one of rounding


@dataclass(frozen=True)
class MiscalibrationEffect:
    """The effect of a number that is believed wrongly by a unit, to first order.

    name     such as "cameras.eye.focal"; of a pose, along or about an axis of its own
    unit     of the mistake: "1 %", "1 px", "1 mm", "1 deg", or 0.02 of a distortion
    metres   by which the camera ends elsewhere, relative to the target
    radians  by which it is turned there
    rate     relative change of the slowest rate of decay
    limit    relative change of the largest stable gain

    >>> MiscalibrationEffect("cameras.eye.focal", "1 %", 0.02, 0.0, 0.0, 0.01).metres
    0.02
    """

    name: str
    unit: str
    metres: float
    radians: float
    rate: float
    limit: float

    @property
    def moves(self) -> bool:
        """Whether the camera ends elsewhere."""
        return bool(self.metres or self.radians)

    @property
    def notable(self) -> bool:
        """Whether it moves the end, or changes a rate or the limit by a twentieth of a percent."""
        return self.moves or max(abs(self.rate), abs(self.limit)) >= NOTABLE_CHANGE

    def __str__(self) -> str:
        """Return in a line what a unit of the mistake changes."""
        changes = (("slowest rate", self.rate), ("largest gain", self.limit))
        each = [f"ends {format_offset(self.metres, self.radians)} off"] if self.moves else []
        each += [f"{name} {100 * x:+.2g} %" for name, x in changes if abs(x) >= NOTABLE_CHANGE]
        return f"{self.unit} of {self.name}: {', '.join(each) or 'no effect'}"


def compute_effects(linear: LinearLoop) -> tuple[MiscalibrationEffect, ...]:
    """Return the effects of all mistakes, those that move the end of the camera most first.

    A distance counts as the angle at which it is seen from the target; where nothing moves, that
    comes first which lowers the largest gain or the slowest rate most.
    """
    field, limit = linear.field, find_mode_limit(linear.scaled.modes, linear.calm)
    depth = float(np.mean([Z.mean() for Z in field.images(linear.q)[1].values()]))
    each = generate_perturbations(linear.task, field.scene, field.controller.sights)
    found = [_compute_effect(linear, mistake, limit) for mistake in each]
    return tuple(sorted(found, key=lambda one: _effect_order(one, depth)))


def _effect_order(one: MiscalibrationEffect, depth: float) -> tuple[float, float, float]:
    return -max(one.metres / depth, one.radians), min(one.limit, one.rate), one.limit


def _compute_effect(
    linear: LinearLoop, mistake: BeliefPerturbation, limit: float
) -> MiscalibrationEffect:
    """Return the effect of a mistake: dq = -(dqd/dq)^-1 qd, with the qd that it commands."""
    other = linear.with_task(mistake.made(linear.task, linear.field.scene))
    off = other.response.settled(other.field.command(linear.q).qd[:, 0])
    metres, radians = _relative_offset(linear.field, linear.q, off)
    scaled = GainDependence.of(other.response, None) if linear.scaled.proportional else other.scaled
    slowest = scaled.rates[0].real / linear.scaled.rates[0].real - 1.0
    raised = find_mode_limit(scaled.modes, linear.calm) / limit - 1.0 if limit else 0.0
    return MiscalibrationEffect(mistake.name, mistake.unit, metres, radians, float(slowest), raised)


def _relative_offset(field: VectorField, q: Array, motion: Array) -> tuple[float, float]:
    """Return metres and radians by which a motion (n,) moves the camera against its target."""
    moved = field.pose(field.moved(q, motion[:, None])).inv().matrix[0, :3, :, None]
    here = field.pose(q).inv().matrix[0, :3, :, None]
    metres, radians = end_variables.measure_pose_difference(here, moved)
    return zero_rounding(float(metres[0])), zero_rounding(float(radians[0]))


def zero_rounding(value: float) -> float:
    """Return metres or radians, zero where differences and rounding make them up; NaN stays."""
    return 0.0 if value <= ROUNDING else value
