"""The components of ROS twists, and the velocities of a body that drives or moves freely."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from robsim.base.errors import InputError
from robsim.logs.message_types import Message

TWIST_PARTS = {  # name of a velocity after the last dot -> component of a Twist
    "vx": ("linear", "x"),
    "vy": ("linear", "y"),
    "vz": ("linear", "z"),
    "wx": ("angular", "x"),
    "wy": ("angular", "y"),
    "wz": ("angular", "z"),
    "v": ("linear", "x"),
    "omega": ("angular", "z"),
}
WORLD_FRAMES = ("world", "map", "odom")  # frames in a header that are not the axes of the body


class TwistComponent(NamedTuple):
    """A component of a Twist message, and the index of its velocity in the scene."""

    of: str  # "linear" or "angular"
    axis: str  # "x", "y" or "z"
    column: int


def twist_components(names: Sequence[str]) -> tuple[TwistComponent, ...]:
    """Return the Twist components of the body that drives or moves freely, from velocity names.

    InputError is raised if no body, or more than one body, drives or moves freely.

    >>> [tuple(each) for each in twist_components(["elbow", "body.v", "body.omega"])]
    [('linear', 'x', 1), ('angular', 'z', 2)]
    """
    parts_of = [(i, *name.rpartition(".")[::2]) for i, name in enumerate(names)]
    twists = [each for each in parts_of if each[2] in TWIST_PARTS and each[1]]
    bodies = dict.fromkeys(body for _, body, _ in twists)
    if len(bodies) != 1:
        raise InputError(
            "a Twist commands one body that drives or moves freely; "
            f"the scene has {', '.join(bodies) or 'none'}"
        )
    return tuple(TwistComponent(*TWIST_PARTS[part], i) for i, _, part in twists)


def read_twist(twist: Message, parts: Sequence[TwistComponent]) -> dict[int, float]:
    """Return the velocities in a Twist message by their index in the scene."""
    return {each.column: float(getattr(getattr(twist, each.of), each.axis)) for each in parts}


def list_unused_components(twist: Message, parts: Sequence[TwistComponent]) -> list[str]:
    """Return the nonzero components of a Twist message that are not velocities of the body."""
    used = {(each.of, each.axis) for each in parts}
    return [
        f"{of}.{axis}"
        for of in ("linear", "angular")
        for axis in "xyz"
        if (of, axis) not in used and getattr(getattr(twist, of), axis) != 0.0
    ]
