"""The clock of a controller: the number of its period, from irregular times."""

from __future__ import annotations

import math
import time
from typing import Any

from robsim.base.arrays import as_float
from robsim.base.errors import InputError, format_value

STANDS = 1000  # calls at one time after which the clock counts as stopped
MOST = 2.0**53  # periods that a float can count


class ControlClock:
    """Counter of the periods of a controller, from the first time that it gets."""

    def __init__(self, dt: float) -> None:
        self.dt = dt
        self.step = -1  # the number of the current period
        self.start = self.now = 0.0
        self.turned_back = False  # whether the last time was before the time before it
        self._calls_in_period = 0
        self._last_without_time = (
            -1,
            -math.inf,
        )  # the last period that began without a time, and its start

    def advance(self, t: Any) -> int:
        """Advance to a time in seconds, and return the number of periods that have begun.

        A period begins half a period before its time, so that calls may be a little early or late.
        Raise InputError if the time is not valid, or if it is before the last time; the clock then
        continues from it.
        """
        self.turned_back = False
        seconds = as_float(t, "t (seconds)")
        if self.step < 0:
            self.start = self.now = seconds
            self.step = 0
            return 1
        if not abs(seconds - self.start) / self.dt < MOST:
            raise InputError(
                f"t: {format_value(t)} s is too far from the start, {self.start:.9g} s"
            )
        if seconds < self.now - 0.5 * self.dt:
            raise InputError(self._turn_back(seconds))
        self.now = max(seconds, self.now)
        passed = max(round((seconds - self.start) / self.dt) - self.step, 0)
        self.step += passed
        self._calls_in_period = 0 if passed else self._calls_in_period + 1
        if self._calls_in_period >= STANDS:
            raise InputError(f"t: the clock stands still at {self.now:.9g} s")
        return passed

    def begins_without_time(self) -> bool:
        """Return whether a period begins without a valid time, by the computer's own clock."""
        step, before = self._last_without_time
        now = time.monotonic()
        if step == self.step and now - before < self.dt:
            return False
        self._last_without_time = self.step, now
        return True

    def _turn_back(self, seconds: float) -> str:
        """Restart the clock at a time before the last, and return the message about it."""
        message = f"t: the clock goes backwards, to {seconds:.9g} s after {self.now:.9g} s"
        self.start, self.now, self.turned_back = seconds - self.step * self.dt, seconds, True
        return message
