"""Values from pages, checked against the controls of the experiment."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

from robsim.base.errors import InputError, format_value, is_known_name
from robsim.declare.controls import Control
from robsim.declare.exact_quantity import ExactQuantity
from robsim.declare.short_numbers import shorten_numbers
from robsim.studio.rounded_values import list_control_units, round_control_value


def check_control_value(control: Control, value: Any) -> Any:
    """Return a value from a page, rounded; raise InputError unless it fits the form of the control.

    The bounds of the value are checked later, by the declaration of the control.
    """
    fits, words = _FORMS[control.form]
    if not fits(control, value):
        raise InputError(f"{control.path}: expected {words}, got {format_value(value)}")
    return round_control_value(control, value)


def build_changes(controls: Mapping[str, Control], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the argument of `Experiment.at` that sets values from a page by dotted name.

    A value has the form of its control, or a form that `Experiment.at` accepts.
    """
    changes: dict[str, Any] = {}
    for name, value in values.items():
        control = controls.get(name)
        fits = control is not None and _FORMS[control.form][0](control, value)
        changes |= control.changes(value) if control and fits else {name: value}
    return changes


def describe_differences(
    before: Mapping[str, Control], after: Mapping[str, Control], changed: Mapping[str, Any]
) -> list[dict[str, Any]]:
    """Return path and texts before and after of all values that differ in two experiments.

    "original" is the value before in the form of the control; None if a page cannot send it.

    `before` and `after` are the controls of both. Values of `changed` are listed even if one of the
    experiments lacks them. A believed value that differs like the true value is left out.
    """
    names = [name for name in after if name in before or name in changed]
    texts = {
        name: (_format_if_any(before.get(name)), _format_if_any(after[name]))
        for name in names
        if name not in before or before[name].value != after[name].value
    }
    return [
        {"path": name, "before": old, "after": new, "original": _get_sendable(before.get(name))}
        for name, (old, new) in texts.items()
        if old != new and not _follows_truth(name, texts)
    ]


def _follows_truth(name: str, texts: Mapping[str, tuple[str, str]]) -> bool:
    """Return whether a name belongs to the belief, and its true value differs in the same way."""
    return name.startswith("belief.") and texts.get(name.removeprefix("belief.")) == texts[name]


def _get_sendable(control: Control | None) -> Any:
    """Return the value of a control; None without a control, or if JSON does not have the value."""
    value = control.value if control else None
    numbers = value if isinstance(value, list) else [value]
    finite = all(math.isfinite(x) for x in numbers if isinstance(x, int | float))
    return value if finite else None


def _format_if_any(control: Control | None) -> str:
    return "" if control is None else format_control_value(control)


def format_control_value(control: Control) -> str:
    """Return the value of a control as text, in the units in which pages show it.

    >>> format_control_value(Control("task.gain", "number", 0.5, unit="per second"))
    '0.5 1/s'
    >>> format_control_value(Control("start.q", "numbers", [0.0, math.pi / 3], unit="rad"))
    '0, 60 deg'
    """
    value = control.value
    if control.form == "flag":
        return "yes" if value else "no"
    if control.form == "choice":
        return str(value)
    units = list_control_units(control)
    numbers = [value] if control.form in ("number", "whole") else list(value)
    if len(set(units)) == 1:
        return _format_quantity(numbers, units[0])
    return ", ".join(_format_quantity([x], unit) for x, unit in zip(numbers, units, strict=True))


def _format_quantity(numbers: list[float], unit: str) -> str:
    """Return numbers with their unit; of rounded numbers, if the exact ones are long."""
    if unit == "per second":
        return f"{_join_numbers(numbers)} 1/s"
    if unit.startswith("rad"):
        numbers = [math.degrees(x) for x in numbers]
        unit = unit.replace("rad", "deg", 1)
        return f"{_join_numbers(numbers)} {unit}"
    if unit in ("m", "s", "kg"):
        return _shorten_quantity(tuple(float(f"{x:.4g}") for x in numbers), unit)
    return f"{_join_numbers(numbers)} {unit}".removesuffix(" 1").rstrip()


@lru_cache(256)
def _shorten_quantity(numbers: tuple[float, ...], unit: str) -> str:
    """Return the shortest text of numbers with their unit."""
    return str(shorten_numbers(ExactQuantity(numbers, unit)))


def _join_numbers(numbers: list[float]) -> str:
    """Return numbers with four digits, without exponents that are not needed."""
    return ", ".join(f"{x + 0.0:.4g}" for x in numbers)


def convert_radians(text: str) -> str:
    """Return a message with its angles in degrees, as pages show them.

    >>> convert_radians("'link1' is 9 rad, outside its limits [-2.8973, 2.8973] rad")
    "'link1' is 515.7 deg, outside its limits [-166, 166] deg"
    """
    return _ANGLES.sub(_convert_angles, text)


def _convert_angles(match: re.Match[str]) -> str:
    numbers, quote, unit = match.groups()
    degrees = _NUMBER.sub(lambda each: f"{math.degrees(float(each[0])):.4g}", numbers)
    return f"{degrees}{quote}{unit.replace('rad', 'deg', 1)}"


_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_LISTED = rf"{_NUMBER.pattern}(?:\s*(?:,|to|and)\s*{_NUMBER.pattern})*"  # several numbers
_ANGLES = re.compile(rf"(\[{_LISTED}\]|(?<![\w.]){_LISTED})('?\s)(rad(?:/s(?:\^2)?)?)(?![\w/])")


def is_json_number(value: Any) -> bool:
    """Return whether a JSON value is a number."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def is_json_integer(value: Any) -> bool:
    """Return whether a JSON value is an integer."""
    return isinstance(value, int) and not isinstance(value, bool)


def _is_number_row(control: Control, value: Any) -> bool:
    """Return whether a value is a list with one number for each name of the control."""
    is_list = isinstance(value, list) and len(value) == len(control.names)
    return is_list and all(map(is_json_number, value))


_FORMS: dict[str, tuple[Callable[[Control, Any], bool], str]] = {
    "number": (lambda control, value: is_json_number(value), "a number"),
    "whole": (lambda control, value: is_json_integer(value), "a whole number"),
    "flag": (lambda control, value: isinstance(value, bool), "true or false"),
    "choice": (lambda control, value: is_known_name(value, control.options), "one of its options"),
    "numbers": (_is_number_row, "one number for each of its names"),
}
