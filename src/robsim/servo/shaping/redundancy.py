"""Redundancy: projectors, secondary motions and priorities for motions that a task leaves free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats
from robsim.base.errors import InputError, format_value
from robsim.declare import DeclaredValue, KindOf, Number, PerRun, family, register
from robsim.declare.joint_numbers import PerJoint, get_commanded_axes
from robsim.kernels.control import null_space as kernels
from robsim.kernels.control.task_priorities import count_priority_rows, solve_priority
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluated
from robsim.servo.laws.gain import PER_SECOND


def solve_priorities(levels: Sequence[tuple[Array, Array]], rcond: float) -> tuple[Array, Array]:
    """Return velocities (n, B) that serve tasks in order, and the projector onto what is left.

    The projector is (n, n, B).

    `levels` are (A_i (k_i, n, B), rate_i (k_i, B)), at least one, the most important first. Each
    comes as near to A_i qdot = rate_i as those before it allow, and never disturbs them:
    qdot_i = qdot_(i-1) + (A_i P_(i-1))^+ (rate_i - A_i qdot_(i-1)) (Siciliano and Slotine 1991),
    P_i = P_(i-1) - (A_i P_(i-1))^+ (A_i P_(i-1)) (Baerlocher and Boulic 1998). Singular values
    below rcond times the largest of A_i itself count as zero: levels may conflict.

    >>> first, second = np.array([[[1.0], [0.0]]]), np.array([[[1.0], [1.0]]])
    >>> qd, P = solve_priorities([(first, np.array([[2.0]])), (second, np.array([[5.0]]))], 1e-6)
    >>> qd.ravel(), P.ravel()
    (array([2., 3.]), array([0., 0., 0., 0.]))
    """

    def add(program: Program, *rows: BlockRows) -> tuple[BlockRows, BlockRows]:
        return add_priorities(program, list(zip(rows[::2], rows[1::2], strict=True)), rcond)

    qd, P = evaluated(add, [array for level in levels for array in level])
    return qd, P


def add_priorities(
    program: Program, levels: Sequence[tuple[BlockRows, BlockRows]], rcond: float
) -> tuple[BlockRows, BlockRows]:
    """Add the stages of `solve_priorities` for rows (A_i, rate_i); return the rows of qd and P."""
    n = levels[0][0].shape[1]
    qd, P = program.rows(n), program.rows(n, n)
    kept = {"qd": qd, "P": P, "N": program.rows(n, n), "usual": program.rows()}
    share, free = program.constant(rcond), n
    for A, rate in levels:
        k = A.shape[0]
        given = {"A": A, "rate": rate, "rcond": share, "free": free}
        program.add(
            solve_priority, **given, **kept, scratch=program.rows(count_priority_rows(k, n))
        )
        free = max(free - k, 0)
    return qd, P


def null_space(A: Array, rcond: float) -> Array:
    """Return the orthogonal projector P = I - A^+ A (n, n, B) onto the null space of A (k, n, B).

    A^+ is truncated at rcond times the largest singular value. Liegeois 1977.

    >>> null_space(np.array([[[2.0], [0.0]]]), 1e-6).ravel()
    array([0., 0., 0., 1.])
    """
    return solve_priorities([(A, np.zeros((A.shape[0], A.shape[2])))], rcond)[1]


def large_projection(A: Array, e: Array, low: float, high: float, P: Array) -> Array:
    """Return the projector (n, n, B) that keeps ||e|| where it is large, and all of e where small.

    w P_eta + (1 - w) P, with P_eta = I - A'e e'A/(e'A A'e) for A (k, n, B), e (k, B), and
    P = `null_space(A)`. The weight w rises smoothly from 0 at ||e|| = low to 1 at high, and is 0
    where A'e = 0. Marey and Chaumette 2010, "A new large projection operator for the redundancy
    framework".

    >>> A, e = np.eye(2)[..., None], np.array([[3.0], [0.0]])
    >>> large_projection(A, e, 0.1, 0.5, null_space(A, 1e-6)).ravel()
    array([0., 0., 0., 1.])
    """

    def add(program: Program, A: BlockRows, error: BlockRows, P: BlockRows) -> list[BlockRows]:
        bounds = program.constant([low, high])
        program.add(kernels.apply_large_projector, A=A, error=error, bounds=bounds, P=P)
        return [P]

    (out,) = evaluated(add, [A, e, P])
    return out


@runtime_checkable
class SecondaryMotion(Protocol):
    """The interface of a secondary motion."""

    def velocity(self, q: Array, limits: Array) -> Array:
        """Return wished velocities (B, n) at commanded coordinates q (B, n) with limits (n, 2)."""


def _check_limits_array(limits: ArrayLike, count: int) -> Array:
    """Return limits (n, 2), which may be infinite; InputError unless there are so many."""
    try:
        given = np.asarray(limits)
    except ValueError:  # rows of unequal lengths
        given = np.empty(())
    if given.shape != (count, 2) or given.dtype.kind not in "iuf" or np.isnan(given).any():
        raise InputError(f"limits: expected shape ({count}, 2), got {format_value(limits)}")
    return given.astype(np.float64)


SECONDARIES = family("secondary motion")
SecondaryGain = Annotated[float, PER_SECOND, PerRun(()), "Gain of the secondary motion."]


@register("secondary motion", "avoid_limits")
@dataclass(frozen=True)
class AvoidLimits(DeclaredValue):
    """Move back from joint limits: qdot = -gain (q - threshold) beyond a threshold, else zero.

    The thresholds lie a margin inside the limits. It is the
    descent of the cost of Chaumette and Marchand 2001, sum (q - threshold)^2/(2 range), times the
    range of each coordinate, so that `gain` is per second whatever the unit of q. A coordinate
    that is not limited on both sides is left alone.

    >>> AvoidLimits().velocity(np.array([[0.0, 0.95]]), np.array([[-1.0, 1.0], [-1.0, 1.0]]))
    array([[ 0.  , -0.15]])
    """

    gain: SecondaryGain = 1.0
    margin: Annotated[
        float,
        Number(above=0, below=0.5),
        "Distance from a limit at which the motion begins, as a share of the range.",
    ] = 0.1

    def velocity(self, q: Array, limits: Array) -> Array:
        """Return wished velocities (B, n) at commanded coordinates q (B, n) with limits (n, 2)."""
        at = as_floats(q, "q", ("n",))
        low, high = self.bounds(_check_limits_array(limits, at.shape[-1]))
        wish: Array = self.gain * (np.clip(at, low, high) - at)
        return wish

    def bounds(self, limits: Array) -> tuple[Array, Array]:
        """Return the thresholds (n,) within which nothing is wished."""
        low, high = limits.T
        limited = np.isfinite(low) & np.isfinite(high)
        border = self.margin * np.where(limited, high - low, 0.0)
        return np.where(limited, low + border, -np.inf), np.where(limited, high - border, np.inf)


@register("secondary motion", "posture")
@dataclass(frozen=True, eq=False)
class Posture(DeclaredValue):
    """Move to a preferred posture: qdot = -gain (q - q_rest), q_rest (n,) of the commanded joints.

    >>> Posture([0.5]).velocity(np.array([[0.1]]), np.array([[-1.0, 1.0]]))
    array([[0.4]])
    """

    q: Annotated[
        Any,
        PerJoint(get_commanded_axes, later=True),
        "Preferred coordinates, one for each get_commanded_axes velocity.",
    ]
    gain: SecondaryGain = 1.0

    def check(self, names: Sequence[str]) -> None:
        """Raise InputError unless there is one coordinate for each of these names."""
        if len(self.q) != len(names):
            raise InputError(
                f"a posture of {len(self.q)} coordinates for {len(names)} commanded ones: "
                f"{', '.join(names)}"
            )

    def velocity(self, q: Array, limits: Array) -> Array:
        """Return wished velocities (B, n) at commanded coordinates q (B, n) of any limits."""
        wish: Array = self.gain * (self.q - as_floats(q, "q", (len(self.q),)))
        return wish

    def bounds(self, limits: Array) -> tuple[Array, Array]:
        """Return the posture, within which nothing is wished, for limits (n, 2)."""
        rest = np.full(len(limits), self.q)
        return rest, rest


SECONDARY = KindOf(SECONDARIES, short=False, protocol=SecondaryMotion)
