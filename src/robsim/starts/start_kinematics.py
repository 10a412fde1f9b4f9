"""Robot coordinates for poses of the moving frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, move_runs_last
from robsim.base.errors import InputError
from robsim.geometry.pose import Pose, homogeneous_matrix
from robsim.run.end_variables import (
    compute_goal_pose,
    compute_moving_pose,
    get_camera_goal,
    select_goal_controller,
)
from robsim.servo.task_controller import TaskController
from robsim.world.scene import Scene

RESTARTS = 10  # restarts of inverse kinematics


@dataclass(frozen=True, eq=False)
class StartKinematics:
    """The moving frame of a bound task, with its goal, its target and its kinematics."""

    controller: TaskController

    @property
    def scene(self) -> Scene:
        """The true scene."""
        return self.controller.scene

    @cached_property
    def frame(self) -> str:
        """The name of the moving frame: a camera, or the target of a fixed camera."""
        return select_goal_controller(self.controller).moving

    @cached_property
    def _home(self) -> Array:
        """The home coordinates (nq, 1)."""
        return move_runs_last(self.scene.home, 1)

    @cached_property
    def goal(self) -> Pose:
        """The goal pose of the moving frame in the world; its home pose if the goal has no pose."""
        controller, home = select_goal_controller(self.controller), self._home
        has_pose = get_camera_goal(self.controller) is not None
        T = compute_goal_pose(controller, home, home.T) if has_pose else None
        return Pose(
            homogeneous_matrix(compute_moving_pose(controller, home) if T is None else T)[0]
        )

    def middle(self, target: str) -> Array:
        """Return the middle (3,) of the marks of an object in the world, at home."""
        marks = self.scene.object(target).marks
        return np.asarray(self.scene.pose(target) @ marks.mean(axis=0))

    def coordinates(self, T: Array) -> tuple[Array, NDArray[np.bool_]]:
        """Return coordinates (n, nq) for poses (n, 4, 4) of the moving frame, and which were found.

        Other coordinates stay at home. Raises InputError if no robot carries the frame.
        """
        if is_floating(self.controller, self.frame):
            return place_floating_frame(self.scene, self.frame, T), np.ones(len(T), dtype=bool)
        body = self._carrier()
        robot = self.scene.robot(body[0])
        on = Pose(self.scene.tree.find(self.frame)[1])
        link = Pose(self.scene.tree.find(".".join(body))[1])
        link_poses = robot.base.inv() @ Pose(T) @ (link.inv() @ on).inv()
        solution = robot.ik(link_poses, link=body[1], restarts=RESTARTS)
        q = self.scene.coordinates({robot.name: solution.q}, limits=False)
        return q, np.asarray(solution.success)

    def _carrier(self) -> tuple[str, str]:
        """Return the robot and the link that carry the moving frame."""
        parts: list[Any] = [*self.scene.cameras, *self.scene.objects]
        on = next((part.on for part in parts if part.name == self.frame), self.frame)
        robot, dot, link = on.partition(".")
        if not dot or robot not in [each.name for each in self.scene.robots]:
            raise InputError(
                f"start: poses of '{self.frame}' cannot be reached, as no robot carries it; give "
                "coordinates, as in start=rs.samplers.Uniform(low, high)"
            )
        return robot, link


def is_floating(controller: TaskController, frame: str) -> bool:
    """Return whether a task commands a single floating joint that carries the frame."""
    tree = controller.scene.tree
    body, _ = tree.find(frame)
    free = tree.models[body].free and tree.parent[body] == 0
    return bool(free and (tree.owners[controller.columns] == body).all())


def place_floating_frame(scene: Scene, frame: str, T: Array) -> Array:
    """Return coordinates (n, nq) for poses (n, 4, 4) of a floating frame in the world.

    The other coordinates stay at home.
    """
    tree = scene.tree
    body, T_b_f = tree.find(frame)
    place = Pose(homogeneous_matrix(tree.joints.place[body][..., None])[0])
    q = np.tile(scene.home, (len(T), 1))
    first = tree.joints.bodies[body].x
    q[:, first : first + 7] = (place.inv() @ Pose(T) @ Pose(T_b_f).inv()).q
    return q
