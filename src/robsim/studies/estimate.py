"""An estimated number with its interval."""

from __future__ import annotations

import math
from typing import NamedTuple


class Estimate(NamedTuple):
    """A number that was estimated of so many, with the ends of its interval.

    NaN is a number that none tells, and an infinite end is one that too few tell.
    """

    value: float
    low: float
    high: float
    of: int

    def text(self, form: str = "+z.3g", scale: float = 1.0) -> str:
        """Return the number and its interval, as "+0.12 [-0.04, +0.27]"; "-" for no number."""
        if math.isnan(self.value):
            return "-"
        value, low, high = (format(scale * each, form) for each in self[:3])
        return f"{value} [{low}, {high}]" if math.isfinite(self.low) else f"{value} [-]"

    def __str__(self) -> str:
        """Return the number and its interval."""
        return self.text()
