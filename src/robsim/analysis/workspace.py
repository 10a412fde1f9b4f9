"""Sampling of a robot's workspace: random configurations within limits, and positions of a link."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.analysis.manipulability import VelocityAxes, manipulability
from robsim.base.arrays import Array, as_integer, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.base.value import Value
from robsim.robot.robot import Robot
from robsim.statistics.random_numbers import WORKSPACE, uniform

MOST = 1_000_001  # exclusive upper bound of the number of configurations
CHUNK = 8192  # configurations at a time


@dataclass(frozen=True, eq=False)
class Workspace(Value):
    """Sampled configurations of a robot and positions of one of its links; see `sample_workspace`.

    Attributes
    ----------
    robot : Robot
        The robot.
    link : str
        Link with the sampled origin.
    axes : {"all", "linear", "angular"}
        Velocities of the manipulability.
    q : ndarray of shape (count, nq)
        Configurations.
    points : ndarray of shape (count, 3)
        Positions of the link's origin in the axes of the robot's base, in metres.
    manipulability : ndarray of shape (count,)
        Manipulability of each configuration, see `manipulability`.

    Examples
    --------
    >>> import robsim as rs
    >>> space = rs.kinematics.sample_workspace(rs.robots.planar_2r(), count=100)
    >>> space.points.shape, bool((np.linalg.norm(space.points, axis=1) <= 2.0).all())
    ((100, 3), True)
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
        distances = np.linalg.norm(self.points, axis=1)
        return (
            f"{self.robot.name}.{self.link} in {len(self.q)} configurations\n{spans}\n"
            f"{distances.min():.3f} to {distances.max():.3f} m from the base\n"
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
    """Sample the positions of a link over configurations within the joint limits.

    Joint coordinates are uniform and independent. A revolute joint without limits makes one turn
    about home. Row i of the sample depends on the seed alone, so that a larger count extends a
    smaller one. Collisions are ignored.

    Parameters
    ----------
    robot : Robot
        The robot.
    count : int, default 10000
        Number of configurations.
    seed : int, default 0
        Seed of the random numbers.
    link : str, optional
        Link with the sampled origin. Default: the tip.
    axes : {"all", "linear", "angular"}, default "linear"
        Velocities of the manipulability, as in `manipulability`.
    length : float, default 1.0
        Unit of length of the manipulability in metres, as in `manipulability`.

    Returns
    -------
    Workspace
        Configurations, positions and manipulabilities; `print` shows their ranges.

    Raises
    ------
    InputError
        If a joint other than a revolute joint has no limits, or no joint moves.

    Examples
    --------
    >>> from robsim.files import robots
    >>> result = sample_workspace(robots.planar_2r(), count=1000)
    >>> print(result)  # a disc of two metres
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
    blocks = [q[i : i + CHUNK] for i in range(0, count, CHUNK)]
    points = np.concatenate([robot.fk(part, link)[:, :3, 3] for part in blocks])
    measures = np.concatenate([manipulability(robot, part, link, axes, length) for part in blocks])
    return Workspace(
        robot,
        link or robot.tip,
        axes,
        make_read_only(q),
        make_read_only(points),
        make_read_only(measures),
    )


def _coordinate_ranges(robot: Robot) -> tuple[Array, Array]:
    """Return the lowest and the highest value (nq,) of each coordinate."""
    if not robot.nq:
        raise InputError(f"robot '{robot.name}' has no joint that moves, and no workspace")
    low, high = robot.limits.T.copy()
    free = ~np.isfinite(robot.limits).all(axis=1)
    joints = [link.joint for link in robot.links for _ in link.joint.parts.coordinates]
    endless = free & np.array([not joint.model.turns for joint in joints])
    if endless.any():
        names = [f"'{robot.coordinate_names[i]}'" for i in np.flatnonzero(endless)]
        raise InputError(
            f"the workspace of '{robot.name}' is unbounded: no limits for {', '.join(names)}; "
            "expected limits for all joints except revolute joints"
        )
    low[free], high[free] = robot.home[free] - np.pi, robot.home[free] + np.pi
    return low, high
