"""The joints of a scene that drives move by torques, with their checks."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, prefix_errors
from robsim.engine.scene_dynamics import SceneDynamics, evaluate_mass_matrix
from robsim.geometry.inertia import Inertia
from robsim.robot.joint import Joint
from robsim.robot.link import sum_inertias
from robsim.robot.rigid_bodies import RigidBodies
from robsim.robot.robot import Robot
from robsim.robot.robot_weights import (
    describe_origin,
    describe_source,
    list_link_inertias,
    sum_joint_numbers,
)
from robsim.world.actuation import Actuation
from robsim.world.drives.drive_rows import PERIOD_SLACK, count_whole_steps, spread_over_joints
from robsim.world.drives.joint_drive import JointDrive
from robsim.world.payload import Payload
from robsim.world.scene import Scene

LEAST_INERTIA = 1e-12  # least ratio of the eigenvalues of the mass matrix
LONGEST_STEP = 1e-3  # seconds, unless a step is given
MOST_PARTS = 1000  # sub-steps in a period


class DrivenJoint(NamedTuple):
    """Joint that a drive moves."""

    robot: Robot
    joint: Joint
    joint_name: str  # in the robot
    name: str  # of the velocity in the scene
    velocity: int  # index among the velocities of the scene
    coordinate: int  # index among the coordinates of the scene


@dataclass(frozen=True)
class DrivenJoints:
    """The joints of a scene that drives move, and the bodies on them.

    Drives move all revolute and prismatic joints of the robots with a commanded joint. Vehicles,
    rails, floating and planar joints, and joints of a user's kind move as commanded, as does what
    stands on them; a drive accounts for their rotation and their turning.
    """

    scene: Scene
    drive: JointDrive
    joints: tuple[DrivenJoint, ...]
    loads: tuple[Payload, ...]
    gravity: Array  # true acceleration (3,), in axes of the world
    seconds: float  # control period
    parts: int  # sub-steps in a period

    @classmethod
    def of(
        cls, scene: Scene, actuation: Actuation, columns: NDArray[np.int64], dt: float
    ) -> DrivenJoints:
        """Return the driven joints; raise InputError if they or the sub-steps do not fit."""
        joints = tuple(_find_driven_joints(scene, set(columns.tolist())))
        if not joints:
            raise InputError(
                "actuation.drive: the task commands no robot with revolute or prismatic joints, "
                "so that there is nothing to drive"
            )
        drive, parts = JointDrive.wrap(actuation.drive), count_substeps(actuation.step, dt)
        gravity = np.array(actuation.gravity)
        return cls(scene, drive, joints, actuation.payloads, gravity, dt, parts)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(each.name for each in self.joints)

    @property
    def velocities(self) -> list[int]:
        """Indices of the velocities among those of the scene."""
        return [each.velocity for each in self.joints]

    @property
    def coordinates(self) -> list[int]:
        """Indices of the coordinates among those of the scene."""
        return [each.coordinate for each in self.joints]

    @property
    def robots(self) -> list[Robot]:
        """The robots of the joints, each once."""
        return list({each.robot.name: each.robot for each in self.joints}.values())

    def numbers(self, part: str) -> Array:
        """Return armature, damping or friction (n,) or (n, runs) of the joints."""
        joints = (
            (f"{robot.name}.{link.name}", link.joint)
            for robot in self.robots
            for link in robot.links
        )
        return sum_joint_numbers(joints, self.scene.tree, self.bodies, part)

    @cached_property
    def limits(self) -> Array:
        """Largest torques (n,): of the drive, or the efforts of the joints; else infinite."""
        given = self.drive.torque_limit
        if given is not None:
            return spread_over_joints(given, "actuation.drive.torque_limit", self.names)
        return np.array([each.joint.effort or np.inf for each in self.joints])

    @property
    def dynamics(self) -> SceneDynamics:
        """The bodies with the coordinates of their joints."""
        return SceneDynamics(self.scene, self.bodies, self.coordinates)

    @cached_property
    def mass_matrix(self) -> Array:
        """Mass matrix (n, n) or (n, n, runs) at home, without the armature."""
        return evaluate_mass_matrix(self.dynamics, self.bodies.inertias)

    def check(self) -> None:
        """Raise InputError unless the torque limits and loads fit, and all joints move a mass."""
        _ = self.limits, self.payloads
        with prefix_errors("actuation.drive"):
            self.drive.check(self.names, self.seconds, self.parts)
        M = np.moveaxis(self.mass_matrix.reshape(*self.mass_matrix.shape[:2], -1), -1, 0)
        armature = self.numbers("armature").reshape(len(self.joints), -1).T
        values, vectors = np.linalg.eigh(M + armature[:, :, None] * np.eye(len(self.joints)))
        weak = values[:, 0] <= LEAST_INERTIA * values[:, -1]
        if weak.any():
            joint = self.joints[int(np.argmax(np.abs(vectors[weak][0, :, 0])))]
            source = describe_origin(joint.robot.origin)
            raise InputError(
                f"joint '{joint.joint_name}' of '{joint.robot.name}'{source} moves no mass: give "
                "its link or a link behind it an inertia, or the joint an armature"
            )

    @cached_property
    def payloads(self) -> tuple[tuple[Payload, tuple[int, Array]], ...]:
        """Loads, each with the body that carries it and the pose of its frame in the body."""
        return tuple(self._locate_payloads())

    def _locate_payloads(self) -> Iterator[tuple[Payload, tuple[int, Array]]]:
        for load in self.loads:
            with prefix_errors("actuation.payloads"):
                found = self.bodies.locate(self.scene.tree, load.on)
            if found is None:
                raise InputError(
                    f"actuation.payloads: no driven joint moves the frame '{load.on}', so that a "
                    "load on it has no effect"
                )
            first = count_periods_until(load.attached, self.seconds)
            last = math.inf if load.released is None else load.released / self.seconds
            if first >= last:
                raise InputError(
                    f"actuation.payloads: the load on '{load.on}' is attached and released between "
                    "two control instants, at which loads change"
                )
            yield load, found

    @cached_property
    def links_alone(self) -> RigidBodies:
        """The rigid bodies without the objects that they carry."""
        if not any(sum_inertias(thing.shapes) for thing in self.scene.objects):
            return self.bodies
        inertias = list(self._list_inertias(carried=False))
        return RigidBodies.of(self.scene.tree, inertias, self.velocities)

    @cached_property
    def bodies(self) -> RigidBodies:
        """The rigid bodies that the joints move."""
        return RigidBodies.of(self.scene.tree, list(self._list_inertias()), self.velocities)

    def _list_inertias(self, carried: bool = True) -> Iterator[tuple[str, Inertia]]:
        """Yield frames with their inertias: links, and objects that robots carry."""
        for robot in self.robots:
            named = describe_source(robot.name, robot.origin)
            for link, inertia in list_link_inertias(named, robot.links):
                yield f"{robot.name}.{link}", inertia
        for thing in self.scene.objects if carried else ():
            load = sum_inertias(thing.shapes)
            if load is not None:
                yield thing.name, load


def count_substeps(step: float | None, dt: float) -> int:
    """Return the number of steps in a period; InputError unless it is a whole number.

    Without a step, the longest steps of at most LONGEST_STEP are counted.
    """
    if step is None:
        step = dt / math.ceil(dt / LONGEST_STEP * (1.0 - PERIOD_SLACK))
    count = count_whole_steps(dt, step)
    if not count:
        raise InputError(
            f"actuation.step is {1e3 * step:g} ms, which does not divide the control period of "
            f"{1e3 * dt:g} ms; {1e3 * dt / max(round(dt / step), 1):.9g} ms does"
        )
    if count > MOST_PARTS:
        raise InputError(
            f"actuation.step is {1e3 * step:g} ms, {count} sub-steps in a control period of "
            f"{1e3 * dt:g} ms; at most {MOST_PARTS} are possible"
        )
    return count


def count_periods_until(seconds: float, dt: float) -> int:
    """Return the number of the first period that starts at a time or later."""
    return math.ceil(seconds / dt - PERIOD_SLACK)


def _find_driven_joints(scene: Scene, commanded: set[int]) -> Iterator[DrivenJoint]:
    """Yield the revolute and prismatic joints of the robots with a commanded joint."""
    first = 0
    for robot in scene.robots:
        own = range(first, first + robot.nv)
        first += robot.nv
        if commanded.isdisjoint(own):
            continue
        row = own.start
        for link in robot.links:
            count = len(link.joint.parts.velocities)
            if count == 1 and link.joint.kind in ("revolute", "prismatic"):
                (coordinate,) = scene.tree.alone(np.array([row])).tolist()
                name = scene.velocity_names[row]
                yield DrivenJoint(robot, link.joint, link.label, name, row, coordinate)
            row += count
