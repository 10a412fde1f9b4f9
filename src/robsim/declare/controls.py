"""Controls: editable values for user interfaces, derived from declarations.

The method `controls` of a `Spec` returns its widgets: a slider within the bounds, a switch, a
choice, several sliders, or a list of kinds.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from robsim.declare.context import Context, FieldValue, Raw
from robsim.declare.exact_quantity import ExactQuantity

# range of a slider without declared bounds, for small values, by unit
REACH = {"m": 0.5, "rad": math.pi, "s": 0.5, "px": 5.0, "per second": 5.0, "m/s": 1.0, "rad/s": 2.0}
FACTOR = 4.0  # range of a slider without declared bounds, as a multiple of a large value


@dataclass(frozen=True)
class Control:
    """An editable value, with the data of its declaration.

    Attributes
    ----------
    path : str
        Dotted name of the value, for `Experiment.at`.
    form : {"number", "whole", "flag", "choice", "numbers", "list"}
        Type of the widget.
    value : object
        Number in SI units, truth value, word, list of numbers, or list of the kinds of objects.
        A new value of a "list" has the indices of the objects that are kept, and new kinds.
    meaning : str
        Description of the value.
    unit : str
        SI unit; a sequence for "numbers".
    low, high : float
        Lowest and highest offered value; lists for "numbers"; numbers of objects for "list".
    options : tuple of str
        Words of a choice, or kinds that can be added to a "list".
    names : tuple of str
        Names of "numbers".
    united : bool
        Whether a text has the number with its unit.
    beside : dict
        Other dotted names with values that must change along with this one.
    items : tuple of object
        Objects of a "list".
    starters : dict
        New object of a "list" by kind.
    """

    path: str
    form: str
    value: FieldValue
    meaning: str = ""
    unit: str | Sequence[str] = ""
    low: float | list[float] | None = None
    high: float | list[float] | None = None
    options: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    united: bool = False
    beside: Mapping[str, Any] = field(default_factory=dict)
    items: tuple[object, ...] = ()
    starters: Mapping[str, object] = field(default_factory=dict, compare=False)

    def changes(self, value: FieldValue) -> dict[str, Raw]:
        """Return the argument of `Experiment.at` that sets the value."""
        return {**self.beside, self.path: self._raw(value)}

    def _raw(self, value: FieldValue) -> Raw:
        if self.form == "choice":
            return f'"{value}"'  # quoted: a text even if it looks like another value
        if self.form == "list":
            if list(value) == self.value:
                return self.items
            return tuple(
                self.starters[each] if isinstance(each, str) else self.items[each] for each in value
            )
        if not self.united:
            return value
        if isinstance(self.unit, str):
            return ExactQuantity(value, self.unit)
        return [ExactQuantity(x, unit) for x, unit in zip(value, self.unit, strict=True)]


@dataclass(frozen=True)
class ControlPlace:
    """The dotted name of a value, its meaning, and the context there."""

    path: str
    c: Context
    meaning: str = ""
    beside: Mapping[str, Any] = field(default_factory=dict)

    def at(self, key: str | int, meaning: str = "", c: Context | None = None) -> ControlPlace:
        """Return the place of a value inside, in the same context or in another one."""
        path = f"{self.path}.{key}" if self.path else str(key)
        return ControlPlace(path, c or self.c, meaning, self.beside)

    def with_(self, path: str, value: Any) -> ControlPlace:
        """Return the same place with another name that must be set along with each change."""
        return ControlPlace(self.path, self.c, self.meaning, {**self.beside, path: value})

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
        """Return the control of a number, with a default range if it has no bounds.

        A range with an open end is shortened there by a thousandth.
        """
        first, last = _compute_slider_range(value, unit, low, high, 0.0, FACTOR)
        gap = 1e-3 * (last - first)
        first, last = first + gap * open_ends[0], last - gap * open_ends[1]
        return self.control("number", float(value), unit=unit, united=united, low=first, high=last)

    def several(
        self, values: Any, names: Sequence[str], unit: Any, united: bool = True, limits: Any = None
    ) -> Control:
        """Return the control of several numbers, within limits (n, 2) if these are passed."""
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

    def item_list(
        self,
        items: Iterable[object],
        kinds: Iterable[str],
        starters: Mapping[str, object],
        counts: tuple[int, int],
    ) -> Control:
        """Return the control that removes items of a list, and adds new ones by their kinds."""
        low, high = map(float, counts)
        more = {"items": tuple(items), "options": tuple(starters), "starters": starters}
        return self.control("list", list(kinds), low=low, high=high, **more)


def _compute_slider_range(
    value: float, unit: str, low: float | None, high: float | None, middle: float, factor: float
) -> tuple[float, float]:
    """Return the bounds of a number, or a default range about `middle`."""
    far = max(factor * abs(value), REACH.get(unit, 1.0))
    ends = (low, middle - far), (high, middle + far)
    first, last = (float(x) if x is not None and math.isfinite(x) else reach for x, reach in ends)
    return first, last
