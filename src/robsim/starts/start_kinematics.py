"""Robot coordinates for poses of the moving frame."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, move_runs_last
from robsim.base.errors import InputError
from robsim.geometry.pose import Pose, homogeneous_matrix
from robsim.robot.frame_evaluator import FrameEvaluator
from robsim.robot.independent_joint import IndependentJoint
from robsim.run.end_variables import (
    compute_goal_pose,
    compute_moving_pose,
    get_camera_goal,
    select_goal_controller,
)
from robsim.servo.task_controller import TaskController
from robsim.starts.nearest_poses import NearestPoseSearch
from robsim.starts.pose_regions import PoseRegion
from robsim.statistics.random_numbers import RandomNumbers
from robsim.world.scene import Scene

RESTARTS = 10  # restarts of inverse kinematics
PROBES = 8  # random configurations that decide the motions of the frame
PROBE_STEP = 1e-4  # metres and radians
LEAST_RATE = 1e-6  # relative; slower motions of the frame count as none


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

    @cached_property
    def moving_columns(self) -> NDArray[np.int64]:
        """The coordinates of the carrying robot that move the frame, without quaternions."""
        robots = [robot.name for robot in self.scene.robots]
        place = robots.index(self._carrier()[0])
        first = sum(robot.nq for robot in self.scene.robots[:place])
        units = self.scene.coordinate_units
        columns = np.arange(first, first + self.scene.robots[place].nq)
        columns = columns[[units[i] != "1" for i in columns]]
        moves = np.abs(self._probe_rates(columns)).max(axis=(0, 1)) > LEAST_RATE
        return np.asarray(columns[moves])

    @cached_property
    def reaches_every_pose(self) -> bool:
        """Whether the frame has six motions, and inverse kinematics can place it."""
        if is_floating(self.controller, self.frame):
            return True
        tree = self.scene.tree
        kinds = tree.kinds(np.flatnonzero(tree.flag_velocities(self.frame)))
        if any("1" in kind.units for kind in kinds) or not self.moving_columns.size:
            return True  # a floating joint carries the frame, or inverse kinematics raises an error
        sigma = np.linalg.svd(self._probe_rates(self.moving_columns), compute_uv=False)
        rank = int((sigma > LEAST_RATE * sigma[:, :1]).sum(axis=1).max(initial=0))
        return rank == 6 and not any(kind.wheeled for kind in kinds)

    @property
    def joints_text(self) -> str:
        """The robot that moves the frame, with the number of its joints if they are too few."""
        if self.reaches_every_pose:
            return f"the robot that carries '{self.frame}'"
        tree, count = self.scene.tree, len(self.moving_columns)
        owners = [each for each in tree.members if self._moves_frame(each)]
        noun = "joint" if len(owners) == count else "coordinate"
        return f"the {count} {noun}{'s' * (count != 1)} that move '{self.frame}'"

    def _moves_frame(self, joint: IndependentJoint) -> bool:
        """Return whether a coordinate of a joint moves the frame."""
        return any(joint.q.start <= i < joint.q.stop for i in self.moving_columns.tolist())

    def _probe_rates(self, columns: NDArray[np.int64]) -> Array:
        """Return the rates (probes, 12, columns) of poses at random coordinates."""
        q = np.repeat(self._probes[:, None], 2 * len(columns), axis=1)
        for j, column in enumerate(columns.tolist()):
            q[:, 2 * j, column] += PROBE_STEP
            q[:, 2 * j + 1, column] -= PROBE_STEP
        T = self.poses(q.reshape(-1, self.scene.nq))[:, :3].reshape(PROBES, -1, 12)
        return np.swapaxes(T[:, ::2] - T[:, 1::2], 1, 2) / (2.0 * PROBE_STEP)

    @cached_property
    def _probes(self) -> Array:
        """Random coordinates (probes, nq)."""
        return self.sample_coordinates(RandomNumbers(0, "probes", np.arange(PROBES)))

    def sample_coordinates(
        self, draws: RandomNumbers, bodies: NDArray[np.int64] | None = None
    ) -> Array:
        """Return coordinates (draws, nq), uniform within their limits, for the joints of bodies.

        Other coordinates are at home. Default: all joints.
        """
        scene = self.scene
        q, share = np.tile(scene.home, (len(draws.numbers), 1)), draws.uniform(scene.nq)
        for member in scene.tree.members:
            if bodies is None or member.body in bodies:
                at = member.q
                q[:, at] = member.kind.sample(share[:, at], scene.home[at], scene.limits[at])
        return q

    def poses(self, q: Array) -> Array:
        """Return the poses (n, 4, 4) of the frame in the world at coordinates (n, nq)."""
        T = np.empty((len(q), 1, 4, 4))
        self._evaluator.poses(np.ascontiguousarray(q), T)
        return T[:, 0]

    @cached_property
    def _evaluator(self) -> FrameEvaluator:
        """The compiled kinematics of the frame."""
        return FrameEvaluator(self.scene.tree, [self.frame])

    def nearest_coordinates(
        self, region: PoseRegion, drawn: Array, draws: RandomNumbers
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return coordinates (n, nq) near to drawn poses (n, 4, 4), and which are in the region.

        The search starts at home in even attempts, and at random coordinates in odd ones. If the
        robot has too few motions for the errors of the first priority, poses may violate excused
        bounds where no small motion reduces these errors.
        """
        q = np.tile(self.scene.home, (len(drawn), 1))
        if draws.attempt % 2:
            columns = self.moving_columns
            guess = replace(draws, name=f"{draws.name}.guess")
            q[:, columns] = self.sample_coordinates(guess)[:, columns]
        search = NearestPoseSearch(self.poses, region, self.moving_columns, self.scene.limits)
        q = search.run(q, drawn)
        quantities = region.quantities(self.poses(q))
        fits = np.all([each.within for each in quantities if not each.excused], axis=0)
        aimed = np.all([each.within for each in quantities], axis=0)
        if (fits & ~aimed).any():
            goal = np.repeat(self.goal.matrix[None], PROBES, axis=0)
            if search.lacks_motions(self._probes, goal):
                aimed |= search.is_stationary(q, drawn)
        return q, fits & aimed

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
        base = robot.base if robot.on == "world" else self.scene.pose(robot.on) @ robot.base
        link_poses = base.inv() @ Pose(T) @ (link.inv() @ on).inv()
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
