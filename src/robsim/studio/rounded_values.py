"""Numbers from the hand of a user, rounded to the digits that pages show and files store."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from robsim.base import si_units
from robsim.declare.controls import Control

DIGITS = 6  # significant digits of a number that is typed or set by a slider


def round_control_value(control: Control, value: Any) -> Any:
    """Return a value from a page with the digits that the page shows.

    Numbers have six significant digits in the unit of the page, which is degrees for radians. Whole
    numbers of more digits remain whole. A number that equals the present number stays exact, and a
    number within the range of the control stays within it.

    >>> control = Control("task.gain", "number", 0.5, unit="per second", low=0.0, high=2.0)
    >>> round_control_value(control, 0.7999999999), round_control_value(control, 2.5000000001)
    (0.8, 2.5)
    """
    if control.form == "number":
        assert not isinstance(control.low, list) and not isinstance(control.high, list)
        return _round_new(value, control.value, str(control.unit), control.low, control.high)
    if control.form != "numbers":
        return value
    ends = zip(control.low or [], control.high or [], strict=True)  # type: ignore[arg-type]
    rows = zip(value, control.value, list_control_units(control), ends, strict=True)
    return [_round_new(new, old, unit, *bounds) for new, old, unit, bounds in rows]


def list_control_units(control: Control) -> list[str]:
    """Return the SI unit of each number of a control."""
    count = len(control.value) if control.form == "numbers" else 1
    return [control.unit] * count if isinstance(control.unit, str) else list(control.unit)


def _round_new(new: float, old: float, unit: str, low: float | None, high: float | None) -> float:
    """Return a number rounded to the shown digits, unless it is the old one."""
    if new == old:
        return old
    factor = float(si_units.deg) if unit.startswith("rad") else 1.0
    shown = new / factor
    if not shown or not math.isfinite(shown):
        return float(new)
    decimals = max(DIGITS - 1 - math.floor(math.log10(abs(shown))), 0)
    rounded = round(shown, decimals)
    step = 10.0**-decimals
    if high is not None and new <= high < rounded * factor:
        rounded = round(rounded - step, decimals)
    elif low is not None and rounded * factor < low <= new:
        rounded = round(rounded + step, decimals)
    return rounded * factor


def round_dragged_value(control: Control, numbers: Sequence[float]) -> list[float]:
    """Return numbers of a dragged pose, rounded to 0.1 mm and 0.01 degrees.

    Coordinates of joints have one more digit, so that the pose has this accuracy. Numbers that the
    drag leaves within the accuracy stay exact; the components of a rotation vector only together.

    >>> control = Control("objects.plate.position", "numbers", [0.31, 0.0, 0.1], unit="m",
    ...                   names=("x", "y", "z"))
    >>> round_dragged_value(control, [0.310000001, 0.0523678, 0.1])
    [0.31, 0.0524, 0.1]
    """
    more = 1 if control.path.endswith(".q") else 0
    rows = list(zip(numbers, control.value, list_control_units(control), strict=True))
    rounded = [_round_dragged(new, unit, more) for new, _, unit in rows]
    kept = [_round_dragged(new - old, unit, more) == 0 for new, old, unit in rows]
    if control.path.endswith(".rotvec") and not all(kept):
        return rounded
    return [old if keep else x for (_, old, _), keep, x in zip(rows, kept, rounded, strict=True)]


def _round_dragged(number: float, unit: str, more_digits: int) -> float:
    """Return a length rounded to 0.1 mm, or an angle to 0.01 degrees."""
    if unit == "rad":
        return round(number / si_units.deg, 2 + more_digits) * float(si_units.deg) + 0.0
    return round(number, 4 + more_digits) + 0.0
