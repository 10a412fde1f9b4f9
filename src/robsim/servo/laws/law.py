"""Control laws, which map the error to joint velocities.

An arm with fewer than six joints cannot realise every camera twist, so "v = -gain L^+ e, then
qdot = J^+ v" and "qdot = -gain (L J)^+ e" are different laws. The chapter (section 6.1) uses the
first; the second descends the error whatever the robot.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Protocol, runtime_checkable

from robsim.base.arrays import Array
from robsim.declare import Choice, Declared, Length, Stacked, family, register
from robsim.kernels.control import commanding
from robsim.kernels.linear_algebra.solve import product_scratch_of
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.inverse import ANY, TWIST, inverted
from robsim.servo.laws.staged_law import AtGain, LawRows, StagedLaw, realised, times_gain

LAWS = family("law")
UnitOfLength = Annotated[
    float,
    Length(above=0),
    Stacked(()),
    "Length by which speeds are divided to be weighed against turn rates.",
]


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
        unit = program.result(
            commanding.solve_product,
            "x",
            n,
            L=of.L,
            J=of.J,
            A=of.A,
            y=of.error,
            rcond=program.constant(rcond),
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
        program, unit = of.program, of.program.number(self.length)
        L = program.result(commanding.in_units, "B", of.k, 6, A=of.L, length=unit, how=1)
        V = inverted(program, L, of.error, of.inverse, TWIST)
        program.add(commanding.in_units, A=V.column, length=unit, how=2, B=V.column)
        return times_gain(of, realised(of, V, unit))


LAW = Choice(LAWS, default="joint", beside_of={"length": ("camera", "length")}, protocol=Law)
