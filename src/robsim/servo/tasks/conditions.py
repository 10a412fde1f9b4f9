"""Conditions on which a task switches from one scheme to another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, shown_view
from robsim.declare import Choice, Declared, Number, Word, family, register
from robsim.vision.camera import SIZE


@runtime_checkable
class Condition(Protocol):
    """The interface of a condition: any object with this method."""

    def holds(self, first: Comparison, second: Comparison) -> NDArray[np.bool_]:
        """Return truth values (B,): in which runs the condition holds."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """What a condition sees of one of two schemes: its features, error and command, run first."""

    s_last: Array
    error_last: Array
    qd_last: Array
    pixels_last: Array  # (N, 2, B) of all its marks, as measured

    @property
    def s(self) -> Array:
        """The features s (B, k)."""
        return shown_view(self.s_last)

    @property
    def error(self) -> Array:
        """The error s - s_goal (B, k)."""
        return shown_view(self.error_last)

    @property
    def qd(self) -> Array:
        """The commanded velocities qd (B, n)."""
        return shown_view(self.qd_last)

    @property
    def pixels(self) -> Array:
        """The measured pixels (B, N, 2) of all its marks."""
        return shown_view(self.pixels_last)


CONDITIONS = family("condition")
CONDITION = Choice(CONDITIONS, short=False, protocol=Condition)


@register("condition", "error_below")
@dataclass(frozen=True)
class ErrorBelow(Declared):
    """The condition that the largest |e| of the first scheme (or the second) is below a value.

    >>> ErrorBelow(0.05).of
    'first'
    """

    value: Annotated[
        float, Number(above=0), "Bound of the largest |e|, in the unit of the features."
    ]
    of: Annotated[str, Word(("first", "second"), "scheme"), "Scheme whose error is compared."] = (
        "first"
    )

    def holds(self, first: Comparison, second: Comparison) -> NDArray[np.bool_]:
        """Return truth values (B,): in which runs the error is below the value."""
        chosen = first if self.of == "first" else second
        below: NDArray[np.bool_] = np.abs(chosen.error_last).max(axis=0) < self.value
        return below


@register("condition", "near_border")
@dataclass(frozen=True)
class NearBorder(Declared):
    """The condition that a mark is within `margin` pixels of the border of the image.

    >>> NearBorder(20, (640, 480)).margin
    20.0
    """

    margin: Annotated[
        float,
        Number(above=0, unit="px"),
        "Distance of a mark from the border below which the condition holds.",
    ]
    size: Annotated[tuple[int, int], SIZE, "Width and height of the image in pixels."]

    def holds(self, first: Comparison, second: Comparison) -> NDArray[np.bool_]:
        """Return truth values (B,): in which runs a mark is near the border."""
        room = np.array(self.size)[:, None] - 1 - first.pixels_last
        least = np.minimum(first.pixels_last, room).min(axis=(0, 1), initial=np.inf)
        near: NDArray[np.bool_] = least < self.margin
        return near
