"""The numbers of a camera that calibration files hold, and the class that is made of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from robsim.base.arrays import Array

Make = Callable[..., Any]  # Make(K, size, distortion=lens) returns a camera


class Intrinsics(Protocol):
    """A camera as calibration files describe it."""

    @property
    def K(self) -> Array:
        """The intrinsics (3, 3)."""

    @property
    def size(self) -> tuple[int, int] | None:
        """The width and height of the image in pixels."""

    @property
    def distortion(self) -> tuple[float, ...]:
        """The coefficients of the lens that were given."""

    @property
    def lens(self) -> Array:
        """The eight coefficients of the lens."""
