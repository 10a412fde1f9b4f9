"""Overviews of a robot: as text, and as a table for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robsim.base import html

if TYPE_CHECKING:
    from robsim.robot.robot import Robot

MOST = 8  # names in a text


def named(names: tuple[str, ...]) -> str:
    """Return names separated by commas; of more than eight the first ones, and their number.

    >>> named(("x", "y")), named(())
    ('x, y', 'none')
    """
    shown = ", ".join(names[:MOST]) or "none"
    return shown if len(names) <= MOST else f"{shown}, ... ({len(names)} in all)"


def text(robot: Robot) -> str:
    """Return one line: the name, the number of links, and the coordinates."""
    links = f"{len(robot.links)} links" if len(robot.links) > 1 else "one link"
    names = named(robot.coordinate_names)
    return f"<Robot '{robot.name}': {links} to '{robot.tip}', coordinates: {names}>"


def table(robot: Robot) -> str:
    """Return a table of the coordinates, with their limits and home, as HTML."""
    names, units = robot.coordinate_names, robot.coordinate_units
    numbers = np.column_stack([robot.limits, robot.home])
    rows = [
        (name, *(quantity(float(value), unit) for value in row))
        for name, unit, row in zip(names, units, numbers, strict=True)
    ]
    where = f"{len(robot.links)} links to '{robot.tip}', on {robot.on}"
    head = ("coordinate", "lowest", "highest", "home")
    return html.table(f"Robot {robot.name}: {where}", rows, head if rows else ())


def quantity(value: float, unit: str) -> str:
    """Return a coordinate as text, in degrees or metres; empty where it is infinite.

    >>> quantity(np.pi / 2, "rad"), quantity(0.25, "m"), quantity(np.inf, "rad")
    ('90°', '0.25 m', '')
    """
    if not np.isfinite(value):
        return ""
    if unit == "rad":
        return f"{np.degrees(value):.4g}°"
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"
