"""Values from pages, checked against the controls of the experiment."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from robsim.base.errors import InputError, format_value, is_known_name
from robsim.declare.controls import Control
from robsim.studio.rounded_values import round_control_value


def check_control_value(control: Control, value: Any) -> Any:
    """Return a value from a page, rounded; raise InputError unless it fits the form of the control.

    The bounds of the value are checked later, by the declaration of the control.
    """
    fits, words = _FORMS[control.form]
    if not fits(control, value):
        raise InputError(f"{control.path}: expected {words}, got {format_value(value)}")
    return round_control_value(control, value)


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
