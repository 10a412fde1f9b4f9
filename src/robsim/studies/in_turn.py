"""Values that every draw of a study is run with, one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from robsim.base.errors import InputError
from robsim.declare import Flag, Whole, register
from robsim.studies.samplers import Between
from robsim.studies.values import MOST, check_values


@register("sampler", "grid")
@dataclass(frozen=True, eq=False)
class Grid(Between):
    """So many numbers from low to high, each of which every draw is run with.

    >>> Grid(0.0, 1.0, 5).values
    (0.0, 0.25, 0.5, 0.75, 1.0)
    """

    count: Annotated[int, Whole(1, MOST), "How many numbers."] = 10
    log: Annotated[bool, Flag(), "Whether their logarithms are evenly spaced."] = False

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.shape:
            raise InputError("Grid: low and high are one number each")
        if self.log and self.low <= 0:
            raise InputError(f"Grid: with log, low is above 0, got {float(self.low):g}")

    @property
    def values(self) -> tuple[float, ...]:
        """The numbers."""
        space = np.geomspace if self.log else np.linspace
        return tuple(space(self.low, self.high, self.count).tolist())


def values_in_turn(axis: Any, what: str) -> dict[str, Any] | None:
    """Return the values that every draw is run with, by their labels; None for what is drawn."""
    if isinstance(axis, Grid):
        return {f"{each:.12g}": each for each in axis.values}
    if isinstance(axis, dict):
        check_values(list(axis.values()), what)
        return dict(axis)
    if isinstance(axis, list | tuple | np.ndarray):
        return labelled(check_values(axis, what))
    return None


def labelled(values: tuple[Any, ...]) -> dict[str, Any]:
    """Return values by labels: as short as tells them apart."""
    for label in (_plain, _kind, repr):
        labels = [label(each) for each in values]
        if len(set(labels)) == len(values):
            return dict(zip(labels, values, strict=True))
    return {f"{_kind(each)} {i + 1}": each for i, each in enumerate(values)}


def _plain(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.12g}"
    return str(value) if isinstance(value, str | int | bool) or value is None else _kind(value)


def _kind(value: Any) -> str:
    if isinstance(value, dict):
        return str(value.get("kind", value))
    return type(value).__name__
