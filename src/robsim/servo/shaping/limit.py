"""Speed limits that slow a command down and keep its direction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Declared, Quantity, Table, described
from robsim.declare.joints import OneOrEach, commanded
from robsim.kernels.control import limit as kernels
from robsim.kernels.machine.program import Program, evaluated
from robsim.kernels.machine.rows import Rows

JOINT = OneOrEach(commanded, "speeds", ("turn rate", "speed"), later=True)


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
        "Limit of |qdot|: one for all commanded velocities, or one for each.",
    ] = None
    linear: Annotated[
        float | None,
        Quantity(above=0, dimension="speed"),
        "Limit of the camera's speed |v| relative to the target.",
    ] = None
    angular: Annotated[
        float | None,
        Quantity(above=0, dimension="turn rate"),
        "Limit of the camera's turn rate |omega| relative to the target.",
    ] = None

    def __post_init__(self) -> None:
        if self.joint is None and self.linear is None and self.angular is None:
            raise InputError("a speed limit needs at least one of joint, linear and angular")
        super().__post_init__()

    def check(self, names: Sequence[str]) -> None:
        """Raise InputError unless there is one joint limit, or one for each of these names."""
        if isinstance(self.joint, tuple) and len(self.joint) != len(names):
            raise InputError(
                f"{len(self.joint)} joint speed limits for {len(names)} commanded velocities: "
                f"{', '.join(names)}"
            )

    def scaled(self, qd: Array, J: Array) -> Array:
        """Return velocities (n, B) from qd (n, B) and the Jacobian J (6, n, B) of the camera."""
        (out,) = evaluated(lambda *rows: [self.stages(*rows)], [J, qd])
        return out

    def stages(self, program: Program, J: Rows, qd: Rows) -> Rows:
        """Add the stage that scales velocities in rows qd; return the rows of the result."""
        each = [self.joint, self.linear, self.angular]
        joint, linear, angular = (math.inf if limit is None else limit for limit in each)
        limits = program.constant([*np.full(qd.size, joint), linear, angular])
        return program.result(kernels.scale_stage, "out", qd.size, J=J, limits=limits, qd=qd)


LIMIT = Table(SpeedLimit)
