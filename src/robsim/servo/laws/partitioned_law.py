"""The partitioned law of Corke and Hutchinson, which treats the optical axis apart."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, PerRun, Quantity, described
from robsim.kernels.control import control_law
from robsim.kernels.control import optical_axis_law as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.servo.laws.compiled_law import CommandAtGain, CompiledLaw, LawRows, add_joint_velocities
from robsim.servo.laws.gain import PER_SECOND
from robsim.servo.laws.inverse import LATERAL_TWIST, add_inverse
from robsim.servo.laws.law import UnitOfLength

SPEED_SPEC = Quantity(above=0, dimension="speed")


RollGain = Annotated[float, PER_SECOND, PerRun(()), "Gain of the rotation about the optical axis."]
AdvanceGain = Annotated[
    float, SPEED_SPEC, PerRun(()), "Speed along the optical axis per unit of ln(sigma*/sigma)."
]


@described
@dataclass(frozen=True)
class PartitionedLaw(CompiledLaw, DeclaredValue):
    """The partitioned law: area and angle drive the optical axis, the points drive the rest.

    With s = (x1, y1, ..., angle, area): omega_z = roll (angle - angle*), since a roll turns the
    image the other way, v_z = advance ln(sigma*/sigma) with sigma the square root of the area, and
    V_xy = L_xy^+ (-gain e - L_z V_z), then qdot = J^+ V (Corke and Hutchinson 2001, "A new
    partitioned approach to image-based visual servo control"). `roll` is per second, `advance` in
    metres per second, `length` as in `CameraLaw`.

    >>> PartitionedLaw(roll=2.0).roll
    2.0
    """

    roll: RollGain = 1.0
    advance: AdvanceGain = 1.0
    length: UnitOfLength = 1.0
    in_camera: ClassVar[bool] = True

    def stages(self, of: LawRows) -> CommandAtGain:
        """Add the stage of the optical axis; return what adds those of the command at a gain."""
        if of.s is None or of.k < 4:
            raise InputError(
                "the partitioned law needs the features s of a mark at least, an angle and an "
                f"area; here are {of.k} of them" + (", without s" if of.s is None else "")
            )
        program, k = of.program, of.k
        numbers = program.numbers(np.broadcast_arrays(self.roll, self.advance), 1)
        V, seen = program.rows(6), {"s": of.s, "errors": of.error, "numbers": numbers}
        axis = program.result(kernels.command_optical_axis, "V", 6, **seen)

        def at(gain: BlockRows) -> BlockRows:
            points, rate = {"errors": of.error[: k - 2], "L": of.L[: k - 2]}, program.rows(k - 2)
            L = program.result(
                kernels.compensate_optical_axis,
                "out",
                k - 2,
                4,
                gain=gain,
                **points,
                V=axis,
                rates=rate,
            )
            across = add_inverse(program, L, rate, of.inverse, LATERAL_TWIST)
            parts = (axis, V), (across[:2], V[:2]), (across[2:], V[3:5])
            for rows, to in parts:
                program.add(control_law.copy_rows, rows=rows, to=to)
            return add_joint_velocities(of, V, program.number(self.length))

        return at
