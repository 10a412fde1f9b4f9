"""Values that come from pages, checked against the controls that are there."""

from __future__ import annotations

from typing import Any

from robsim.base.errors import InputError, said
from robsim.declare.controls import Control


def checked(control: Control, value: Any) -> Any:
    """Return a value of the kind of a control; InputError for any other.

    Whether it is within bounds, its declaration says.
    """
    if not _FITS[control.form](control, value):
        raise InputError(f"{control.path}: expected {_WORDS[control.form]}, got {said(value)}")
    return float(value) if control.form == "number" else value


def is_number(value: Any) -> bool:
    """Return whether a value of JSON is a number."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def is_whole(value: Any) -> bool:
    """Return whether a value of JSON is a whole number."""
    return isinstance(value, int) and not isinstance(value, bool)


def _is_row(control: Control, value: Any) -> bool:
    listed = isinstance(value, list) and len(value) == len(control.names)
    return listed and all(map(is_number, value))


_FITS = {
    "number": lambda control, value: is_number(value),
    "whole": lambda control, value: is_whole(value),
    "flag": lambda control, value: isinstance(value, bool),
    "choice": lambda control, value: isinstance(value, str) and value in control.options,
    "numbers": _is_row,
}
_WORDS = {
    "number": "a number",
    "whole": "a whole number",
    "flag": "true or false",
    "choice": "one of its options",
    "numbers": "as many numbers as it has names",
}
