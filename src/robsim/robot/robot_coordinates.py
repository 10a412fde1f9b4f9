"""The coordinates of a robot: their names, units and limits, and how they are checked."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from robsim.base.arrays import Array, as_bool, as_floats
from robsim.base.unit_warnings import warn_of_degrees
from robsim.base.value import Value
from robsim.geometry.pose import as_pose, is_pose_like
from robsim.robot.frame import Frame
from robsim.robot.joint import FIXED, JointKind, Rolling, list_coordinate_units
from robsim.robot.limits import check_within_limits, combine_limits
from robsim.robot.link import Link, list_coordinate_names, list_velocity_names
from robsim.robot.tree import Tree


class RobotCoordinates(Value):
    """The coordinates and velocities of a `Robot`."""

    name: str
    links: tuple[Link, ...]

    @cached_property
    def tree(self) -> Tree:
        """The kinematic tree of the robot alone, with its base link at the world frame."""
        base, *others = self.links
        frames = [Frame(base.name, "world", FIXED)]  # the scene places the base
        return Tree([*frames, *(Frame(k.name, k.parent or "world", k.joint) for k in others)])

    @cached_property
    def nq(self) -> int:
        """The number of coordinates."""
        return len(self.coordinate_names)

    @cached_property
    def nv(self) -> int:
        """The number of velocities."""
        return len(self.velocity_names)

    @property
    def rest(self) -> Array:
        """The coordinates (nq,) at rest: zero, or the identity of a floating joint."""
        own = (link.joint.model for link in self.links if link.joint.parts.coordinates)
        return np.concatenate([np.empty(0), *(kind.rest for kind in own)])

    @property
    def limits(self) -> Array:
        """The limits (nq, 2): lowest and highest value of each coordinate, or infinity.

        A coordinate that others mimic is also held where they are within theirs.
        """
        return self._ranges.copy()

    @cached_property
    def _ranges(self) -> Array:
        """The same limits (nq, 2), read-only."""
        return combine_limits(self.links)

    @cached_property
    def coordinate_names(self) -> tuple[str, ...]:
        """The name of each coordinate: the link's, with ".x" and so on if there are several."""
        return list_coordinate_names(self.links)

    @cached_property
    def coordinate_units(self) -> tuple[str, ...]:
        """The unit of each coordinate: "rad", "m" or "1"."""
        return list_coordinate_units([link.joint for link in self.links])

    @cached_property
    def velocity_names(self) -> tuple[str, ...]:
        """The name of each velocity."""
        return list_velocity_names(self.links)

    @cached_property
    def velocity_units(self) -> tuple[str, ...]:
        """The unit of each velocity: "rad/s" or "m/s"."""
        return tuple(unit for link in self.links for unit in link.joint.parts.rates)

    def coordinates(self, q: Any, what: str = "q", limits: bool = True) -> Array:
        """Return a checked copy (..., nq) of q; a Pose may stand for one floating joint.

        InputError: wrong length, not finite, quaternion without length 1, outside the limits.
        UnitWarning: an angle that looks like degrees.
        """
        values = self._valid(q, what, as_bool(limits, "limits"))
        warn_of_degrees(values[..., self._angles], what)
        return values

    def _valid(self, q: Any, what: str, limits: bool = True) -> Array:
        """The same, whatever angles look like."""
        if self._floats and is_pose_like(q):
            q = as_pose(q).q
        values = as_floats(q, what, (self.nq,))
        for kind, rows, name in self._checked:
            values[..., rows] = kind.checked(values[..., rows], what, name)
        if limits:
            names, units = self.coordinate_names, self.coordinate_units
            check_within_limits(values, self._ranges, names, units, what, self.name)
        return values

    @cached_property
    def _checked(self) -> list[tuple[JointKind, slice, str]]:
        """The kinds that check coordinates themselves, with their rows and names of links."""
        found, start = [], 0
        for link in self.links:
            kind, rows = link.joint.model, slice(start, start + len(link.joint.parts.coordinates))
            if type(kind).checked is not JointKind.checked:
                found.append((kind, rows, link.name))
            start = rows.stop
        return found

    @cached_property
    def _angles(self) -> list[int]:
        """Which coordinates are angles that people write by hand: not those of rolling wheels."""
        own = [link.joint for link in self.links]
        rolling = [isinstance(joint.follows, Rolling) for joint in own for _ in joint.parts.units]
        units = zip(self.coordinate_units, rolling, strict=True)
        return [i for i, (unit, rolls) in enumerate(units) if unit == "rad" and not rolls]

    @cached_property
    def _floats(self) -> bool:
        """Whether all coordinates are those of one floating joint, so that a pose defines them."""
        return [link.joint.model.free for link in self.links if link.joint.moves] == [True]
