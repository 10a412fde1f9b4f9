"""Robust weightings: marks that are seen far from where the others are count less.

Comport, Marchand and Chaumette, "Statistically robust 2-D visual servoing", IEEE Transactions on
Robotics 22(2), 2006: the command is that of diag(w) L and diag(w) e, and w the weights of an
M-estimate. Their residual is an error less the median of all; here it is the distance of a mark
from its place at the goal, as it is. What marks have in common then stays in the scale, and a
residual against a motion that is fitted to the marks says nothing of four marks: before a square
that faces the camera an error of one of them leaves the same residual at each.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from robsim.declare import DeclaredValue, Number, PerRun, register
from robsim.kernels.estimation import m_estimator as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.servo.weightings.weighting_protocol import MarkRows, MarkWeighting

RobustNoise = Annotated[
    float,
    Number(above=0, unit="px"),
    PerRun(()),
    "Noise to be expected of a mark: the least scale of the distances.",
]


class _RobustWeighting(MarkWeighting):
    """The base of weightings by how far marks are from their places at the goal."""

    by_goal: ClassVar[bool] = True
    least_marks: ClassVar[int] = 4  # of three, two are left, which fix no pose
    kernel: ClassVar[int]
    noise: float

    def marks(self, of: MarkRows) -> BlockRows:
        """Add the stage of the weights of the marks of a sight, and return their rows."""
        program, N = of.given.program, of.N
        goal = program.numbers(of.goal, 2)
        image = {"pixels": of.view.pixels, "goal": goal, "there": of.there}
        how = {"kind": self.kernel, "least": program.number(self.noise)}
        room = program.scratch(3 * N)
        return program.result(kernels.weight_by_distance, "weights", N, **image, **how, room=room)


@register("weighting", "huber")
@dataclass(frozen=True)
class Huber(_RobustWeighting, DeclaredValue):
    """The robust weighting of Huber: 1 up to a distance, and beyond falling as its inverse.

    Distances r of marks from their places at the goal, in pixels, are in units of their scale
    1.4826 median(r), or of `noise` where that is more: u = r / scale. The weight is 1 up to
    u = 1.345, and 1.345 / u beyond (Huber, "Robust estimation of a location parameter", Annals of
    Mathematical Statistics 35, 1964). Needs four marks or more, and an image of them at the goal.

    >>> Huber().noise
    1.0
    """

    kernel: ClassVar[int] = kernels.HUBER
    noise: RobustNoise = 1.0


@register("weighting", "tukey")
@dataclass(frozen=True)
class Tukey(_RobustWeighting, DeclaredValue):
    """The robust weighting of Tukey, the biweight: from 1 to next to nothing at a distance.

    With u as of `Huber`, the weight is (1 - (u / 4.685)^2)^2 up to u = 4.685, and 0.001 beyond and
    where it is less (Beaton and Tukey, Technometrics 16, 1974).

    >>> Tukey(noise=0.5).noise
    0.5
    """

    kernel: ClassVar[int] = kernels.TUKEY
    noise: RobustNoise = 1.0


@register("weighting", "cauchy")
@dataclass(frozen=True)
class Cauchy(_RobustWeighting, DeclaredValue):
    """The robust weighting of Cauchy: it falls from 1 with the square of the distance.

    With u as of `Huber`, the weight is 1 / (1 + (u / 2.385)^2) (Holland and Welsch, Communications
    in Statistics A6, 1977).

    >>> Cauchy().noise
    1.0
    """

    kernel: ClassVar[int] = kernels.CAUCHY
    noise: RobustNoise = 1.0
