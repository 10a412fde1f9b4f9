"""Result of inverse kinematics, with the reason why the search ended."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from robsim.base.arrays import Array
from robsim.base.value import Value
from robsim.kernels.inverse_kinematics import ik_scheduler as kernels


class IKReason(IntEnum):
    """Reason why the search for coordinates ended.

    The members are SOLVED, UNREACHABLE, LIMITS and ITERATIONS; `message` explains each.

    >>> IKReason.SOLVED.message
    'solved: the link is at the pose, within the limits'
    """

    SOLVED = kernels.SOLVED
    UNREACHABLE = kernels.UNREACHABLE
    LIMITS = kernels.LIMITS
    ITERATIONS = kernels.ITERATIONS

    @property
    def message(self) -> str:
        """Explanation of the reason, in one sentence."""
        return f"{self.name.lower()}: {_MESSAGES[self]}"


_MESSAGES = {
    IKReason.SOLVED: "the link is at the pose, within the limits",
    IKReason.UNREACHABLE: (
        "no small motion reduces the smallest error of the searches, and the pose was not reached "
        "without limits either; the pose is out of reach, or try more restarts"
    ),
    IKReason.LIMITS: (
        "limits of joints prevent the pose: it was reached without them, or joints are at their "
        "limits at the smallest error of the searches; try more restarts"
    ),
    IKReason.ITERATIONS: "the error was still falling at the end; try more iterations or restarts",
}


@dataclass(frozen=True, eq=False)
class IKResult(Value):
    """Result of `Robot.ik`, row by row. For a single pose, all fields lack the leading axes.

    Attributes
    ----------
    q : ndarray of shape (..., nq)
        Coordinates with the smallest error of all searches, within the limits, in rad and m.
    success : bool or ndarray of bool of shape (...)
        Whether q is a solution: `error` is below the tolerance.
    error : float or ndarray of shape (...)
        The larger of |p_goal - p| in m and the angle in rad from R to R_goal (or between the z
        axes), as far as the mask includes them, by forward kinematics of q.
    iterations : int or ndarray of int of shape (...)
        Number of evaluations of the pose, over all searches within the limits.
    restarts : int or ndarray of int of shape (...)
        Number of searches from other starts than q0.
    reason : IKReason or ndarray of int of shape (...)
        Reason why the search ended, or codes of `IKReason`.

    Examples
    --------
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
