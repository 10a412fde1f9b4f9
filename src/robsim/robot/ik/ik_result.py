"""The result of inverse kinematics, with the reason why the search ended."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from robsim.base.arrays import Array
from robsim.base.value import Value
from robsim.kernels.inverse_kinematics import ik_scheduler as kernels


class IKReason(IntEnum):
    """The reason why the search for coordinates ended; `message` explains it.

    >>> IKReason.SOLVED.message
    'solved: the link is at the pose, within the limits'
    """

    SOLVED = kernels.SOLVED
    UNREACHABLE = kernels.UNREACHABLE
    LIMITS = kernels.LIMITS
    ITERATIONS = kernels.ITERATIONS

    @property
    def message(self) -> str:
        """The explanation of the reason, in one sentence."""
        return f"{self.name.lower()}: {_MESSAGES[self]}"


_MESSAGES = {
    IKReason.SOLVED: "the link is at the pose, within the limits",
    IKReason.UNREACHABLE: (
        "no small motion lessens the least error that was found, and without limits it was not "
        "reached either; the pose is out of reach, or try more restarts"
    ),
    IKReason.LIMITS: (
        "limits of joints stand in the way of the pose: without them it was reached, or they hold "
        "the least error that was found; try more restarts"
    ),
    IKReason.ITERATIONS: "the error was still falling at the end; try more iterations or restarts",
}


@dataclass(frozen=True, eq=False)
class IKResult(Value):
    """The result of `Robot.ik`, row by row; for a single pose without the leading axes.

    q           (..., nq) with the least error that was found, within the limits
    success     (...,) whether that is a solution: `error` is below the tolerance
    error       (...,) the larger of the metres and the radians that count, by forward kinematics
                of q: |p_goal - p| and the angle from R to R_goal (or from z axis to z axis)
    iterations  (...,) how often the link was placed, over all searches within the limits
    restarts    (...,) how many searches began elsewhere than at q0
    reason      (...,) codes of `IKReason`; for a single pose one of these

    >>> from robsim import Robot
    >>> arm = Robot.from_dh([[0, 0, 1, 0]], limits=[[-1, 1]])
    >>> found = arm.ik(arm.fk([[0.5], [1.5]]))
    >>> found.q.round(9)[:, 0], [IKReason(code).name for code in found.reason]
    (array([0.5, 1. ]), ['SOLVED', 'LIMITS'])
    """

    q: Array
    success: Any
    error: Any
    iterations: Any
    restarts: Any
    reason: Any
