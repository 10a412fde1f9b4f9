"""Result of inverse kinematics, with the reason why the search ended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.named_integers import NamedInteger
from robsim.base.value import Value
from robsim.kernels.inverse_kinematics import ik_scheduler as kernels


class IKReason(NamedInteger):
    """Reason why the search for coordinates ended.

    Attributes
    ----------
    SOLVED
        The link is at the pose, within the limits.
    UNREACHABLE
        No search reached the pose, not even without limits.
    LIMITS
        Limits of joints prevent the pose.
    ITERATIONS
        The error was still falling at the last iteration.

    Examples
    --------
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
    """Result of `Robot.ik`, with one row for each pose.

    For a single pose, the arrays have no leading axes.

    Attributes
    ----------
    q : ndarray of shape (..., nq)
        Coordinates with the smallest error of all searches, within the limits, in rad and m.
    success : bool or ndarray of bool of shape (...)
        Whether q is a solution: `error` is below the tolerance.
    error : float or ndarray of shape (...)
        The larger of |p_goal - p| in m and the angle in rad from R to R_goal, by forward kinematics
        of q. With the mask "pointing", the angle between the z axes. Parts that the mask leaves out
        do not count.
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
    >>> result = arm.ik(arm.fk([[0.5], [1.5]]))
    >>> result.q.round(9)[:, 0], [IKReason(code).name for code in result.reason]
    (array([0.5, 1. ]), ['SOLVED', 'LIMITS'])
    """

    q: Array
    success: np.bool_ | NDArray[np.bool_]
    error: float | Array
    iterations: np.int64 | NDArray[np.int64]
    restarts: np.int64 | NDArray[np.int64]
    reason: Any  # Any: an `IKReason` for a single pose, else codes, which a union would hide
