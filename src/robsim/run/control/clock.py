"""The clock of a controller: which period it is, from times that come when they come."""

from __future__ import annotations

import math
import time
from typing import Any

from robsim.base.arrays import as_float
from robsim.base.errors import InputError, format_value

STANDS = 1000  # calls at one time, from which on the clock is taken to stand still
MOST = 2.0**53  # periods, which can be counted


class ControlClock:
    """The periods of a controller, counted from the first time that it is told."""

    def __init__(self, dt: float) -> None:
        self.dt = dt
        self.step = -1  # the number of the period that goes on
        self.start = self.now = 0.0
        self.turned_back = False  # by the last time that was told
        self._calls = 0  # in this period
        self._without = -1, -math.inf  # the last period that began without a time, and when

    def told(self, t: Any) -> int:
        """Take a time in seconds, and return how many periods have begun since the last one.

        A period begins half of it before its time, so that calls may come a little early or late.

        InputError: no time, one that cannot be, or one before the last, from which the clock is
        then taken to go on.
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
        self._calls = 0 if passed else self._calls + 1
        if self._calls >= STANDS:
            raise InputError(f"t: the clock stands still at {self.now:.9g} s")
        return passed

    def begins_without(self) -> bool:
        """Return whether a period begins where no time can be told, by the computer's own clock."""
        step, before = self._without
        now = time.monotonic()
        if step == self.step and now - before < self.dt:
            return False
        self._without = self.step, now
        return True

    def _turn_back(self, seconds: float) -> str:
        """Let the clock go on from a time before the last, and return what is to be said."""
        message = f"t: the clock goes backwards, to {seconds:.9g} s after {self.now:.9g} s"
        self.start, self.now, self.turned_back = seconds - self.step * self.dt, seconds, True
        return message
