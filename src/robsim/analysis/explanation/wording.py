"""Formatting of numbers, units and lists for sentences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from robsim.base.arrays import Array
from robsim.world.scene import Scene

ROUNDING = 1e-9  # metres and radians


def number(value: float) -> str:
    """Return a number to three significant digits.

    >>> number(0.123456)
    '0.123'
    """
    return f"{value:.3g}"


def in_unit(value: float, unit: str) -> str:
    """Return a number with its unit, unless that is "1".

    >>> in_unit(0.5, "px"), in_unit(0.5, "1")
    ('0.5 px', '0.5')
    """
    return number(value) if unit == "1" else f"{number(value)} {unit}"


def when(seconds: float) -> str:
    """Return a time as the start of a sentence.

    >>> when(0.0), when(1.24)
    ('At the start', 'After 1.24 s')
    """
    return "At the start" if seconds == 0 else f"After {seconds:.4g} s"


def degrees(radians: float) -> str:
    """Return an angle in degrees.

    >>> degrees(0.5)
    '28.6 degrees'
    """
    return f"{np.degrees(radians):.3g} degrees"


def length(metres: float) -> str:
    """Return a length in metres or millimetres.

    >>> length(0.0123), length(2.5)
    ('12.3 mm', '2.5 m')
    """
    return f"{metres:.3g} m" if abs(metres) >= 1 else f"{1000 * metres:.3g} mm"


def pixel(place: Sequence[float] | Array) -> str:
    """Return a position in an image, to whole pixels.

    >>> pixel((1039.7, -4.2))
    '(1040, -4)'
    """
    return f"({place[0]:.0f}, {place[1]:.0f})"


def away(metres: float, radians: float) -> str:
    """Return the distance and angle between two poses, without what is only rounding.

    >>> away(0.01, 1e-16), away(0.01, 0.5)
    ('10 mm', '10 mm and 28.6 degrees')
    """
    parts = [length(metres)] if metres > ROUNDING else []
    parts += [degrees(radians)] if radians > ROUNDING else []
    return listed(parts) or length(metres)


def listed(names: Sequence[str], last: str = "and") -> str:
    """Return names joined as in a sentence.

    >>> listed(["noise", "latency", "lag"])
    'noise, latency and lag'
    """
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} {last} {names[-1]}"


def movers(scene: Scene) -> str:
    """Return which robots move on their own, as the start of a sentence."""
    names = [f"'{motion.robot}'" for motion in scene.motions]
    return f"{listed(names)} {'moves on its' if len(names) == 1 else 'move on their'} own"


def counted(count: int, thing: str) -> str:
    """Return a count and its noun, in the plural where needed.

    >>> counted(1, "control period"), counted(3, "mark")
    ('1 control period', '3 marks')
    """
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"
