"""Warnings about numbers that look like other units."""

from __future__ import annotations

import sys
import warnings

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.errors import UnitWarning

LARGEST_RADIANS = 4.0 * np.pi  # bound of plausible angles in radians
LARGEST_DEGREES = 720.0  # bound of plausible angles in degrees; larger numbers mean "no limit"
LONGEST_DELAY = 10.0  # bound of plausible delays of images and joints in seconds
LONGEST_PRINT = 10.0  # bound of plausible sizes of prints in metres
ROUND_DEGREES = 5.0  # degrees; plausible angles in degrees are multiples of it


def find_user_stacklevel() -> int:
    """Return the `stacklevel` of the user's code, to be passed to `warnings.warn` by our caller."""
    frame, level = sys._getframe(1), 1
    while frame.f_back and frame.f_globals.get("__name__", "").split(".")[0] == "robsim":
        frame, level = frame.f_back, level + 1
    return level


def warn_of_degrees(angles: ArrayLike, what: str) -> None:
    """Warn about an angle in radians that is probably in degrees.

    Multiples of 5 between 15 and 720 cause the warning: they are more than two turns in radians,
    and round numbers in degrees. Angles such as 10, 1.57 or 6.28319 and computed angles do not.

    >>> warn_of_degrees(np.radians([10.0, 180.0, 360.0]), "rpy")
    """
    size = np.abs(angles)
    if not (size > LARGEST_RADIANS).any():
        return
    large = size[(size > LARGEST_RADIANS) & (size <= LARGEST_DEGREES)]
    degrees = large[large % ROUND_DEGREES == 0.0]
    if degrees.size:
        angle, radians = float(degrees[0]), float(np.radians(degrees[0]))
        looks = f"{what}: {angle:g} looks like degrees, and angles are in radians"
        _warn_of_unit(f"{looks}; np.radians({angle:g}) is {radians:.4g}")


def warn_of_millimetres(size: float, what: str) -> None:
    """Warn about a size of a print above 10 m, which is probably in millimetres.

    >>> warn_of_millimetres(0.08, "size of a tag in metres")
    """
    if size > LONGEST_PRINT:
        looks = f"{what}: {size:g} looks like millimetres, and lengths are in metres"
        _warn_of_unit(f"{looks}; {size:g} mm is {size / 1000.0:g}")


def warn_of_milliseconds(delay: float | None, what: str, longest: float = LONGEST_DELAY) -> None:
    """Warn about a delay above 10 s, or `longest`, which is probably in milliseconds.

    Delays above 10,000 s do not cause the warning: such numbers mean "never".

    >>> warn_of_milliseconds(0.1, "latency of the images")
    """
    if delay is not None and longest < delay <= 1000.0 * LONGEST_DELAY:
        looks = f"{what}: {delay:g} looks like milliseconds, and times are in seconds"
        _warn_of_unit(f"{looks}; {delay:g} ms is {delay / 1000.0:g}")


def _warn_of_unit(text: str) -> None:
    warnings.warn(text, UnitWarning, stacklevel=find_user_stacklevel())
