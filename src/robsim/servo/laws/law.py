"""Control laws, which map the error to joint velocities.

An arm with fewer than six joints cannot realise every camera twist, so "v = -gain L^+ e, then
qdot = J^+ v" and "qdot = -gain (L J)^+ e" are different laws. The chapter (section 6.1) uses the
first; the second descends the error whatever the robot.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, shown_view
from robsim.base.errors import InputError
from robsim.declare import Choice, Declared, Length, family, register
from robsim.kernels.control import commanding
from robsim.kernels.linear_algebra.solve import product_scratch_of
from robsim.servo.laws.checked import checked_state, last_of
from robsim.servo.laws.inverse import ANY, TWIST, Inverse, PseudoInverse, inverted, product
from robsim.servo.laws.staged_law import AtGain, LawRows, StagedLaw, realised, times_gain

LAWS = family("law")
UnitOfLength = Annotated[
    float, Length(above=0), "Length by which speeds are divided to be weighed against turn rates."
]


@dataclass(frozen=True, eq=False)
class ControlState:
    """What a law is given: error, interaction matrix and Jacobian, as the controller models them.

    `ControlState.of` makes one. Names that end in `_last` have the run last, as the kernels do;
    the others are run-first views, all read-only. J maps the commanded joint velocities to the
    camera's twist relative to the target, so that sdot = L J qdot. `memory` keeps what a law puts
    there, arrays with the run first, until the next instant of the same runs; it is empty at the
    start.

    InputError: arrays of unequal numbers of runs, features or joints, or not finite.
    """

    error_last: Array  # (k, B)
    interaction_last: Array  # (k, 6, B)
    jacobian_last: Array  # (6, n, B)
    task_jacobian_last: Array  # (k, n, B) L J: how the commanded joints move the features
    gain: Any  # per second: a number, or (B, 1) where it depends on the error
    inverse: Inverse
    s_last: Array | None = None  # (k, B)
    q_last: Array | None = None  # (nq, B) coordinates of all robots
    time: float = 0.0  # seconds since the start
    dt: float = 0.04  # seconds for which the command is held
    memory: dict[str, Any] = field(default_factory=dict)
    one_motion: bool = False  # whether L J is the product of `interaction` and `jacobian`

    def __post_init__(self) -> None:
        vars(self).update(checked_state(vars(self)))

    @classmethod
    def of(
        cls,
        error: ArrayLike,
        interaction: ArrayLike,
        jacobian: ArrayLike,
        *,
        gain: Any = 1.0,
        inverse: Inverse | None = None,
        s: ArrayLike | None = None,
        q: ArrayLike | None = None,
        time: float = 0.0,
        dt: float = 0.04,
    ) -> ControlState:
        """Return a state from an error (B, k), L (B, k, 6) and J (B, 6, n); of one run without B.

        gain      per second, or (B,) of each run its own
        inverse   by default the pseudo-inverse
        s, q      features (B, k) and coordinates (B, nq), for laws that read them
        time, dt  seconds since the start, and of the period

        InputError: unequal numbers of runs, features or joints, or a number that is not finite.

        >>> state = ControlState.of([1.0, 2.0], np.eye(2, 6), np.eye(6, 2), gain=0.5)
        >>> JointLaw().command(state)
        array([[-0.5, -1. ]])
        """
        e = last_of(error, "error", ("k",))
        L = last_of(interaction, "interaction", ("k", 6))
        J = last_of(jacobian, "jacobian", (6, "n"))
        if L.shape[::2] != e.shape or J.shape[2] != e.shape[1]:
            raise InputError(
                "expected error (B, k), interaction (B, k, 6) and jacobian (B, 6, n), got "
                f"{np.shape(error)}, {np.shape(interaction)} and {np.shape(jacobian)}"
            )
        return cls(
            e,
            L,
            J,
            product(L, J),
            gain,
            PseudoInverse() if inverse is None else inverse,
            None if s is None else last_of(s, "s", ("k",)),
            None if q is None else last_of(q, "q", ("nq",)),
            time,
            dt,
            one_motion=True,
        )

    @property
    def error(self) -> Array:
        """The error e (B, k), weighted, and with feed-forward the motion of the target in it."""
        return shown_view(self.error_last)

    @property
    def interaction(self) -> Array:
        """The interaction matrix L (B, k, 6), weighted."""
        return shown_view(self.interaction_last)

    @property
    def jacobian(self) -> Array:
        """The Jacobian J (B, 6, n) of the camera's twist (v, omega) in its own axes."""
        return shown_view(self.jacobian_last)

    @property
    def task_jacobian(self) -> Array:
        """The task Jacobian L J (B, k, n), whose rows are each of their own camera."""
        return shown_view(self.task_jacobian_last)

    @property
    def s(self) -> Array:
        """The features s (B, k) as measured."""
        return shown_view(_given(self.s_last, "features s"))

    @property
    def q(self) -> Array:
        """The coordinates q (B, nq) of all robots of the scene."""
        return shown_view(_given(self.q_last, "coordinates q"))


