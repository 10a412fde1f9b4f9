"""A clock of a controller that follows the stamps of messages, also if the stamps leap."""

from __future__ import annotations

import math

LEAP = 0.5  # seconds: larger differences of stamps and elapsed time are another clock


class StampClock:
    """Continuous time in seconds from stamps, which may repeat, turn back or leap.

    Attributes
    ----------
    now : float
        Time of the controller, which never decreases.
    offset : float
        Difference of the controller's time and the stamps.
    leap : float
        Leap of the stamps in the last call of `advance`, 0 without a leap.

    Examples
    --------
    >>> clock = StampClock()
    >>> clock.advance(100.0, 0.0), clock.advance(100.02, 0.02)
    (100.0, 100.02)
    >>> clock.advance(100.02, 0.02) is None  # a repeated message
    True
    >>> round(clock.advance(50.0, 0.04), 3), round(clock.leap, 3)
    (100.04, -50.04)
    """

    def __init__(self) -> None:
        self.now = self.stamp = -math.inf
        self.offset = self.leap = self._heard = 0.0

    def advance(self, stamp: float, elapsed: float | None) -> float | None:
        """Return the time at a stamp, or None for a stamp that repeats or is late.

        Parameters
        ----------
        stamp : float
            Stamp in seconds.
        elapsed : float or None
            Seconds of this computer's monotonic clock; None if time passes by stamps only.
        """
        self.leap = 0.0
        if self.stamp > -math.inf:
            passed = stamp - self.stamp
            since = max(passed, 0.0) if elapsed is None else elapsed - self._heard
            if passed < -LEAP or (elapsed is not None and passed > since + LEAP):
                self.leap = passed - since
                self.offset = self.now + since - stamp
            elif passed <= 0.0:
                return None
            self.offset += max(self.now - (stamp + self.offset), 0.0)
        self.stamp, self._heard = stamp, 0.0 if elapsed is None else elapsed
        self.now = stamp + self.offset
        return self.now

    def tick(self, seconds: float) -> float:
        """Advance by some time without a stamp, and return the time."""
        self.now += seconds
        return self.now
