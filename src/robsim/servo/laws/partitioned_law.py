"""The partitioned law of Corke and Hutchinson, with separate control of the optical axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, PerRun, Quantity, described
from robsim.kernels.control import control_law
from robsim.kernels.control import control_law as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.servo.laws.compiled_law import CommandAtGain, CompiledLaw, LawRows, add_joint_velocities
from robsim.servo.laws.gain import PER_SECOND
from robsim.servo.laws.inverse import LATERAL_TWIST, add_inverse
from robsim.servo.laws.law import UnitOfLength

SPEED_SPEC = Quantity(above=0, dimension="speed")


RollGain = Annotated[
    float, PER_SECOND, PerRun(()), "Gain of the rotation about the optical axis, in 1/s."
]
AdvanceGain = Annotated[
    float,
    SPEED_SPEC,
    PerRun(()),
    "Speed along the optical axis per unit of ln(sigma*/sigma), in m/s.",
]


@described
@dataclass(frozen=True)
class PartitionedLaw(CompiledLaw, DeclaredValue):
    """Partitioned law: area and angle drive the optical axis, points drive the other motions.

    For features s = (x1, y1, ..., angle, area) and sigma = sqrt(area),

        omega_z = roll (angle - angle*)
        v_z     = advance ln(sigma*/sigma)
        V_xy    = L_xy^+ (-gain e - L_z V_z)

    and qdot = J^+ V (Corke and Hutchinson 2001, "A new partitioned approach to image-based visual
    servo control"). The sign of omega_z follows from the roll of the camera, which turns the image
    the other way. Use the task `Partitioned`, which supplies these features.

    `roll` sets the rate of rotation and `advance` the rate of approach. `length` acts as in
    `CameraLaw`.

    Raises
    ------
    InputError
        By `command`, unless s has at least one mark, an angle and an area.

    Examples
    --------
    An angle of 0.1 rad above its goal turns the camera at 0.2 rad/s:

    >>> from robsim.laws import ControlState
    >>> L, s = np.zeros((4, 6)), [0.0, 0.0, 0.1, 1.0]
    >>> L[:2, :2] = -np.eye(2)
    >>> state = ControlState.of([0.0, 0.0, 0.1, 0.0], L, np.eye(6), s=s)
    >>> PartitionedLaw(roll=2.0).command(state).round(3)[0, 3:] + 0.0
    array([0. , 0. , 0.2])
    """

    roll: RollGain = 1.0
    advance: AdvanceGain = 1.0
    length: UnitOfLength = 1.0
    in_camera: ClassVar[bool] = True

    def stages(self, of: LawRows) -> CommandAtGain:
        """Add the stage of the optical axis; return a function that adds the command for a gain."""
        if of.s is None or of.k < 4:
            raise InputError(
                "the partitioned law needs the features s of at least one mark, an angle and an "
                f"area; got {of.k} features" + (", without s" if of.s is None else "")
            )
        program, k = of.program, of.k
        numbers = program.numbers(np.broadcast_arrays(self.roll, self.advance), 1)
        V, arguments = program.rows(6), {"s": of.s, "errors": of.error, "numbers": numbers}
        axis = program.result(kernels.command_optical_axis, "V", 6, **arguments)

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
