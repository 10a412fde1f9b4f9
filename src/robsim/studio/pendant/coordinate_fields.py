"""Coordinates of a robot as a person reads them: degrees and centimetres, with their limits."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.base.si_units import cm, deg
from robsim.robot.robot import Robot

UNITS = {"rad": ("deg", deg), "m": ("cm", cm)}  # displayed unit and its value, by unit
FILE_ROUNDING = {"deg": (deg, 3), "cm": (1.0, 5)}  # unit in files, and decimals there
LARGEST = 36_000.0  # deg or cm, of a coordinate without limits
NEAR_LIMIT = 1e-6  # rad or m: a coordinate this close to a limit is at it
WITHOUT_LIMITS = {"deg": 360.0, "cm": 200.0}  # largest displayed value of a slider without limits


@dataclass(frozen=True)
class CoordinateField:
    """A coordinate of a robot and its limits, in the displayed unit.

    Attributes
    ----------
    name : str
        Name of the coordinate.
    unit : str
        "deg", "cm", or "" for a component of a quaternion, which cannot be set alone.
    size : float
        The unit in rad or m.
    low, high : float or None
        Limits in the unit; None without a limit.
    turning : bool
        Whether a whole turn gives the same pose.
    """

    name: str
    unit: str
    size: float
    low: float | None
    high: float | None
    turning: bool

    @property
    def ends(self) -> tuple[float, float]:
        """Ends of the slider, in the unit."""
        free = WITHOUT_LIMITS.get(self.unit, 1.0)
        low = -free if self.low is None else self.low
        return low, (max(free, low) if self.high is None else self.high)

    def convert_number(self, value: object) -> float:
        """Return a typed number in rad or m; raise InputError outside of the limits."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise InputError(f"{self.name}: expected a number")
        if not self.unit:
            raise InputError(f"{self.name}: drag the tool or type its pose to turn the body")
        low = -math.inf if self.low is None else self.low
        high = math.inf if self.high is None else self.high
        if abs(value) > LARGEST:
            raise InputError(f"{self.name}: {value:g} {self.unit} is too large")
        slack = NEAR_LIMIT / self.size  # a slider ends at a rounded number
        if not low - slack <= value <= high + slack:
            raise InputError(f"{self.name}: {value:.6g} {self.unit} is outside of {self.range}")
        return float(min(max(value, low), high)) * self.size

    @property
    def range(self) -> str:
        """The limits as text, such as "its limits, -166 to 166 deg"."""
        low = "no limit" if self.low is None else f"{self.low:.5g}"
        high = "no limit" if self.high is None else f"{self.high:.5g}"
        return f"its limits, {low} to {high} {self.unit}"


def list_coordinate_fields(robot: Robot) -> list[CoordinateField]:
    """Return the coordinates of a robot in their order."""
    turning = [
        link.joint.model.turns
        for link in robot.links
        for _ in range(len(link.joint.parts.coordinates))
    ]
    fields = []
    for i, (name, unit) in enumerate(
        zip(robot.coordinate_names, robot.coordinate_units, strict=True)
    ):
        shown, size = UNITS.get(unit, ("", 1.0))
        low, high = (float(end) / size if np.isfinite(end) else None for end in robot.limits[i])
        fields.append(CoordinateField(name, shown, size, low, high, turning[i]))
    return fields


def find_limit_side(field: CoordinateField, value: float) -> str:
    """Return "low" or "high" if a coordinate in rad or m is at this limit, else ""."""
    for side, end in (("low", field.low), ("high", field.high)):
        if end is not None and abs(value - end * field.size) <= NEAR_LIMIT:
            return side
    return ""


def round_coordinates(fields: list[CoordinateField], q: Array) -> Array:
    """Return coordinates (nq,) rounded to 0.001 deg and 0.01 mm, within their limits."""
    rounded = np.array(q, dtype=float)
    for i, field in enumerate(fields):
        if field.unit:
            rounded[i] = _round_coordinate(field, float(q[i]))
    return rounded


def _round_coordinate(field: CoordinateField, value: float) -> float:
    """Return a rounded coordinate in rad or m, which is a short number in deg or m."""
    size, decimals = FILE_ROUNDING[field.unit]
    ends = [
        -math.inf if field.low is None else field.low * field.size / size,
        math.inf if field.high is None else field.high * field.size / size,
    ]
    shown, step = round(value / size, decimals) + 0.0, 10**decimals  # never -0
    if shown < ends[0]:
        shown = math.ceil(ends[0] * step) / step
    elif shown > ends[1]:
        shown = math.floor(ends[1] * step) / step
    return shown * size
