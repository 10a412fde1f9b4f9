"""Sampling of a robot's workspace: configurations drawn within limits, and a link's positions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.analysis.manipulability import VelocityAxes, manipulability
from robsim.base.arrays import Array, as_integer, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.base.value import Value
from robsim.robot.robot import Robot
from robsim.statistics.random_numbers import WORKSPACE, uniform

MOST = 1_000_001  # upper bound, exclusive, of the number of configurations
CHUNK = 8192  # configurations at a time


@dataclass(frozen=True, eq=False)
class Workspace(Value):
    """The result of `sample_workspace`: configurations of a robot, and positions of one of its links.

    robot            the robot
    link             the link whose origins are the points
    axes             the velocities of the manipulability: "all", "linear" or "angular"
    q                (count, nq) configurations
    points           (count, 3) in metres, in the axes of the robot's base
    manipulability   (count,) as `manipulability` returns it
    """

    robot: Robot
    link: str
    axes: VelocityAxes
    q: Array
    points: Array
    manipulability: Array

    def __str__(self) -> str:
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        each = zip("xyz", low, high, strict=True)
        spans = ", ".join(f"{name} {a + 0.0:.3f} to {b + 0.0:.3f} m" for name, a, b in each)
        far = np.linalg.norm(self.points, axis=1)
        return (
            f"{self.robot.name}.{self.link} in {len(self.q)} configurations\n{spans}\n"
            f"{far.min():.3f} to {far.max():.3f} m from the base\n"
            f"{self.axes} manipulability up to {self.manipulability.max():.4g}"
        )


def sample_workspace(
    robot: Robot,
    count: int = 10_000,
    seed: int = 0,
    link: str | None = None,
    axes: VelocityAxes = "linear",
    length: float = 1.0,
) -> Workspace:
    """Sample where a link can be, with joints uniform and independent within their limits.

    A revolute joint without limits makes one turn about home. Row i of the draw depends only on the
    seed, so that a larger count adds configurations to a smaller one. Collisions are ignored.

    count    number of configurations
    seed     of the drawing
    link     the link whose origin is sampled; the tip by default
    axes, length   of the manipulability, as in `manipulability`

    InputError: another joint has no limits.

    >>> from robsim.files import robots
    >>> found = sample_workspace(robots.planar_2r(), count=1000)
    >>> print(found)  # a disc of two metres
    planar_2r.fore in 1000 configurations
    x -1.998 to 1.997 m, y -1.997 to 1.998 m, z 0.000 to 0.000 m
    0.002 to 2.000 m from the base
    linear manipulability up to 1
    """
    if not isinstance(robot, Robot):
        raise InputError(f"expected a Robot, got {format_value(robot)}")
    count, seed = as_integer(count, "count", 1, MOST), as_integer(seed, "seed", 0, 2**64)
    low, high = _coordinate_ranges(robot)
    q = low + (high - low) * uniform(seed, WORKSPACE, count, robot.nq)
    parts = [q[i : i + CHUNK] for i in range(0, count, CHUNK)]
    points = np.concatenate([robot.fk(part, link)[:, :3, 3] for part in parts])
    moves = np.concatenate([manipulability(robot, part, link, axes, length) for part in parts])
    return Workspace(
        robot,
        link or robot.tip,
        axes,
        make_read_only(q),
        make_read_only(points),
        make_read_only(moves),
    )


def _coordinate_ranges(robot: Robot) -> tuple[Array, Array]:
    """Return the lowest and the highest value (nq,) of each coordinate."""
    if not robot.nq:
        raise InputError(f"robot '{robot.name}' has no joint that moves, and so no workspace")
    low, high = robot.limits.T.copy()
    free = ~np.isfinite(robot.limits).all(axis=1)
    joints = [link.joint for link in robot.links for _ in link.joint.parts.coordinates]
    endless = free & np.array([not joint.model.turns for joint in joints])
    if endless.any():
        names = [f"'{robot.coordinate_names[i]}'" for i in np.flatnonzero(endless)]
        raise InputError(
            f"the workspace of '{robot.name}' has no end: no limits for {', '.join(names)}; "
            "expected limits for all joints but revolute ones"
        )
    low[free], high[free] = robot.home[free] - np.pi, robot.home[free] + np.pi
    return low, high
