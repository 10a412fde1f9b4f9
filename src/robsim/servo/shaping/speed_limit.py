"""Speed limits that slow a command down and keep its direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, PerRun, Quantity, Table, described
from robsim.declare.joint_numbers import (
    OneOrEach,
    broadcast_limits,
    get_commanded_axes,
    has_wrong_count,
)
from robsim.kernels.control import velocity_scale as kernels
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program, evaluated

JOINT_SPEEDS = OneOrEach(get_commanded_axes, "/s", later=True)


@described
@dataclass(frozen=True)
class SpeedLimit(DeclaredValue):
    """Speed limits that scale the whole command by one factor in (0, 1], keeping its direction.

    >>> SpeedLimit(joint=0.5).scaled(np.array([[1.0], [-0.2]]), np.zeros((6, 2, 1))).ravel()
    array([ 0.5, -0.1])
    """

    joint: Annotated[
        float | Sequence[float] | None,
        JOINT_SPEEDS,
        PerRun((), ("n",)),
        "Limit of |qdot|: one for all commanded velocities, or one for each.",
    ] = None
    linear: Annotated[
        float | None,
        Quantity(above=0, dimension="speed"),
        PerRun(()),
        "Limit of the camera's speed |v| relative to the target.",
    ] = None
    angular: Annotated[
        float | None,
        Quantity(above=0, dimension="turn rate"),
        PerRun(()),
        "Limit of the camera's turn rate |omega| relative to the target.",
    ] = None

    def __post_init__(self) -> None:
        if self.joint is None and self.linear is None and self.angular is None:
            raise InputError("a speed limit needs at least one of joint, linear and angular")
        super().__post_init__()

    def check(self, names: Sequence[str]) -> None:
        """Raise InputError unless there is one joint limit, or one for each of these names."""
        given: Any = self.joint
        if has_wrong_count(given, names):
            raise InputError(
                f"{len(given)} joint speed limits for {len(names)} commanded velocities: "
                f"{', '.join(names)}"
            )

    def scaled(self, qd: Array, J: Array) -> Array:
        """Return velocities (n, B) from qd (n, B) and the Jacobian J (6, n, B) of the camera."""
        (out,) = evaluated(lambda *rows: [self.stages(*rows)], [J, qd])
        return out

    def stages(self, program: Program, J: BlockRows, qd: BlockRows) -> BlockRows:
        """Add the stage that scales velocities in rows qd; return the rows of the result."""
        given = (self.joint, qd.size), (self.linear, 1), (self.angular, 1)
        each = [limit for one, count in given for limit in broadcast_limits(one, count)]
        limits = program.numbers(np.broadcast_arrays(*each), 1)
        return program.result(kernels.scale_command, "out", qd.size, J=J, limits=limits, qd=qd)


SPEED_LIMIT = Table(SpeedLimit)
