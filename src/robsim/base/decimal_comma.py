"""Corrections of numbers with a decimal comma, and of numbers with a unit but without quotes."""

from __future__ import annotations

import re
import tomllib

_GROUPED = re.compile(r"\d{1,3}(?:\.\d{3})+(?=,\d)")  # 1.234,5
_COMMA = re.compile(r"(?<=\d),(?=\d)")
_NUMBERS = re.compile(r"[+-]?[\d.]+(?:e[+-]?\d+)?(?:\s*,\s*[+-]?[\d.]+(?:e[+-]?\d+)?)*", re.I)
_UNIT = r"(?:[ \t]*[a-zA-Zµ°%][\w/^*µ°²³%]*)"
_BARE = re.compile(rf"(?<![\w.\"'])[+-]?\d[\d.]*(?:,\d+)?(?:e[+-]?\d+)?{_UNIT}?(?![\w.\"'])")
LONGEST = 300  # characters of a line that is corrected


def suggest_decimal_point(text: object, count: int | None = None) -> str:
    """Return "; write ..." with decimal points, or "" if this does not give `count` numbers.

    >>> suggest_decimal_point("22,86 cm"), suggest_decimal_point("31, 0, 10 cm")
    ('; write "22.86 cm", with a decimal point', '')
    """
    if not isinstance(text, str) or len(text) > LONGEST:
        return ""
    fixed = replace_decimal_commas(text.strip())
    numbers = _NUMBERS.match(fixed)
    if fixed == text.strip() or not numbers or len(numbers[0].split(",")) != (count or 1):
        return ""
    quoted = f'"{fixed}"' if fixed[numbers.end() :].strip() or count else fixed
    return f"; write {quoted}, with a decimal point"


def replace_decimal_commas(text: str) -> str:
    """Return a text with points in place of commas between digits, and without points in groups."""
    grouped = _GROUPED.sub(lambda match: match[0].replace(".", ""), text)
    return _COMMA.sub(".", grouped)


def suggest_toml_line(line: str, column: int) -> str:
    """Return a message with the corrected line of a text that is not valid TOML, or "".

    Numbers with a unit get quotes, and decimal commas become points, up to the line that is valid
    TOML. `column` is the position of the error in the line.
    """
    key = line.partition("=")[0].strip()
    if len(line) > LONGEST or "=" not in line:
        return ""
    found = [match for match in _BARE.finditer(line) if match.start() > line.index("=")]
    wrong = [match for match in found if not _is_toml_value(match[0])]
    fixed = line
    for match in reversed(wrong):
        fixed = fixed[: match.start()] + _correct_number(match[0]) + fixed[match.end() :]
    if not wrong or not key or not _is_toml(fixed):
        return ""
    near = min(wrong, key=lambda match: abs(match.end() - column))
    unit = re.search(r"[^\d.,e+-]", near[0].strip(), re.I)
    reason = "a number with a unit is a text in quotes" if unit else "numbers have a decimal point"
    return f"; found {near[0].strip()}, but {reason}: {fixed.strip()}"


def _correct_number(text: str) -> str:
    """Return a number with a decimal point, in quotes if it has a unit."""
    fixed = replace_decimal_commas(text)
    return fixed if _is_toml_value(fixed) else f'"{fixed}"'


def _is_toml_value(text: str) -> bool:
    """Return whether a text is a value of TOML."""
    return _is_toml(f"value = {text}")


def _is_toml(line: str) -> bool:
    """Return whether a line is valid TOML."""
    try:
        return bool(tomllib.loads(line))
    except (ValueError, RecursionError):
        return False
