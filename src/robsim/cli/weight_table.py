"""Masses, inertias and drives of a robot as a table of text."""

from __future__ import annotations

import numpy as np

from robsim.robot.joint import RESISTANCES
from robsim.robot.link import Link
from robsim.robot.robot import Robot

HEAD = ["link", "mass kg", "centre m", "moment kg m^2", "effort", *RESISTANCES]


def format_weight_table(robot: Robot) -> list[str]:
    """Return the lines of a table of masses and drives, or one line if nothing has a mass.

    The moment is the largest principal moment. Efforts and friction are in N m or N, the armature
    in kg m^2 or kg, and the damping in N m s/rad or N s/m.

    >>> from robsim import robots
    >>> format_weight_table(robots.scara())
    ['no masses are known, so there are no dynamics']
    >>> format_weight_table(robots.planar_2r())[-1]
    'fore   3.6      (-0.5, 0, 0)   0.3011'
    """
    if all(link.inertial is None for link in robot.links):
        return ["no masses are known, so there are no dynamics"]
    rows = [HEAD, *(_list_link_numbers(link) for link in robot.links)]
    used = [i for i, column in enumerate(zip(*rows[1:], strict=True)) if any(column)]
    columns = [[row[i] for row in rows if any(row[1:])] for i in used]
    widths = [max(map(len, column)) for column in columns]
    total = sum(link.inertial.mass for link in robot.links if link.inertial)
    lines = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in zip(*columns, strict=True)]
    return [f"mass of all links: {total:.4g} kg", *lines]


def _list_link_numbers(link: Link) -> list[str]:
    """Return the row of a link; a number that is missing or 0 is an empty text."""
    row, inertia, joint = [link.name], link.inertial, link.joint
    if inertia is None:
        row += ["", "", ""]
    else:
        centre = ", ".join(f"{x + 0.0:.3g}" for x in inertia.centre.round(6))
        largest = np.linalg.eigvalsh(inertia.tensor)[-1]
        row += [f"{inertia.mass:.4g}", f"({centre})", f"{largest:.4g}"]
    numbers = (getattr(joint, part) for part in ("effort", *RESISTANCES))
    return [*row, *(f"{number:.4g}" if number else "" for number in numbers)]
