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
from robsim.kernels import limit as kernels

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
        joint = np.full(qd.shape[0], math.inf if self.joint is None else self.joint)
        twist = [math.inf if x is None else x for x in (self.linear, self.angular)]
        out = np.empty(qd.shape)
        kernels.scale(qd, J, joint, np.array(twist), out)
        return out


LIMIT = Table(SpeedLimit)
