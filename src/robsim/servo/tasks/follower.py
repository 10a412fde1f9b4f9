"""The common part of tasks that follow a trajectory."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from robsim.base.arrays import not_negative
from robsim.base.errors import InputError, said
from robsim.kernels.control import following
from robsim.kernels.machine.rows import Rows
from robsim.servo.controller import Controller
from robsim.servo.given import Given
from robsim.servo.tasks.followed import Followed


@dataclass(frozen=True, eq=False)
class Follower(Controller):
    """The controller of a task that follows a trajectory."""

    gain: float | None  # per second; None for all of it in one period

    def gain_row(self, given: Given) -> Rows:
        """Return the row of the gain, which is infinite for all of a distance in one period."""
        return given.program.constant(math.inf if self.gain is None else self.gain)

    def busy(self, given: Given, way: Followed) -> Rows:
        """Add the stage of whether the trajectory is not over, and return its row."""
        busy = given.program.rows()
        given.program.add(following.going, seconds=way.seconds, duration=given.dt, out=busy)
        return busy


def check_trajectory(value: Any, what: str) -> None:
    """Raise InputError unless a value has at(t) and a duration."""
    if isinstance(value, type) or not callable(getattr(value, "at", None)):
        raise InputError(f"{what}: expected an object with duration and at(t), got {said(value)}")
    not_negative(getattr(value, "duration", math.nan), f"{what}.duration (seconds)")
