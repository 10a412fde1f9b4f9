"""Controls: the values that a person may change by hand, as their declarations say them.

Each `Spec` says by `controls` how what it declares is touched: a slider within its bounds, a
switch, a choice, or several of them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from robsim.declare.quantities import ExactQuantity
from robsim.declare.spec import Context, Raw

# how far from zero a slider reaches where no bound is declared and the value is small, by unit
REACH = {"m": 0.5, "rad": math.pi, "s": 0.5, "px": 5.0, "per second": 5.0, "m/s": 1.0, "rad/s": 2.0}
FACTOR = 4.0  # times the value, likewise where it is large


@dataclass(frozen=True)
class Control:
    """A value that a person may change, with what its declaration says of it.

    path     dotted name of the value, as `Experiment.at` takes it
    form     "number", "whole", "flag", "choice" or "numbers"
    value    a number in SI, a truth value, a word, or a list of numbers
    low      lowest value that is offered, and `high` the highest; one for each of "numbers"
    united   whether a text says it with its unit
    beside   other names with values that must be said along with it
    """

    path: str
    form: str
    value: Any
    meaning: str = ""
    unit: Any = ""
    low: Any = None
    high: Any = None
    options: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    united: bool = False
    beside: Mapping[str, Any] = field(default_factory=dict)

    def changes(self, value: Any) -> dict[str, Raw]:
        """Return what `Experiment.at` takes to give it another value, of the kind of its own."""
        return {**self.beside, self.path: self._raw(value)}

    def _raw(self, value: Any) -> Raw:
        if self.form == "choice":
            return f'"{value}"'  # which is a text also where it reads as something else
        if not self.united:
            return value
        if isinstance(self.unit, str):
            return ExactQuantity(value, self.unit)
        return [ExactQuantity(x, unit) for x, unit in zip(value, self.unit, strict=True)]


@dataclass(frozen=True)
class ControlPlace:
    """The dotted name of a value, what it means, and what is known there."""

    path: str
    c: Context
    meaning: str = ""
    beside: Mapping[str, Any] = field(default_factory=dict)

    def at(self, key: str | int, meaning: str = "") -> ControlPlace:
        """Return the place of a value inside."""
        path = f"{self.path}.{key}" if self.path else str(key)
        return replace(self, path=path, meaning=meaning)

    def with_(self, path: str, value: Any) -> ControlPlace:
        """Return the same place, where another name must be said along with what is changed."""
        return replace(self, beside={**self.beside, path: value})

    def control(self, form: str, value: Any, **more: Any) -> Control:
        """Return the control of the value here."""
        return Control(self.path, form, value, self.meaning, beside=self.beside, **more)

    def slider(
        self,
        value: float,
        unit: str,
        low: float | None,
        high: float | None,
        united: bool = False,
        open_ends: tuple[bool, bool] = (False, False),
    ) -> Control:
        """Return the control of a number, which reaches far enough where it has no bounds.

        A bound that is not a value itself is left out by a thousandth of the reach.
        """
        first, last = _compute_slider_range(value, unit, low, high, 0.0, FACTOR)
        gap = 1e-3 * (last - first)
        first, last = first + gap * open_ends[0], last - gap * open_ends[1]
        return self.control("number", float(value), unit=unit, united=united, low=first, high=last)

    def several(
        self, values: Any, names: Sequence[str], unit: Any, united: bool = True, limits: Any = None
    ) -> Control:
        """Return the control of several numbers, within limits (n, 2) where there are any."""
        each = [float(x) for x in values]
        units = [unit] * len(each) if isinstance(unit, str) else unit
        bounds = limits if limits is not None else [(None, None)] * len(each)
        ends = [
            _compute_slider_range(x, u, low, high, x, 1.0)
            for x, u, (low, high) in zip(each, units, bounds, strict=True)
        ]
        first, last = map(list, zip(*ends, strict=True))
        more = {"names": tuple(names), "unit": unit, "united": united}
        return self.control("numbers", each, low=first, high=last, **more)


def _compute_slider_range(
    value: float, unit: str, low: float | None, high: float | None, middle: float, factor: float
) -> tuple[float, float]:
    """Return the bounds of a number, or where there are none how far it reaches from a middle."""
    far = max(factor * abs(value), REACH.get(unit, 1.0))
    ends = (low, middle - far), (high, middle + far)
    first, last = (float(x) if x is not None and math.isfinite(x) else reach for x, reach in ends)
    return first, last
