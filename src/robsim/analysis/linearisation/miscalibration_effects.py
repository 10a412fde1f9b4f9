"""Effects of a small calibration error on the final pose of a run and on its stability."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from robsim.analysis.explanation.text_format import format_offset
from robsim.analysis.linearisation.gain_dependence import GainDependence
from robsim.analysis.linearisation.linear_loop import LinearLoop
from robsim.analysis.linearisation.perturbations import BeliefPerturbation, generate_perturbations
from robsim.analysis.linearisation.stability_limit import (
    estimate_limit_change,
    find_loop_limit,
    find_mode_limit,
)
from robsim.analysis.vector_fields import VectorField
from robsim.base.arrays import Array
from robsim.run import end_variables

NOTABLE_CHANGE = 5e-4  # relative change that is printed
ROUNDING = 1e-8  # metres and radians below which a change is rounding


@dataclass(frozen=True)
class MiscalibrationEffect:
    """First-order effect of an error of one unit in a believed number.

    Attributes
    ----------
    name : str
        Dotted name of the number, such as "cameras.eye.focal". Pose errors are along or about an
        axis of the part itself.
    unit : str
        Size of the error: "1 %", "1 px", "1 mm", "1 deg", or 0.02 of a distortion coefficient.
    metres : float
        Displacement of the camera relative to the target at the end.
    radians : float
        Rotation of the camera relative to the target at the end.
    rate : float
        Relative change of the slowest rate of decay.
    limit : float
        Relative change of the largest stable gain.

    Examples
    --------
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
        """Whether the error displaces the camera at the end."""
        return bool(self.metres or self.radians)

    @property
    def notable(self) -> bool:
        """Whether the error displaces the camera, or changes rate or limit by 0.05 % or more."""
        return self.moves or max(abs(self.rate), abs(self.limit)) >= NOTABLE_CHANGE

    def __str__(self) -> str:
        """Return the changes that one unit of the error causes, in one line."""
        changes = (("slowest rate", self.rate), ("largest gain", self.limit))
        each = [f"ends {format_offset(self.metres, self.radians)} off"] if self.moves else []
        each += [f"{name} {100 * x:+.2g} %" for name, x in changes if abs(x) >= NOTABLE_CHANGE]
        return f"{self.unit} of {self.name}: {', '.join(each) or 'no effect'}"


def compute_effects(linear: LinearLoop) -> tuple[MiscalibrationEffect, ...]:
    """Return the effects of all errors, sorted by the displacement that they cause.

    A displacement counts as the angle under which it appears from the target. Errors without
    displacement are sorted by their reduction of the largest gain or of the slowest rate.
    """
    field, limit = linear.field, _find_limit(linear)
    depth = float(np.mean([Z.mean() for Z in field.images(linear.q).depth.values()]))
    perturbations = generate_perturbations(linear.task, field.scene, field.controller.sights)
    computed = [_compute_effect(linear, mistake, limit) for mistake in perturbations]
    return tuple(sorted(computed, key=lambda one: _effect_order(one, depth)))


def _effect_order(one: MiscalibrationEffect, depth: float) -> tuple[float, float, float]:
    """Return the sort key of an effect: displacement first, then stability."""
    return -max(one.metres / depth, one.radians), min(one.limit, one.rate), one.limit


def _compute_effect(
    linear: LinearLoop, mistake: BeliefPerturbation, limit: float
) -> MiscalibrationEffect:
    """Return the effect of an error, dq = -(dqd/dq)^-1 qd, from the command qd that it causes."""
    perturbed = linear.with_task(mistake.apply(linear.task, linear.field.scene))
    displacement = perturbed.response.cancelling_motion(perturbed.field.command(linear.q).qd[:, 0])
    metres, radians = _relative_offset(linear.field, linear.q, displacement)
    scaled = (
        GainDependence.of(perturbed.response, None)
        if linear.gain_dependence.is_proportional
        else perturbed.gain_dependence
    )
    slowest = scaled.rates[0].real / linear.gain_dependence.rates[0].real - 1.0
    changes = float(slowest), _change_of_limit(linear, perturbed, scaled, limit)
    return MiscalibrationEffect(mistake.name, mistake.unit, metres, radians, *changes)


def _find_limit(linear: LinearLoop) -> float:
    """Return the largest factor of the gains that a small error changes."""
    if linear.driven is None:
        return find_mode_limit(linear.gain_dependence.modes, linear.lossless)
    return find_loop_limit(linear, linear.lossless)


def _change_of_limit(
    linear: LinearLoop, perturbed: LinearLoop, scaled: GainDependence, limit: float
) -> float:
    """Return the relative change of the largest factor of the gains, of first order with drives."""
    if not limit:
        return 0.0
    if linear.driven is None:
        return find_mode_limit(scaled.modes, linear.lossless) / limit - 1.0
    if not math.isfinite(limit):
        return 0.0
    proportional = linear.gain_dependence.is_proportional
    changed = perturbed.proportional_driven if proportional else perturbed.driven
    assert changed is not None
    return estimate_limit_change(linear.driven, changed, linear.lossless, limit)


def _relative_offset(field: VectorField, q: Array, motion: Array) -> tuple[float, float]:
    """Return the displacement (m, rad) of the camera relative to its target by a motion (n,)."""
    displaced = field.pose(field.displace(q, motion[:, None])).inv().matrix[0, :3, :, None]
    pose = field.pose(q).inv().matrix[0, :3, :, None]
    metres, radians = end_variables.measure_pose_difference(pose, displaced)
    return zero_rounding(float(metres[0])), zero_rounding(float(radians[0]))


def zero_rounding(value: float) -> float:
    """Return a distance or an angle, with values below rounding set to zero; NaN is kept."""
    return 0.0 if value <= ROUNDING else value
