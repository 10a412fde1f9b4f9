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
from robsim.kernels.machine.program import Program, evaluate_stages

JOINT_SPEEDS = OneOrEach(get_commanded_axes, "/s", later=True)


@described
@dataclass(frozen=True)
class SpeedLimit(DeclaredValue):
    """Speed limits that scale the whole command by one factor in (0, 1].

    The factor is the largest that keeps every joint velocity, the linear speed |v| and the angular
    speed |omega| of the camera relative to the target within their limits. All velocities shrink
    alike, so the direction of the motion is kept, and with it the path. The error decays more
    slowly while a limit is active.

    Use `Safety` for limits that act on every command of an experiment, also on a real robot.

    Raises
    ------
    InputError
        If no limit is given; by `simulate`, if the number of joint limits is wrong.

    Examples
    --------
    >>> limit = SpeedLimit(joint=0.5)
    >>> limit.scaled(np.array([[1.0], [-0.2]]), np.zeros((6, 2, 1))).ravel()
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
        "Limit of the linear speed |v| of the camera relative to the target, in m/s.",
    ] = None
    angular: Annotated[
        float | None,
        Quantity(above=0, dimension="turn rate"),
        PerRun(()),
        "Limit of the angular speed |omega| of the camera relative to the target, in rad/s.",
    ] = None

    def __post_init__(self) -> None:
        if self.joint is None and self.linear is None and self.angular is None:
            raise InputError("a speed limit needs at least one of joint, linear and angular")
        super().__post_init__()

    def check(self, names: Sequence[str]) -> None:
        """Check the number of joint limits.

        Parameters
        ----------
        names : sequence of str
            Names of the commanded velocities.

        Raises
        ------
        InputError
            Unless there is one joint limit, or one for each name.
        """
        limits: Any = self.joint
        if has_wrong_count(limits, names):
            raise InputError(
                f"{len(limits)} joint speed limits for {len(names)} commanded velocities: "
                f"{', '.join(names)}"
            )

    def scaled(self, qd: Array, J: Array) -> Array:
        """Return velocities scaled to the limits.

        Parameters
        ----------
        qd : ndarray of shape (n, B)
            Velocities of the commanded joints.
        J : ndarray of shape (6, n, B)
            Jacobian of the camera relative to the target.

        Returns
        -------
        ndarray of shape (n, B)
            Velocities of each run, times one factor in (0, 1].
        """
        (out,) = evaluate_stages(lambda *rows: [self.stages(*rows)], [J, qd])
        return out

    def stages(self, program: Program, J: BlockRows, qd: BlockRows) -> BlockRows:
        """Add the stage that scales the velocities in rows qd; return the rows of the result."""
        fields = (self.joint, qd.size), (self.linear, 1), (self.angular, 1)
        each = [limit for one, count in fields for limit in broadcast_limits(one, count)]
        limits = program.numbers(np.broadcast_arrays(*each), 1)
        return program.result(kernels.scale_command, "out", qd.size, J=J, limits=limits, qd=qd)


SPEED_LIMIT = Table(SpeedLimit)
