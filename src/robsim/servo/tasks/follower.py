"""The common part of tasks that follow a trajectory."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, not_negative
from robsim.base.errors import InputError
from robsim.servo.controller import Controller, Decision
from robsim.servo.deciding import Deciding
from robsim.servo.given import Commanded, Given
from robsim.servo.measurement import Measurement, remember

ENDED = 1e-9  # of a period: times that differ by less are one


@dataclass(frozen=True, eq=False)
class Follower(Controller):
    """The controller of a task that follows a trajectory."""

    gain: float | None  # per second; None for all of it in one period

    def stages(self, given: Given) -> Commanded:
        """Add the stages of an instant to a program, and return the rows that they write."""
        deciding = Deciding(self, given)
        given.program.call(deciding)
        return deciding.rows

    @abstractmethod
    def decide(self, measurement: Measurement) -> Decision:
        """Return the command of an instant, with what it is based on."""

    @abstractmethod
    def planned(self, start: Array) -> Any:
        """Return the trajectory of runs from where they started, with the run first."""

    def trajectory(self, measurement: Measurement, there: Array) -> Any:
        """Return the trajectory of these runs, planned from where they were at their start.

        Now they are `there`, the run last.
        """
        if "start" not in measurement.memory:
            remember(measurement.memory, "start", there)
        plan = self.planned(measurement.memory["start"])
        if "until" not in measurement.memory:
            seconds = np.broadcast_to(plan.duration, (measurement.runs,))
            measurement.memory["until"] = np.array(seconds, dtype=float)
        return plan

    def busy(self, measurement: Measurement) -> NDArray[np.bool_]:
        """Return (B,): in which runs the trajectory is not over; asked after the decision."""
        going: NDArray[np.bool_] = (
            measurement.time < measurement.memory["until"] - ENDED * measurement.dt
        )
        return going

    def rate(self, dt: float) -> float:
        """Return the gain per second, at most what makes up all of a distance in one period."""
        return 1.0 / dt if self.gain is None else min(self.gain, 1.0 / dt)


def check_trajectory(value: Any, what: str) -> None:
    """Raise InputError unless a value has at(t) and a duration."""
    if isinstance(value, type) or not callable(getattr(value, "at", None)):
        raise InputError(f"{what}: expected an object with duration and at(t), got {value!r:.80}")
    not_negative(getattr(value, "duration", math.nan), f"{what}.duration (seconds)")
