"""The coordinates and velocities of all robots of a scene, one robot after the other."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.robot.robot import Robot
from robsim.world.motion import Motion


class SceneCoordinates:
    """The coordinates and velocities of the robots of a scene.

    The velocities of a robot with a `Motion` are prescribed.
    """

    robots: tuple[Robot, ...]
    motions: tuple[Motion, ...]

    @cached_property
    def nq(self) -> int:
        """The number of coordinates."""
        return sum(robot.nq for robot in self.robots)

    @cached_property
    def nv(self) -> int:
        """The number of velocities."""
        return sum(robot.nv for robot in self.robots)

    @property
    def home(self) -> Array:
        """The home coordinates (nq,) of all robots."""
        return np.concatenate([np.empty(0), *(robot.home for robot in self.robots)])

    @property
    def limits(self) -> Array:
        """The limits (nq, 2): lowest and highest value of each coordinate, or infinity."""
        return np.concatenate([np.empty((0, 2)), *(robot.limits for robot in self.robots)])

    @cached_property
    def coordinate_names(self) -> tuple[str, ...]:
        """The names of the coordinates, with the robot's name as prefix if there are several."""
        return self._labels("coordinate_names")

    @cached_property
    def coordinate_units(self) -> tuple[str, ...]:
        """The unit of each coordinate: "rad", "m" or "1"."""
        return tuple(unit for robot in self.robots for unit in robot.coordinate_units)

    @cached_property
    def velocity_names(self) -> tuple[str, ...]:
        """The names of the velocities, with the robot's name as prefix if there are several."""
        return self._labels("velocity_names")

    @cached_property
    def velocity_units(self) -> tuple[str, ...]:
        """The unit of each velocity: "rad/s" or "m/s"."""
        return tuple(unit for robot in self.robots for unit in robot.velocity_units)

    @cached_property
    def prescribed(self) -> NDArray[np.bool_]:
        """Whether each velocity (nv,) is prescribed by a motion, so that no task commands it."""
        movers = {motion.robot for motion in self.motions}
        flags = [np.full(robot.nv, robot.name in movers) for robot in self.robots]
        return make_read_only(np.concatenate([np.empty(0, dtype=np.bool_), *flags]))

    @property
    def varies(self) -> bool:
        """Whether any prescribed motion depends on time."""
        return any(callable(motion.rates) for motion in self.motions)

    def drift(self, seconds: float) -> Array:
        """Return the prescribed velocities (nv,) at a time in seconds, zero for the others."""
        motions = {motion.robot: motion for motion in self.motions}
        each = [
            motions[robot.name].check(robot.nv, seconds)
            if robot.name in motions
            else np.zeros(robot.nv)
            for robot in self.robots
        ]
        return make_read_only(np.concatenate([np.empty(0), *each]))

    def _labels(self, which: str) -> tuple[str, ...]:
        """Return names of all robots, with the robot's name as prefix if there are several."""
        if len(self.robots) == 1:
            return tuple(getattr(self.robots[0], which))
        return tuple(f"{r.name}.{name}" for r in self.robots for name in getattr(r, which))
