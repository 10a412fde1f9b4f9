"""Overviews of a robot, as text and as a table for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from robsim.base import html

if TYPE_CHECKING:
    from robsim.robot.robot import Robot

MOST_NAMES = 8  # largest number of names in a text


def join_names(names: tuple[str, ...]) -> str:
    """Return names separated by commas; of more than eight, the first eight and the number.

    >>> join_names(("x", "y")), join_names(())
    ('x, y', 'none')
    """
    shown = ", ".join(names[:MOST_NAMES]) or "none"
    return shown if len(names) <= MOST_NAMES else f"{shown}, ... ({len(names)} in all)"


def describe_robot(robot: Robot) -> str:
    """Return one line with the name, the number of links, and the coordinates."""
    links = f"{len(robot.links)} links" if len(robot.links) > 1 else "one link"
    names = join_names(robot.coordinate_names)
    return f"<Robot '{robot.name}': {links} to '{robot.tip}', coordinates: {names}>"


def render_robot_table(robot: Robot) -> str:
    """Return an HTML table of the coordinates, with their limits and home."""
    names, units = robot.coordinate_names, robot.coordinate_units
    numbers = np.column_stack([robot.limits, robot.home])
    rows = [
        (name, *(format_coordinate(float(value), unit) for value in row))
        for name, unit, row in zip(names, units, numbers, strict=True)
    ]
    description = f"{len(robot.links)} links to '{robot.tip}', on {robot.on}"
    head = ("coordinate", "lowest", "highest", "home")
    return html.format_html_table(f"Robot {robot.name}: {description}", rows, head if rows else ())


def format_coordinate(value: float, unit: str) -> str:
    """Return a coordinate as text, in degrees or metres; an infinite value is empty.

    >>> format_coordinate(np.pi / 2, "rad"), format_coordinate(0.25, "m")
    ('90°', '0.25 m')
    >>> format_coordinate(np.inf, "rad")
    ''
    """
    if not np.isfinite(value):
        return ""
    if unit == "rad":
        return f"{np.degrees(value):.4g}°"
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"
