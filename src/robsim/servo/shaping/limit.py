"""Speed limits that slow a command down and keep its direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Declared, Quantity, Stacked, Table, described
from robsim.declare.joints import OneOrEach, commanded, limits_of, misfits
from robsim.kernels.control import limit as kernels
from robsim.kernels.machine.program import Program, evaluated
from robsim.kernels.machine.rows import Rows

JOINT = OneOrEach(commanded, "/s", later=True)


@described
@dataclass(frozen=True)
class SpeedLimit(Declared):
    """Speed limits that scale the whole command by one factor in (0, 1], keeping its direction.

    >>> SpeedLimit(joint=0.5).scaled(np.array([[1.0], [-0.2]]), np.zeros((6, 2, 1))).ravel()
    array([ 0.5, -0.1])
    """

    joint: Annotated[
        float | Sequence[float] | None,
        JOINT,
        Stacked((), ("n",)),
        "Limit of |qdot|: one for all commanded velocities, or one for each.",
    ] = None
    linear: Annotated[
        float | None,
        Quantity(above=0, dimension="speed"),
        Stacked(()),
        "Limit of the camera's speed |v| relative to the target.",
    ] = None
    angular: Annotated[
        float | None,
        Quantity(above=0, dimension="turn rate"),
        Stacked(()),
        "Limit of the camera's turn rate |omega| relative to the target.",
    ] = None

    def __post_init__(self) -> None:
        if self.joint is None and self.linear is None and self.angular is None:
            raise InputError("a speed limit needs at least one of joint, linear and angular")
        super().__post_init__()

    def check(self, names: Sequence[str]) -> None:
        """Raise InputError unless there is one joint limit, or one for each of these names."""
        given: Any = self.joint
        if misfits(given, names):
            raise InputError(
                f"{len(given)} joint speed limits for {len(names)} commanded velocities: "
                f"{', '.join(names)}"
            )

    def scaled(self, qd: Array, J: Array) -> Array:
        """Return velocities (n, B) from qd (n, B) and the Jacobian J (6, n, B) of the camera."""
        (out,) = evaluated(lambda *rows: [self.stages(*rows)], [J, qd])
        return out

    def stages(self, program: Program, J: Rows, qd: Rows) -> Rows:
        """Add the stage that scales velocities in rows qd; return the rows of the result."""
        given = (self.joint, qd.size), (self.linear, 1), (self.angular, 1)
        each = [limit for one, count in given for limit in limits_of(one, count)]
        limits = program.numbers(np.broadcast_arrays(*each), 1)
        return program.result(kernels.scale_stage, "out", qd.size, J=J, limits=limits, qd=qd)


LIMIT = Table(SpeedLimit)
