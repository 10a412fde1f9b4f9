"""Control laws, which map the error to joint velocities.

An arm with fewer than six joints cannot realise every camera twist, so "v = -gain L^+ e, then
qdot = J^+ v" and "qdot = -gain (L J)^+ e" are different laws. The chapter (section 6.1) uses the
first; the second descends the error whatever the robot.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Protocol, runtime_checkable

from robsim.base.arrays import Array
from robsim.declare import DeclaredValue, KindOf, Length, PerRun, family, register
from robsim.kernels.control import control_law
from robsim.kernels.linear_algebra.pseudoinverse import count_product_rows
from robsim.servo.laws.compiled_law import (
    CommandAtGain,
    CompiledLaw,
    LawRows,
    add_joint_velocities,
    scale_by_gain,
)
from robsim.servo.laws.control_state import ControlState
from robsim.servo.laws.inverse import CAMERA_TWIST, SAME_UNITS, add_inverse

LAWS = family("law")
UnitOfLength = Annotated[
    float,
    Length(above=0),
    PerRun(()),
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
class JointLaw(CompiledLaw):
    """The law qdot = -gain (L J)^+ e, the least-squares descent of the error in the joints.

    >>> from robsim import IBVS
    >>> IBVS(law="joint").law
    JointLaw()
    """

    in_camera: ClassVar[bool] = False

    def stages(self, of: LawRows) -> CommandAtGain:
        """Add the stages of (L J)^+ e; return what adds those of the command at a gain."""
        transposed, damping, rcond = of.inverse.numbers
        program, k, n = of.program, of.k, of.n
        if not of.one_motion or min(k, n) <= 6 or transposed or damping > 0.0:
            moves = of.J if of.one_motion else SAME_UNITS
            return scale_by_gain(of, add_inverse(program, of.A, of.error, of.inverse, moves))
        unit = program.result(
            control_law.solve_task_product,
            "x",
            n,
            L=of.L,
            J=of.J,
            A=of.A,
            y=of.error,
            rcond=program.constant(rcond),
            rank=program.rows(),
            scratch=program.scratch(count_product_rows(k, n)),
        )
        return scale_by_gain(of, unit)


@register("law", "camera")
@dataclass(frozen=True)
class CameraLaw(CompiledLaw, DeclaredValue):
    """The law V = -gain L^+ e (eq. 8 of the chapter), then qdot = J^+ V (eq. 19).

    Least squares over a twist depends on the unit of length: it weighs |v|^2 / length^2 against
    |omega|^2. The chapter's is a centimetre.

    >>> CameraLaw(length=0.01).length
    0.01
    """

    length: UnitOfLength = 1.0
    in_camera: ClassVar[bool] = True

    def stages(self, of: LawRows) -> CommandAtGain:
        """Add the stages of J^+ L^+ e; return what adds those of the command at a gain."""
        program, unit = of.program, of.program.number(self.length)
        L = program.result(control_law.scale_length_unit, "B", of.k, 6, A=of.L, length=unit, how=1)
        V = add_inverse(program, L, of.error, of.inverse, CAMERA_TWIST)
        program.add(control_law.scale_length_unit, A=V.column, length=unit, how=2, B=V.column)
        return scale_by_gain(of, add_joint_velocities(of, V, unit))


LAW = KindOf(LAWS, default="joint", beside_of={"length": ("camera", "length")}, protocol=Law)
