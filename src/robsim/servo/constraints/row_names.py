"""Names of the rows of constraints, and the marks that they name."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

_REPEATED = re.compile(r"^(?P<first>.*) \((?P<number>\d+)\)$")
_MARK = re.compile(
    r"^(?:(?P<side>left|right|top|bottom) border for |least depth of |.* in the sight of )"
    r"mark (?P<mark>\d+)(?: of (?P<target>.+) in (?P<camera>.+))?$"
)


def number_repeated_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return names of which each exists once: a repeated name gets its number."""
    counts: dict[str, int] = {}
    result: dict[str, None] = {}
    for name in names:
        own = name
        while own in result:
            counts[name] = counts.get(name, 1) + 1
            own = f"{name} ({counts[name]})"
        result[own] = None
    return tuple(result)


def name_first_row(name: str, names: Collection[str]) -> str:
    """Return the name of the first of several rows with the same name.

    Parameters
    ----------
    name : str
        Name of a row, which may have got a number by `number_repeated_names`.
    names : collection of str
        Names of all rows.

    Returns
    -------
    str
        The name without the number.

    Examples
    --------
    >>> rows = number_repeated_names(["top border for mark 0", "top border for mark 0"])
    >>> [name_first_row(each, rows) for each in rows]
    ['top border for mark 0', 'top border for mark 0']
    """
    match = _REPEATED.match(name)
    return match["first"] if match and match["first"] in names else name


def parse_row_name(name: str) -> dict[str, int | str]:
    """Return side, mark, target and camera of the name of a row, as far as it has them.

    Parameters
    ----------
    name : str
        Name of a row.

    Returns
    -------
    dict
        Values by "side", "mark", "target" and "camera"; empty for a row that concerns no mark.

    Examples
    --------
    >>> parse_row_name("left border for mark 2")
    {'side': 'left', 'mark': 2}
    >>> parse_row_name("least depth of mark 0 of cup in eye")
    {'mark': 0, 'target': 'cup', 'camera': 'eye'}
    """
    match = _MARK.match(name)
    found = match.groupdict() if match else {}
    return {
        key: int(value) if key == "mark" else value
        for key, value in found.items()
        if value is not None
    }
