"""Values from pages, checked against the controls of the experiment."""

from __future__ import annotations

import math
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

    A value has the form of its control, and is rounded, or has a form that `Experiment.at` accepts.
    """
    changes: dict[str, Any] = {}
    for name, value in values.items():
        control = controls.get(name)
        fits = control is not None and _FORMS[control.form][0](control, value)
        if control and fits:
            changes |= control.changes(round_control_value(control, value))
        else:
            changes[name] = value
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
        name: _format_change(before.get(name), after[name])
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
    value = control.value if control and control.form != "list" else None
    numbers = value if isinstance(value, list) else [value]
    finite = all(math.isfinite(x) for x in numbers if isinstance(x, int | float))
    return value if finite else None


def _format_change(before: Control | None, after: Control) -> tuple[str, str]:
    """Return the texts of a value before and after, in the same units."""
    old = "" if before is None else format_control_value(before, after)
    return old, format_control_value(after, before)


def format_control_value(control: Control, beside: Control | None = None) -> str:
    """Return the value of a control as text, in units that suit the value `beside` it too.

    >>> format_control_value(Control("task.gain", "number", 0.5, unit="per second"))
    '0.5 1/s'
    >>> format_control_value(Control("start.q", "numbers", [0.0, math.pi / 3], unit="rad"))
    '0, 60 deg'
    >>> near, far = (Control("objects.cup.x", "number", x, unit="m") for x in (0.31, 0.318))
    >>> format_control_value(near), format_control_value(near, far)
    ('31 cm', '310 mm')
    """
    value, units = control.value, list_control_units(control)
    if control.form == "flag":
        return "yes" if value else "no"
    if control.form == "choice":
        return str(value)
    if control.form == "list":
        return ", ".join(value).replace("_", " ")
    numbers = _list_numbers(control)
    fits = beside is not None and beside.form == control.form
    others = _list_numbers(beside) if beside and fits else numbers
    if len(set(units)) == 1:
        return _format_quantity(numbers, units[0], others)
    rows = zip(numbers, units, others, strict=True)
    return ", ".join(_format_quantity([x], unit, [other]) for x, unit, other in rows)


def _list_numbers(control: Control) -> list[float]:
    """Return the numbers of a control with one number or several."""
    return list(control.value) if control.form == "numbers" else [control.value]


def _format_quantity(numbers: list[float], unit: str, others: list[float]) -> str:
    """Return numbers with their unit; of rounded numbers, if the exact ones are long.

    Lengths, times and masses have the unit that makes them and the `others` short.
    """
    if unit == "per second":
        return f"{_join_numbers(numbers)} 1/s"
    if unit.startswith("rad"):
        numbers = [math.degrees(x) for x in numbers]
        unit = unit.replace("rad", "deg", 1)
        return f"{_join_numbers(numbers)} {unit}"
    if unit in ("m", "s", "kg"):
        rounded = tuple(float(f"{x:.4g}") for x in (*numbers, *others))
        words, common = _shorten_quantity(rounded, unit).rsplit(" ", 1)
        return f"{', '.join(words.split(', ')[: len(numbers)])} {common}"
    return f"{_join_numbers(numbers)} {unit}".removesuffix(" 1").rstrip()


@lru_cache(256)
def _shorten_quantity(numbers: tuple[float, ...], unit: str) -> str:
    """Return the shortest text of numbers with their unit."""
    return str(shorten_numbers(ExactQuantity(numbers, unit)))


def _join_numbers(numbers: list[float]) -> str:
    """Return numbers with four digits, without exponents that are not needed."""
    return ", ".join(f"{x + 0.0:.4g}" for x in numbers)


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


def _is_item_row(control: Control, value: Any) -> bool:
    """Return whether a value is a list of different items of the control, and of kinds to add."""
    if not isinstance(value, list):
        return False
    kept = [each for each in value if is_json_integer(each)]
    known = all(0 <= each < len(control.items) for each in kept) and len(set(kept)) == len(kept)
    added = (each for each in value if not is_json_integer(each))
    return known and all(is_known_name(each, control.options) for each in added)


_FORMS: dict[str, tuple[Callable[[Control, Any], bool], str]] = {
    "number": (lambda control, value: is_json_number(value), "a number"),
    "whole": (lambda control, value: is_json_integer(value), "a whole number"),
    "flag": (lambda control, value: isinstance(value, bool), "true or false"),
    "choice": (lambda control, value: is_known_name(value, control.options), "one of its options"),
    "numbers": (_is_number_row, "one number for each of its names"),
    "list": (_is_item_row, "numbers of its items and kinds to add"),
}
