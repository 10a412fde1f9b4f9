"""Enumerated values of a study: every draw is simulated with each of them."""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass
from typing import Annotated, Any

import numpy as np

from robsim.base.errors import InputError, format_value
from robsim.base.value import make_hashable
from robsim.declare import Flag, Integer, register
from robsim.studies.samplers import RangeSampler
from robsim.studies.value_lists import MOST_VALUES, check_values

LabelledValues = tuple[dict[str, Any], bool]  # values by label, and whether the labels were given


@register("sampler", "grid")
@dataclass(frozen=True, eq=False)
class Grid(RangeSampler):
    """Evenly spaced numbers from low to high, each combined with every draw.

    Raises
    ------
    InputError
        If `low` or `high` is no single number, `low` is above `high`, or `low` is not positive with
        `log`.

    Examples
    --------
    >>> Grid(0.0, 1.0, 5).values
    (0.0, 0.25, 0.5, 0.75, 1.0)
    >>> Grid(1.0, 100.0, 3, log=True).values
    (1.0, 10.0, 100.0)
    """

    count: Annotated[int, Integer(1, MOST_VALUES), "Number of values."] = 10
    log: Annotated[bool, Flag(), "Whether the logarithms of the values are evenly spaced."] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.shape:
            raise InputError("Grid: expected one number for low and one for high")
        low, _ = self._bounds
        if self.log and low <= 0:
            raise InputError(f"Grid: with log, expected low above 0, got {float(low):g}")

    @property
    def values(self) -> tuple[float, ...]:
        """The numbers."""
        space, (low, high) = np.geomspace if self.log else np.linspace, self._bounds
        return tuple(space(low, high, self.count).tolist())


def parse_value_list(axis: Any, subject: str) -> LabelledValues | None:
    """Return the enumerated values by their labels; None for a sampler."""
    if isinstance(axis, Grid):
        return generate_labels(axis.values), False
    if isinstance(axis, dict):
        check_values(list(axis.values()), subject, twice=True)
        return _check_labels(axis, subject), True
    if isinstance(axis, list | tuple | np.ndarray):
        return assign_labels(check_values(axis, subject), subject)
    return None


def assign_labels(values: tuple[Any, ...], subject: str) -> LabelledValues:
    """Return values by label; tables {label, value} have labels of their own."""
    if all(isinstance(each, dict) and each.keys() == {"label", "value"} for each in values):
        labels = [each["label"] for each in values]
        if len({str(label) for label in labels}) < len(labels):
            raise InputError(f"{subject}: a label occurs twice")
        pairs = {each["label"]: each["value"] for each in values}
        return _check_labels(pairs, subject), True
    return generate_labels(values), False


def _check_labels(values: dict[Any, Any], subject: str) -> dict[str, Any]:
    """Return values by label; raise InputError if a label is no text."""
    for label in values:
        if not isinstance(label, str) or not label.strip() or len(label) > 200:
            raise InputError(f"{subject}: expected a text as label, got {format_value(label)}")
    return dict(values)


def generate_labels(values: tuple[Any, ...]) -> dict[str, Any]:
    """Return values by generated labels, the shortest that distinguish them.

    >>> list(generate_labels(({"kind": "ibvs"}, {"kind": "ibvs", "gain": 2.0}, {"kind": "pbvs"})))
    ['ibvs', 'ibvs gain=2', 'pbvs']
    """
    kinds = [_name_value(each) for each in values]
    if all(isinstance(each, float) for each in values) and len(set(kinds)) < len(values):
        kinds = [repr(each) for each in values]
    repeated = {kind for kind in kinds if kinds.count(kind) > 1}
    fields_of = {
        kind: _find_differing_fields([x for x, k in zip(values, kinds, strict=True) if k == kind])
        for kind in repeated
    }
    labels = [
        " ".join([kind, *_format_fields(value, fields_of[kind])]) if kind in repeated else kind
        for kind, value in zip(kinds, values, strict=True)
    ]
    if len(set(labels)) < len(values):
        labels = [f"{label} {i + 1}" for i, label in enumerate(labels)]
    return dict(zip(labels, values, strict=True))


def _name_value(value: Any) -> str:
    """Return the name of a value's kind; numbers and texts are their own names."""
    if isinstance(value, float):
        return f"{value:.12g}"
    if value is None or isinstance(value, str | int):
        return str(value)
    if isinstance(value, dict):
        return str(value.get("kind", "table"))
    return str(value) if isinstance(value, list) else type(value).__name__


def _find_differing_fields(values: list[Any]) -> list[str]:
    """Return the fields or keys that differ between values of one kind."""
    tables = [_get_fields(value) for value in values]
    names = list(dict.fromkeys(name for table in tables for name in table))
    return [n for n in names if len({repr(make_hashable(table.get(n))) for table in tables}) > 1]


def _format_fields(value: Any, names: list[str]) -> list[str]:
    """Return the named fields of a value as "name=value"."""
    table = _get_fields(value)
    return [f"{name}={_name_value(table[name])}" for name in names if name in table]


def _get_fields(value: Any) -> dict[str, Any]:
    """Return the fields or keys of a value."""
    if isinstance(value, dict):
        return value
    names = [each.name for each in fields(value)] if is_dataclass(value) else []
    return {name: getattr(value, name) for name in names}
