"""Speed limits that slow a command down and keep its direction."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array, one_or_each, positive
from robsim.base.errors import InputError
from robsim.kernels import limit as kernels


@dataclass(frozen=True)
class SpeedLimit:
    """The whole command is scaled by one factor in (0, 1], so that its direction is kept.

    joint    on |qdot| of each commanded velocity, rad/s or m/s: one number for all, or one for each
    linear   on the speed |v| of the camera relative to the target, m/s
    angular  on its rate of turn |omega|, rad/s

    >>> SpeedLimit(joint=0.5).scaled(np.array([[1.0], [-0.2]]), np.zeros((6, 2, 1))).ravel()
    array([ 0.5, -0.1])
    """

    joint: float | Sequence[float] | None = None
    linear: float | None = None
    angular: float | None = None

    def __post_init__(self) -> None:
        if self.joint is None and self.linear is None and self.angular is None:
            raise InputError("a speed limit needs at least one of joint, linear and angular")
        if self.joint is not None:
            limit = one_or_each(self.joint, "joint speed limit", "commanded velocity")
            object.__setattr__(self, "joint", limit)
        for name in ("linear", "angular"):
            if getattr(self, name) is not None:
                limit = positive(getattr(self, name), f"{name} speed limit")
                object.__setattr__(self, name, limit)

    def check(self, names: Sequence[str]) -> None:
        """InputError if there is not one joint limit, or one for each velocity of these names."""
        if isinstance(self.joint, tuple) and len(self.joint) != len(names):
            raise InputError(
                f"{len(self.joint)} joint speed limits for {len(names)} commanded velocities: "
                f"{', '.join(names)}"
            )

    def scaled(self, qd: Array, J: Array) -> Array:
        """Velocities (n, B) from qd (n, B) and the Jacobian J (6, n, B) of the camera's twist."""
        joint = np.full(qd.shape[0], math.inf if self.joint is None else self.joint)
        twist = [math.inf if x is None else x for x in (self.linear, self.angular)]
        out = np.empty(qd.shape)
        kernels.scale(qd, J, joint, np.array(twist), out)
        return out
