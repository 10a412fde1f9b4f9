"""What a small mistake of the calibration does to the end of a run and to its stability."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.analysis.advising.limit import of_modes
from robsim.analysis.advising.linear import Linear
from robsim.analysis.advising.mistakes import Mistake, mistakes
from robsim.analysis.advising.scaled import Scaled
from robsim.analysis.explanation.wording import away
from robsim.analysis.field import Field
from robsim.base.arrays import Array
from robsim.run import ends

NOTABLE = 5e-4  # relative change that is told
NOTHING = 1e-8  # metres and radians, below which a change is one of rounding


@dataclass(frozen=True)
class Effect:
    """The effect of a number that is believed wrongly by a unit, to first order.

    name     such as "cameras.eye.focal"; of a pose, along or about an axis of its own
    unit     of the mistake: "1 %", "1 px", "1 mm", "1 deg", or 0.02 of a distortion
    metres   by which the camera ends elsewhere, relative to the target
    radians  by which it is turned there
    rate     relative change of the slowest rate of decay
    limit    relative change of the largest stable gain

    >>> Effect("cameras.eye.focal", "1 %", 0.02, 0.0, 0.0, 0.01).metres
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
        return self.moves or max(abs(self.rate), abs(self.limit)) >= NOTABLE

    def __str__(self) -> str:
        """Return in a line what a unit of the mistake changes."""
        changes = (("slowest rate", self.rate), ("largest gain", self.limit))
        each = [f"ends {away(self.metres, self.radians)} off"] if self.moves else []
        each += [f"{name} {100 * x:+.2g} %" for name, x in changes if abs(x) >= NOTABLE]
        return f"{self.unit} of {self.name}: {', '.join(each) or 'no effect'}"


def effects(linear: Linear) -> tuple[Effect, ...]:
    """Return the effects of all mistakes, those that move the end of the camera most first.

    A distance counts as the angle at which it is seen from the target; where nothing moves, that
    comes first which lowers the largest gain or the slowest rate most.
    """
    field, limit = linear.field, of_modes(linear.scaled.modes, linear.calm)
    depth = float(np.mean([Z.mean() for Z in field.images(linear.q)[1].values()]))
    each = mistakes(linear.task, field.scene, field.controller.sights)
    found = [_effect(linear, mistake, limit) for mistake in each]
    return tuple(sorted(found, key=lambda one: _order(one, depth)))


def _order(one: Effect, depth: float) -> tuple[float, float, float]:
    return -max(one.metres / depth, one.radians), min(one.limit, one.rate), one.limit


def _effect(linear: Linear, mistake: Mistake, limit: float) -> Effect:
    """Return the effect of a mistake: dq = -(dqd/dq)^-1 qd, with the qd that it commands."""
    other = linear.with_task(mistake.made(linear.task, linear.field.scene))
    off = other.response.settled(other.field.command(linear.q).qd[:, 0])
    metres, radians = _off(linear.field, linear.q, off)
    scaled = Scaled.of(other.response, None) if linear.scaled.proportional else other.scaled
    slowest = scaled.rates[0].real / linear.scaled.rates[0].real - 1.0
    raised = of_modes(scaled.modes, linear.calm) / limit - 1.0 if limit else 0.0
    return Effect(mistake.name, mistake.unit, metres, radians, float(slowest), raised)


def _off(field: Field, q: Array, motion: Array) -> tuple[float, float]:
    """Return metres and radians by which a motion (n,) moves the camera against its target."""
    moved = field.pose(field.moved(q, motion[:, None])).inv().matrix[0, :3, :, None]
    here = field.pose(q).inv().matrix[0, :3, :, None]
    metres, radians = ends.between(here, moved)
    return rounded(float(metres[0])), rounded(float(radians[0]))


def rounded(value: float) -> float:
    """Return metres or radians, zero where differences and rounding make them up; NaN stays."""
    return 0.0 if value <= NOTHING else value
