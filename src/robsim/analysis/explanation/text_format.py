"""Formatting of numbers, units and lists for sentences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robsim.base.arrays import Array
from robsim.world.scene import Scene

ROUNDING = 1e-9  # metres and radians


def format_number(value: float) -> str:
    """Format a number with three significant digits.

    >>> format_number(0.123456)
    '0.123'
    """
    return f"{value:.3g}"


def format_quantity(value: float, unit: str) -> str:
    """Format a number with its unit; the unit "1" and several units are omitted.

    >>> format_quantity(0.5, "px"), format_quantity(0.5, "1")
    ('0.5 px', '0.5')
    """
    return format_number(value) if unit == "1" or "," in unit else f"{format_number(value)} {unit}"


def format_time(seconds: float) -> str:
    """Format a time as the start of a sentence.

    >>> format_time(0.0), format_time(1.24)
    ('At the start', 'After 1.24 s')
    """
    return "At the start" if seconds == 0 else f"After {seconds:.4g} s"


def format_angle(radians: float) -> str:
    """Format an angle in degrees.

    >>> format_angle(0.5)
    '28.6 degrees'
    """
    return f"{np.degrees(radians):.3g} degrees"


def format_length(metres: float) -> str:
    """Format a length in metres or millimetres.

    >>> format_length(0.0123), format_length(2.5)
    ('12.3 mm', '2.5 m')
    """
    return f"{metres:.3g} m" if abs(metres) >= 1 else f"{1000 * metres:.3g} mm"


def format_pixel(place: Sequence[float] | Array) -> str:
    """Format a position in an image, in whole pixels.

    >>> format_pixel((1039.7, -4.2))
    '(1040, -4)'
    """
    return f"({place[0]:.0f}, {place[1]:.0f})"


def format_offset(metres: float, radians: float) -> str:
    """Format the distance and angle between two poses, without values below rounding.

    >>> format_offset(0.01, 1e-16), format_offset(0.01, 0.5)
    ('10 mm', '10 mm and 28.6 degrees')
    """
    parts = [format_length(metres)] if metres > ROUNDING else []
    parts += [format_angle(radians)] if radians > ROUNDING else []
    return format_list(parts) or format_length(metres)


def format_list(names: Sequence[str], last: str = "and") -> str:
    """Join names as in a sentence.

    >>> format_list(["noise", "latency", "lag"])
    'noise, latency and lag'
    """
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} {last} {names[-1]}"


def format_moving_robots(scene: Scene) -> str:
    """Return the robots with prescribed motions, as the start of a sentence."""
    names = [f"'{motion.robot}'" for motion in scene.motions]
    return f"{format_list(names)} {'moves on its' if len(names) == 1 else 'move on their'} own"


def format_count(count: int, thing: str) -> str:
    """Format a count and its noun, in the plural if needed.

    >>> format_count(1, "control period"), format_count(3, "mark")
    ('1 control period', '3 marks')
    """
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"
