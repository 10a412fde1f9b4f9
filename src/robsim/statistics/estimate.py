"""An estimated number with its interval."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Estimate:
    """A number estimated from `of` values, with the ends of its interval.

    The number is NaN without values. An end of the interval is infinite if there are too few
    values. A share has the unit "%" and is printed in percent.

    Examples
    --------
    >>> print(Estimate(0.8, 0.49, 0.943, 10, "%"))
    80.0 % [49.0, 94.3]
    """

    value: float
    low: float
    high: float
    of: int
    unit: str = ""

    @property
    def numbers(self) -> tuple[float, float, float]:
        """The number and the ends of its interval."""
        return self.value, self.low, self.high

    @property
    def count(self) -> int:
        """The count of a share: the number of successes among the `of` values."""
        return round(self.value * self.of) if self.of else 0

    def text(self, form: str = "+z.3g", scale: float = 1.0) -> str:
        """Return the number and its interval, as "+0.12 [-0.04, +0.27]"; "-" for NaN."""
        if math.isnan(self.value):
            return "-"
        value, low, high = (format(scale * each, form) for each in self.numbers)
        gap = f" {self.unit}" if self.unit else ""
        return f"{value}{gap} [{low}, {high}]" if math.isfinite(self.low) else f"{value}{gap} [-]"

    def __str__(self) -> str:
        """Return the number and its interval, a share in percent."""
        return self.text(".1f", 100.0) if self.unit == "%" else self.text()
