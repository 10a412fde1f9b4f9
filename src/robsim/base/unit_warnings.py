"""Warnings of what is given: for whom they are, and what looks like another unit."""

from __future__ import annotations

import sys
import warnings

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.errors import UnitWarning

LARGEST_RADIANS = 4.0 * np.pi  # radians that people write by hand are within
LARGEST_DEGREES = 720.0  # degrees; larger numbers stand for "no limit"
LONGEST_PRINT = 10.0  # metres of what is printed
ROUND_DEGREES = 5.0  # degrees that people write by hand are multiples of it


def find_user_stacklevel() -> int:
    """Return the `stacklevel` of the user's code, for whom a warning of our caller is."""
    frame, level = sys._getframe(1), 1
    while frame.f_back and frame.f_globals.get("__name__", "").split(".")[0] == "robsim":
        frame, level = frame.f_back, level + 1
    return level


def warn_of_degrees(angles: ArrayLike, what: str) -> None:
    """Warn of an angle in radians that was meant in degrees, by all likelihood.

    That is a multiple of 5 between 15 and 720: more than two turns in radians, and round in
    degrees. 10 passes, as do 1.57, 6.28319 and any angle that was computed.

    >>> warn_of_degrees(np.radians([10.0, 180.0, 360.0]), "rpy")
    """
    size = np.abs(angles)
    large = size[(size > LARGEST_RADIANS) & (size <= LARGEST_DEGREES)]
    degrees = large[large % ROUND_DEGREES == 0.0]
    if degrees.size:
        given, meant = float(degrees[0]), float(np.radians(degrees[0]))
        looks = f"{what}: {given:g} looks like degrees, and angles are in radians"
        _warn_of_unit(f"{looks}; np.radians({given:g}) is {meant:.4g}")


def warn_of_millimetres(size: float, what: str) -> None:
    """Warn of a length in metres of something printed that was meant in millimetres.

    That is one above 10.

    >>> warn_of_millimetres(0.08, "size of a tag in metres")
    """
    if size > LONGEST_PRINT:
        looks = f"{what}: {size:g} looks like millimetres, and lengths are in metres"
        _warn_of_unit(f"{looks}; {size:g} mm is {size / 1000.0:g}")


def _warn_of_unit(text: str) -> None:
    warnings.warn(text, UnitWarning, stacklevel=find_user_stacklevel())
