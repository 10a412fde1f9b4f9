"""Twists of a body that drives or moves freely, in its own axes, by the names of its velocities."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from robsim.base.errors import InputError

TWIST_PARTS = {  # of the name of a velocity, behind the last dot: where a Twist has it
    "vx": ("linear", "x"),
    "vy": ("linear", "y"),
    "vz": ("linear", "z"),
    "wx": ("angular", "x"),
    "wy": ("angular", "y"),
    "wz": ("angular", "z"),
    "v": ("linear", "x"),
    "omega": ("angular", "z"),
}
WORLD_FRAMES = (
    "world",
    "map",
    "odom",
)  # frames of a header in which a twist is not that of the body


class TwistComponent(NamedTuple):
    """A component of a Twist, and which of some velocities it is."""

    of: str
    axis: str
    column: int


def twist_components(names: Sequence[str]) -> tuple[TwistComponent, ...]:
    """Return what a Twist is of velocities. InputError: they are not those of one body.

    >>> twist_components(["elbow", "body.v", "body.omega"])
    (Component(of='linear', axis='x', column=1), Component(of='angular', axis='z', column=2))
    """
    found = [(i, *name.rpartition(".")[::2]) for i, name in enumerate(names)]
    free = [each for each in found if each[2] in TWIST_PARTS and each[1]]
    bodies = dict.fromkeys(body for _, body, _ in free)
    if len(bodies) != 1:
        raise InputError(
            "a Twist commands one body that drives or moves freely; "
            f"here are {', '.join(bodies) or 'none'}"
        )
    return tuple(TwistComponent(*TWIST_PARTS[part], i) for i, _, part in free)


def read_twist(twist: Any, parts: Sequence[TwistComponent]) -> dict[int, float]:
    """Return the velocities that a Twist message holds."""
    return {each.column: float(getattr(getattr(twist, each.of), each.axis)) for each in parts}


def list_unused_components(twist: Any, parts: Sequence[TwistComponent]) -> list[str]:
    """Return the components of a Twist message that are not zero, and are none of the body's."""
    own = {(each.of, each.axis) for each in parts}
    return [
        f"{of}.{axis}"
        for of in ("linear", "angular")
        for axis in "xyz"
        if (of, axis) not in own and getattr(getattr(twist, of), axis) != 0.0
    ]