def _given(array: Array | None, what: str) -> Array:
    """Return an array, or raise InputError where there is none."""
    if array is None:
        raise InputError(f"the law reads {what}, and the state has none")
    return array


@runtime_checkable
class Law(Protocol):
    """The interface of a control law, which a class of a user has without a base class.

    `in_camera = True` says that it reads `state.interaction` and `state.jacobian`, which exist
    only where all cameras of the task move as one.
    """

    def command(self, state: ControlState) -> Array:
        """Return velocities (B, n) of the commanded joints in rad/s or m/s."""


@register("law", "joint")
@dataclass(frozen=True)
class JointLaw(StagedLaw):
    """The law qdot = -gain (L J)^+ e, the least-squares descent of the error in the joints.

    >>> from robsim import IBVS
    >>> IBVS(law="joint").law
    JointLaw()
    """

    in_camera: ClassVar[bool] = False

    def stages(self, of: LawRows) -> AtGain:
        """Add the stages of (L J)^+ e; return what adds those of the command at a gain."""
        transposed, damping, rcond = of.inverse.numbers
        program, k, n = of.program, of.k, of.n
        if not of.one_motion or min(k, n) <= 6 or transposed or damping > 0.0:
            moves = of.J if of.one_motion else ANY
            return times_gain(of, inverted(program, of.A, of.error, of.inverse, moves))
        unit = program.rows(n)
        program.add(
            commanding.solve_product,
            L=of.L,
            J=of.J,
            A=of.A,
            y=of.error,
            rcond=program.constant(rcond),
            x=unit,
            rank=program.rows(),
            scratch=program.scratch(product_scratch_of(k, n)),
        )
        return times_gain(of, unit)


@register("law", "camera")
@dataclass(frozen=True)
class CameraLaw(StagedLaw, Declared):
    """The law V = -gain L^+ e (eq. 8 of the chapter), then qdot = J^+ V (eq. 19).

    Least squares over a twist depends on the unit of length: it weighs |v|^2 / length^2 against
    |omega|^2. The chapter's is a centimetre.

    >>> CameraLaw(length=0.01).length
    0.01
    """

    length: UnitOfLength = 1.0
    in_camera: ClassVar[bool] = True

    def stages(self, of: LawRows) -> AtGain:
        """Add the stages of J^+ L^+ e; return what adds those of the command at a gain."""
        program, unit, L = of.program, of.program.constant(self.length), of.program.rows(of.k, 6)
        program.add(
            commanding.in_units,
            A=of.L,
            length=unit,
            how=1,
            B=L,
        )
        V = inverted(program, L, of.error, of.inverse, TWIST)
        program.add(
            commanding.in_units,
            A=V.column,
            length=unit,
            how=2,
            B=V.column,
        )
        return times_gain(of, realised(of, V, unit))


LAW = Choice(LAWS, default="joint", beside_of={"length": ("camera", "length")}, protocol=Law)
