"""Control laws, which map the error to joint velocities.

An arm with fewer than six joints cannot realise every camera twist, so "v = -gain L^+ e, then
qdot = J^+ v" and "qdot = -gain (L J)^+ e" are different laws. The chapter (section 6.1) uses the
first; the second descends the error whatever the robot.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Protocol, runtime_checkable

from robsim.base.arrays import Array, shown_view
from robsim.declare import Choice, Declared, Length, family, register
from robsim.kernels import commanding
from robsim.kernels.solve import product_scratch_of
from robsim.servo.laws.inverse import Inverse, inverted
from robsim.servo.laws.staged_law import AtGain, LawRows, StagedLaw, realised, times_gain

LAWS = family("law")
UnitOfLength = Annotated[
    float, Length(above=0), "Length by which speeds are divided to be weighed against turn rates."
]


@dataclass(eq=False)  # not frozen: one is made in every step
class ControlState:
    """What a law is given: error, interaction matrix and Jacobian, as the controller models them.

    Names that end in `_last` have the run last, as the kernels do; the others are run-first views.
    J maps the commanded joint velocities to the camera's twist relative to the target, so that
    sdot = L J qdot. `memory` keeps what a law puts there, arrays with the run first, until the
    next instant of the same runs; it is empty at the start.
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
        assert self.s_last is not None
        return shown_view(self.s_last)

    @property
    def q(self) -> Array:
        """The coordinates q (B, nq) of all robots of the scene."""
        assert self.q_last is not None
        return shown_view(self.q_last)


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
            return times_gain(of, inverted(program, (of.A, k, n), of.error, of.inverse))
        unit, rank = program.rows(n), program.rows()
        room = program.scratch(product_scratch_of(k, n))
        given = of.L, k, of.J, n, of.A, of.error, program.constant(rcond)
        program.add(commanding.solve_product, *given, unit, rank, room)
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
        program, unit, L = of.program, of.program.constant(self.length), of.program.rows(6 * of.k)
        program.add(commanding.in_units, of.L, of.k, 6, unit, 1, L)
        V = inverted(program, (L, of.k, 6), of.error, of.inverse)
        program.add(commanding.in_units, V, 6, 1, unit, 2, V)
        return times_gain(of, realised(of, V, unit))


LAW = Choice(LAWS, default="joint", beside_of={"length": ("camera", "length")}, protocol=Law)
