"""Redundancy: projectors, secondary motions and priorities for the free motions of a task."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats
from robsim.base.errors import InputError, format_value
from robsim.declare import DeclaredValue, KindOf, Number, PerRun, family, register
from robsim.declare.joint_numbers import PerJoint, get_commanded_axes
from robsim.kernels.control import null_space as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluate_stages
from robsim.servo.laws.gain import PER_SECOND
from robsim.servo.shaping.free_motions import add_priorities


def solve_priorities(levels: Sequence[tuple[Array, Array]], rcond: float) -> tuple[Array, Array]:
    """Return velocities (n, B) that serve tasks in order, and the projector onto the free motions.

    Each level reduces its residual |A_i qdot - rate_i| as far as the levels before it allow:

        qdot_i = qdot_(i-1) + (A_i P_(i-1))^+ (rate_i - A_i qdot_(i-1))
        P_i    = P_(i-1) - (A_i P_(i-1))^+ (A_i P_(i-1))

    (Siciliano and Slotine 1991; Baerlocher and Boulic 1998).

    Parameters
    ----------
    levels : sequence of (A_i, rate_i)
        Task Jacobian A_i (k_i, n, B) and desired rate (k_i, B) of each level, the most important
        first; at least one.
    rcond : float
        Singular values below rcond times the largest singular value of A_i itself count as zero,
        so levels may conflict.

    Returns
    -------
    qdot : ndarray of shape (n, B)
        Joint velocities.
    P : ndarray of shape (n, n, B)
        Projector onto the motions that all levels leave free.

    Examples
    --------
    >>> first, second = np.array([[[1.0], [0.0]]]), np.array([[[1.0], [1.0]]])
    >>> qd, P = solve_priorities([(first, np.array([[2.0]])), (second, np.array([[5.0]]))], 1e-6)
    >>> qd.ravel(), P.ravel()
    (array([2., 3.]), array([0., 0., 0., 0.]))
    """

    def add(program: Program, *rows: BlockRows) -> tuple[BlockRows, BlockRows]:
        pairs = list(zip(rows[::2], rows[1::2], strict=True))
        qd, free_motions = add_priorities(program, pairs, rcond)
        return qd, free_motions.add_projector()

    qd, P = evaluate_stages(add, [array for level in levels for array in level])
    return qd, P


def null_space(A: Array, rcond: float) -> Array:
    """Return the orthogonal projector P = I - A^+ A (n, n, B) onto the null space of A (k, n, B).

    A^+ is truncated at rcond times the largest singular value (Liegeois 1977).

    Examples
    --------
    >>> null_space(np.array([[[2.0], [0.0]]]), 1e-6).ravel()
    array([0., 0., 0., 1.])
    """
    return solve_priorities([(A, np.zeros((A.shape[0], A.shape[2])))], rcond)[1]


def large_projection(A: Array, e: Array, low: float, high: float, P: Array) -> Array:
    """Return the large projector (n, n, B): it keeps ||e|| far from the goal, and all of e near it.

    The projector is w P_eta + (1 - w) P, with

        P_eta = I - A'e e'A/(e'A A'e)

    for A (k, n, B) and e (k, B), and P = `null_space(A)`. The weight w rises smoothly from 0 at
    ||e|| = low to 1 at ||e|| = high, and is 0 if A'e = 0 (Marey and Chaumette 2010, "A new large
    projection operator for the redundancy framework").

    Examples
    --------
    >>> A, e = np.eye(2)[..., None], np.array([[3.0], [0.0]])
    >>> large_projection(A, e, 0.1, 0.5, null_space(A, 1e-6)).ravel()
    array([0., 0., 0., 1.])
    """

    def add(program: Program, A: BlockRows, error: BlockRows, P: BlockRows) -> list[BlockRows]:
        bounds = program.constant([low, high])
        program.add(kernels.apply_large_projector, A=A, error=error, bounds=bounds, P=P)
        return [P]

    (out,) = evaluate_stages(add, [A, e, P])
    return out


@runtime_checkable
class SecondaryMotion(Protocol):
    """Protocol of a secondary motion: any object with this method, called at every step.

    Examples
    --------
    >>> class Turn:  # the first joint, at 0.1 rad/s
    ...     def velocity(self, q, limits):
    ...         velocity = np.zeros(q.shape)
    ...         velocity[:, 0] = 0.1
    ...         return velocity
    >>> isinstance(Turn(), SecondaryMotion)
    True
    """

    def velocity(self, q: Array, limits: Array) -> Array:
        """Return the desired velocities.

        Parameters
        ----------
        q : ndarray of shape (B, n)
            Coordinates of the commanded velocities in B runs; 0 for a velocity without its own
            coordinate.
        limits : ndarray of shape (n, 2)
            Lower and upper limits of the coordinates; infinite without a limit.

        Returns
        -------
        ndarray of shape (B, n)
            Desired velocities in rad/s or m/s.
        """


def _check_limits_array(limits: ArrayLike, count: int) -> Array:
    """Return limits (n, 2), which may be infinite; raise InputError for any other shape."""
    try:
        array = np.asarray(limits)
    except ValueError:  # rows of unequal lengths
        array = np.empty(())
    if array.shape != (count, 2) or array.dtype.kind not in "iuf" or np.isnan(array).any():
        raise InputError(f"limits: expected shape ({count}, 2), got {format_value(limits)}")
    return array.astype(np.float64)


SECONDARIES = family("secondary motion")
SecondaryGain = Annotated[float, PER_SECOND, PerRun(()), "Gain of the secondary motion."]


@register("secondary motion", "avoid_limits")
@dataclass(frozen=True)
class AvoidLimits(DeclaredValue):
    """Secondary motion away from joint limits, beyond a threshold in front of each limit.

        qdot = -gain (q - threshold)  beyond a threshold,    qdot = 0  elsewhere

    A threshold is `margin` times the range in front of each limit. The motion descends the cost
    sum (q - threshold)^2/(2 range) of Chaumette and Marchand 2001, times the range of each
    coordinate, so that `gain` is in 1/s for any unit of q. A coordinate without two limits gets no
    motion.

    The motion is projected onto the motions that the task leaves free: it does not change the
    features, and it has no effect if the task uses all joints. A larger `margin` starts earlier,
    and a larger `gain` pushes harder. The motion does not guarantee the limits;
    `Safety(margin=...)` does.

    Raises
    ------
    InputError
        By `velocity`, if the limits have another shape than (n, 2).

    Examples
    --------
    >>> AvoidLimits().velocity(np.array([[0.0, 0.95]]), np.array([[-1.0, 1.0], [-1.0, 1.0]]))
    array([[ 0.  , -0.15]])

    A gantry that starts near a joint limit:

    >>> from dataclasses import replace
    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("joint_limits"))
    >>> for secondary in None, AvoidLimits(gain=3.0, margin=0.25):
    ...     projection = "large" if secondary else "classic"
    ...     task = replace(scenario.task, secondary=secondary, projection=projection)
    ...     run = rs.simulate(scenario.scene, task, scenario.start, duration=20)
    ...     print(rs.Outcome(int(run.outcome)).name)
    JOINT_LIMIT
    CONVERGED
    """

    gain: SecondaryGain = 1.0
    margin: Annotated[
        float,
        Number(above=0, below=0.5),
        "Distance from a limit at which the motion begins, as a fraction of the range.",
    ] = 0.1

    def velocity(self, q: Array, limits: Array) -> Array:
        """Return the desired velocities.

        Parameters
        ----------
        q : array_like of shape (B, n)
            Coordinates of the commanded velocities.
        limits : array_like of shape (n, 2)
            Lower and upper limits of the coordinates; infinite without a limit.

        Returns
        -------
        ndarray of shape (B, n)
            Desired velocities in rad/s or m/s.

        Raises
        ------
        InputError
            If `limits` has another shape.
        """
        at = as_floats(q, "q", ("n",))
        low, high = self.bounds(_check_limits_array(limits, at.shape[-1]))
        velocity: Array = self.gain * (np.clip(at, low, high) - at)
        return velocity

    def bounds(self, limits: Array) -> tuple[Array, Array]:
        """Return the thresholds (n,) between which no motion is desired."""
        low, high = limits.T
        limited = np.isfinite(low) & np.isfinite(high)
        border = self.margin * np.where(limited, high - low, 0.0)
        return np.where(limited, low + border, -np.inf), np.where(limited, high - border, np.inf)


@register("secondary motion", "posture")
@dataclass(frozen=True, eq=False)
class Posture(DeclaredValue):
    """Secondary motion to a preferred posture, qdot = -gain (q - q_rest).

    The motion is projected onto the motions that the task leaves free: a redundant arm comes as
    close to the posture as the features allow. Use it to keep the elbow of an arm out of the way,
    or to return to a repeatable configuration.

    Raises
    ------
    InputError
        By `simulate`, if the number of coordinates differs from the number of commanded
        velocities.

    Examples
    --------
    >>> Posture([0.5]).velocity(np.array([[0.1]]), np.array([[-1.0, 1.0]]))
    array([[0.4]])

    An arm of seven joints returns to its home configuration with the camera at its goal:

    >>> import robsim as rs
    >>> scenario = rs.load_scenario(rs.examples.path("eye_in_hand"))
    >>> home = scenario.scene.home
    >>> for secondary in None, Posture(home):
    ...     task = rs.IBVS(secondary=secondary)
    ...     run = rs.simulate(scenario.scene, task, scenario.start, duration=20)
    ...     print(f"{np.abs(run.q_end.values - home).max():.3f} rad")
    0.012 rad
    0.000 rad
    """

    q: Annotated[
        Sequence[float] | Array,
        PerJoint(get_commanded_axes, later=True),
        "Preferred coordinates, one for each commanded velocity.",
    ]
    gain: SecondaryGain = 1.0

    def check(self, names: Sequence[str]) -> None:
        """Check the number of coordinates.

        Parameters
        ----------
        names : sequence of str
            Names of the commanded velocities.

        Raises
        ------
        InputError
            Unless there is one coordinate for each name.
        """
        if len(self.q) != len(names):
            raise InputError(
                f"a posture of {len(self.q)} coordinates for {len(names)} commanded ones: "
                f"{', '.join(names)}"
            )

    def velocity(self, q: Array, limits: Array) -> Array:
        """Return the desired velocities.

        Parameters
        ----------
        q : array_like of shape (B, n)
            Coordinates of the commanded velocities.
        limits : array_like of shape (n, 2)
            Limits of the coordinates, which are ignored.

        Returns
        -------
        ndarray of shape (B, n)
            Desired velocities in rad/s or m/s.
        """
        velocity: Array = self.gain * (self.q - as_floats(q, "q", (len(self.q),)))
        return velocity

    def bounds(self, limits: Array) -> tuple[Array, Array]:
        """Return the posture twice, as both thresholds of the motion, for limits (n, 2)."""
        rest = np.full(len(limits), self.q)
        return rest, rest


Subtask = SecondaryMotion | str  # a secondary motion, or its name
SECONDARY = KindOf(SECONDARIES, short=False, protocol=SecondaryMotion)
