"""The numbers of a camera that calibration files hold, and the class that is made of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

Make = Callable[..., Any]  # Make(K, size, distortion=lens) returns a camera
Size = tuple[int, int] | None  # the width and height of the image in pixels
Lens = tuple[float, ...]  # the coefficients of the distortion that were given
