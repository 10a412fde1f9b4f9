"""The clock of a controller: which period it is, from times that come when they come."""

from __future__ import annotations

from typing import Any

from robsim.base.arrays import number
from robsim.base.errors import InputError, said


class Clock:
    """The periods of a controller, counted from the first time that it is told."""

    def __init__(self, dt: float) -> None:
        self.dt = dt
        self.step = -1  # the number of the period that goes on
        self.start = self.now = 0.0

    def told(self, t: Any) -> bool:
        """Take a time in seconds, and return whether another period has begun.

        A period begins half of it before its time, so that calls may come a little early or late;
        where some were left out, their numbers are.

        InputError: no time, or one before the last.
        """
        seconds = number(t, "t (seconds)")
        if self.step < 0:
            self.start = self.now = seconds
            self.step = 0
            return True
        if seconds < self.now - 0.5 * self.dt:
            raise InputError(f"t: the clock goes backwards, to {said(t)} after {self.now:.9g} s")
        step = round((seconds - self.start) / self.dt)
        self.now = max(seconds, self.now)
        if step <= self.step:
            return False
        self.step = step
        return True

    def go_on(self) -> None:
        """Let the next period begin, where no time can be told."""
        self.step, self.now = max(self.step, -1) + 1, self.now + self.dt
