"""Description of a library robot as text: its joints, its tip and its sources."""

from __future__ import annotations

import textwrap
import tomllib
from collections.abc import Iterable
from typing import Any

import numpy as np

from robsim.base import si_units
from robsim.cli.weight_table import format_weight_table
from robsim.files import robots
from robsim.robot.link import Link
from robsim.robot.robot import Robot

WIDTH = 100  # largest width of a line of text, characters
# whether a joint rotates about, or translates along, the z axis of its placement
_AXIS: dict[tuple[tuple[bool, int], ...], str] = {((True, 2),): "about", ((False, 2),): "along"}
_DH = "{:>9}  {:>9}  {:>9}  {:>9}"


def format_robot(name: str) -> str:
    """Return the description of a library robot, in metres and degrees.

    >>> print(format_robot("planar_2r").splitlines()[5])
    upper  revolute          0          0          1          0  -180 to 180 deg  30 deg
    """
    robot, file = robots.load(name), tomllib.loads(robots.file(name).read_text(encoding="utf-8"))
    size = f"{robot.nq} coordinates, {robot.nv} velocities"
    if any("dh" in table for table in file["links"]):
        convention = file.get("convention", "standard")
        size += f"; {convention} DH: the coordinate adds to theta, or to d if prismatic"
    head = [_wrap_prose(f"{name}: {file['about']}"), size]
    sources = ["sources", *(_wrap_prose(source, "  - ") for source in file["sources"])]
    parts = [_format_joint_table(robot, file), _format_tip_pose(robot), format_weight_table(robot)]
    return "\n".join([*head, "", *(line for part in parts for line in (*part, "")), *sources])


def _format_joint_table(robot: Robot, file: dict[str, Any]) -> list[str]:
    """Return the lines of a table with a header and one row for each link except the base."""
    dh = {table["name"]: table["dh"] for table in file["links"] if "dh" in table}
    head = _DH.format("theta deg", "d m", "a m", "alpha deg")
    coupled = any(
        link.joint.follows and not _list_coordinate_indices(robot, link) for link in robot.links
    )
    last = "home, or coupling" if coupled else "home"
    rows = [["link", "joint", head if dh else "place in its parent", "limits", last]]
    for above, link in zip(robot.links, robot.links[1:], strict=False):
        name = link.name if link.parent == above.name else f"{link.name} on {link.parent}"
        placement = (
            _format_dh_row(dh[link.name]) if link.name in dh else _format_joint_placement(link)
        )
        rows.append(
            [
                name,
                link.joint.model.name,
                placement,
                _format_joint_limits(robot, link),
                _format_home_coordinates(robot, link),
            ]
        )
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]


def _format_dh_row(dh: dict[str, str]) -> str:
    """Return a row of Denavit-Hartenberg parameters."""
    angles = [f"{np.degrees(si_units.parse(dh[key], 'angle')):.6g}" for key in ("theta", "alpha")]
    lengths = [f"{si_units.parse(dh[key], 'length'):.6g}" for key in ("d", "a")]
    return _DH.format(angles[0], *lengths, angles[1])


def _format_joint_placement(link: Link) -> str:
    """Return the position of a joint in the axes of the parent, and its direction of motion."""
    joint = link.joint
    pose = joint.place if joint.model.moves in _AXIS else joint.place @ joint.tail
    position = f"at {_format_rounded_vector(pose.position)} m"
    if joint.curve is not None:
        kind = type(joint.curve).__name__.lower()
        return f"{position}, along a {kind} of {joint.curve.length:g} m"
    axis = (
        f"{_AXIS.get(joint.model.moves, 'z along')} {_format_rounded_vector(pose.rotation[:, 2])}"
    )
    return f"{position}, {axis}" if joint.model.moves in _AXIS or not joint.moves else position


def _format_joint_limits(robot: Robot, link: Link) -> str:
    """Return the limits of a joint, or of its steering angle."""
    indices, steering = _list_coordinate_indices(robot, link), link.joint.steering
    if steering is not None:
        return f"steering {np.degrees(steering.limit):.4g} deg either way"
    if link.joint.limits is None or not indices:
        return "none" if indices else ""
    (low, unit), (high, _) = (
        _format_coordinate_value(x, robot.coordinate_units[indices[0]]) for x in link.joint.limits
    )
    return f"{low} to {high} {unit}"


def _format_home_coordinates(robot: Robot, link: Link) -> str:
    """Return the home coordinates of a joint, or the relation it follows."""
    indices, follows = _list_coordinate_indices(robot, link), link.joint.follows
    if follows is not None and not indices:
        return follows.relation
    values = [
        " ".join(_format_coordinate_value(robot.home[i], robot.coordinate_units[i]))
        for i in indices
    ]
    names = [robot.coordinate_names[i].removeprefix(f"{link.name}.") for i in indices]
    if len(indices) == 1:
        return values[0].strip()
    return ", ".join(f"{n} {v}".strip() for n, v in zip(names, values, strict=True))


def _list_coordinate_indices(robot: Robot, link: Link) -> list[int]:
    """Return the indices of the coordinates of the joint of a link."""
    names = robot.coordinate_names
    return [i for i, name in enumerate(names) if name.split(".")[0] == link.name]


def _format_coordinate_value(value: float, unit: str) -> tuple[str, str]:
    """Return a coordinate in degrees or metres, and its unit."""
    if unit == "rad":
        return f"{np.degrees(value) + 0.0:.6g}", "deg"
    return f"{value + 0.0:.6g}", "m" if unit == "m" else ""


def _format_tip_pose(robot: Robot) -> list[str]:
    """Return lines with the pose of the tip at home in the base frame."""
    T = robot.fk(robot.home)
    axes = ", ".join(
        f"{name} along {_format_rounded_vector(T[:3, i])}" for i, name in enumerate("xyz")
    )
    return [
        f"{robot.tip} at home: {_format_rounded_vector(T[:3, 3])} m in the base",
        f"its axes: {axes}",
    ]


def _format_rounded_vector(values: Iterable[float]) -> str:
    """Return a vector as text, rounded to four decimals."""
    return f"({', '.join(f'{round(float(x), 4) + 0.0:g}' for x in values)})"


def _wrap_prose(text: str, first: str = "") -> str:
    """Return a text wrapped to `WIDTH`; its first line begins with `first`."""
    return textwrap.fill(text, WIDTH, initial_indent=first, subsequent_indent=" " * len(first))
