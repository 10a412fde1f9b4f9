"""Coordinates of a robot: names, units, limits and checks."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, as_bool, as_floats
from robsim.base.unit_warnings import warn_of_degrees
from robsim.base.value import Value
from robsim.geometry.pose import PoseLike, as_pose, is_pose_like
from robsim.robot.frame import Frame
from robsim.robot.joint import FIXED, JointKind, Rolling, list_coordinate_units
from robsim.robot.limits import check_within_limits, combine_limits
from robsim.robot.link import Link, list_coordinate_names, list_velocity_names
from robsim.robot.tree import Tree

Coordinates = ArrayLike | PoseLike  # (..., nq), or a pose if the only joint is floating
Home = Coordinates | Mapping[str, float]  # (nq,), or {coordinate: value}


class RobotCoordinates(Value):
    """Coordinates and velocities of a `Robot`."""

    name: str
    links: tuple[Link, ...]

    @cached_property
    def tree(self) -> Tree:
        """Kinematic tree of the robot alone, with its base link at the world frame."""
        base, *others = self.links
        frames = [Frame(base.name, "world", FIXED)]  # `base` is applied by the scene
        return Tree([*frames, *(Frame(k.name, k.parent or "world", k.joint) for k in others)])

    @cached_property
    def nq(self) -> int:
        """Number of coordinates."""
        return len(self.coordinate_names)

    @cached_property
    def nv(self) -> int:
        """Number of velocities."""
        return len(self.velocity_names)

    @property
    def rest(self) -> Array:
        """Coordinates (nq,) at rest: zero, or the identity of a floating joint."""
        own = (link.joint.model for link in self.links if link.joint.parts.coordinates)
        return np.concatenate([np.empty(0), *(kind.rest for kind in own)])

    @property
    def limits(self) -> Array:
        """Lowest and highest value (nq, 2) of each coordinate in rad or m, or infinity.

        The limits of mimicking joints also restrict the coordinate that they follow.
        """
        return self._ranges.copy()

    @cached_property
    def _ranges(self) -> Array:
        """Limits (nq, 2) as in `limits`, read-only."""
        return combine_limits(self.links)

    @cached_property
    def coordinate_names(self) -> tuple[str, ...]:
        """Name of each coordinate: the name of the joint or link, with a suffix such as ".x"."""
        return list_coordinate_names(self.links)

    @cached_property
    def coordinate_units(self) -> tuple[str, ...]:
        """Unit of each coordinate: "rad", "m" or "1"."""
        return list_coordinate_units([link.joint for link in self.links])

    @cached_property
    def velocity_names(self) -> tuple[str, ...]:
        """Name of each velocity."""
        return list_velocity_names(self.links)

    @cached_property
    def velocity_units(self) -> tuple[str, ...]:
        """Unit of each velocity: "rad/s" or "m/s"."""
        return tuple(unit for link in self.links for unit in link.joint.parts.rates)

    def coordinates(self, q: Coordinates, what: str = "q", limits: bool = True) -> Array:
        """Return coordinates as a checked array.

        Parameters
        ----------
        q : array_like of shape (..., nq), or Pose
            Coordinates in rad and m. A robot on a single floating joint also accepts a pose.
        what : str, default "q"
            Name of the coordinates in error messages.
        limits : bool, default True
            Whether to check the limits.

        Returns
        -------
        ndarray of shape (..., nq)
            Copy of the coordinates, with normalized quaternions.

        Raises
        ------
        InputError
            If the shape is wrong, a number is not finite, a quaternion does not have length 1, or a
            coordinate is outside of its limits.

        Warns
        -----
        UnitWarning
            If an angle looks like degrees.

        Examples
        --------
        >>> from robsim import Robot
        >>> Robot.from_dh([[0, 0, 1, 0]]).coordinates([1])
        array([1.])
        """
        values = self._validate(q, what, as_bool(limits, "limits"))
        warn_of_degrees(values[..., self._angle_indices], what)
        return values

    def _validate(self, q: Coordinates, what: str, limits: bool = True) -> Array:
        """Return checked coordinates (..., nq) as `coordinates` does, without a degree warning."""
        if self._is_floating and is_pose_like(q):
            q = as_pose(q).q
        values = as_floats(q, what, (self.nq,))  # type: ignore[arg-type]  # raises for others
        for kind, rows, name in self._kind_checks:
            values[..., rows] = kind.checked(values[..., rows], what, name)
        if limits:
            names, units = self.coordinate_names, self.coordinate_units
            check_within_limits(values, self._ranges, names, units, what, self.name)
        return values

    @cached_property
    def _kind_checks(self) -> list[tuple[JointKind, slice, str]]:
        """Kinds that check their own coordinates, each with its rows and the name of its link."""
        checks, start = [], 0
        for link in self.links:
            kind, rows = link.joint.model, slice(start, start + len(link.joint.parts.coordinates))
            if type(kind).checked is not JointKind.checked:
                checks.append((kind, rows, link.name))
            start = rows.stop
        return checks

    @cached_property
    def _angle_indices(self) -> NDArray[np.intp]:
        """Indices of the angles among the coordinates, except the angles of rolling wheels."""
        own = [link.joint for link in self.links]
        rolling = [isinstance(joint.follows, Rolling) for joint in own for _ in joint.parts.units]
        units = zip(self.coordinate_units, rolling, strict=True)
        return np.flatnonzero([unit == "rad" and not rolls for unit, rolls in units])

    @cached_property
    def _is_floating(self) -> bool:
        """Whether a pose defines all coordinates, because the only joint is floating."""
        return [link.joint.model.free for link in self.links if link.joint.moves] == [True]
