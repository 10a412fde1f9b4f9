"""Drives that pass the torques of a law to the joints."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import register
from robsim.declare.array_types import Numbers
from robsim.declare.scalars import NOT_NEGATIVE
from robsim.kernels.control.control_law import copy_rows
from robsim.kernels.dynamics import joint_drives
from robsim.world.drives.drive_rows import DriveRows, spread_over_joints
from robsim.world.drives.joint_drive import (
    TORQUE,
    TRUE_MODEL,
    GravityFed,
    JointDrive,
    Model,
    TorqueLimit,
)


@register("drive", "torque_input")
@dataclass(frozen=True, eq=False)
class TorqueInput(JointDrive):
    """Drive whose command is a torque, with damping and gravity compensation.

        torque = u - K v + g(q)

    with the command u of a law that commands torques, the gains K of the velocity, and the believed
    gravity load g. The drive computes K v and g in each sub-step, and holds u for a period.

    Examples
    --------
    >>> import robsim as rs
    >>> rs.drives.TorqueInput(damping=[2.0, 1.0]).commanded
    'torque'
    """

    command_quantity: ClassVar[str] = TORQUE
    damping: Annotated[
        Array,
        Numbers(item=NOT_NEGATIVE, shape=None),
        "Torque per velocity, in N m s/rad or N s/m, for all joints or each.",
    ] = 0.0  # type: ignore[assignment]  # converted
    gravity: GravityFed = True
    model: Model = TRUE_MODEL
    torque_limit: TorqueLimit = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if np.any(self.model.friction):
            raise InputError(
                "TorqueInput.model: friction is compensated at commanded velocities, and the "
                "command is a torque; leave friction out"
            )

    def check(self, names: Sequence[str], seconds: float, parts: int) -> None:
        """Raise InputError for a list of dampings of another length."""
        spread_over_joints(self.damping, "damping", names)

    def bind(self, rows: DriveRows, runs: NDArray[np.int64]) -> Callable[[], None]:
        """Return a function that adds the stages of the torques in a sub-step."""
        program, n = rows.program, rows.n
        damping = program.constant(spread_over_joints(self.damping, "damping", rows.names))
        zero = program.rows(n)

        def add() -> None:
            if self.gravity:
                rows.believed.add_gravity(rows.torque)
            else:
                program.add(copy_rows, rows=zero, to=rows.torque)
            program.add(joint_drives.add_torques, more=rows.command, torque=rows.torque)
            damped = {"damping": damping, "v": rows.v, "slope": rows.slope}
            program.add(joint_drives.damp_joints, torque=rows.torque, **damped)
            rows.limit(rows.share)

        return add
