"""Coordinates of a robot that place a frame at a pose."""

from __future__ import annotations

import math

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.geometry.pose import Pose
from robsim.robot.joints.planar_joint import PlanarKind
from robsim.robot.link import Link, list_coordinate_names
from robsim.robot.robot import Robot
from robsim.world.scene import Scene

RESTARTS = 8  # of inverse kinematics; few, for a quick response


def solve_frame_placement(scene: Scene, frame: str, T_w_f: Pose, q: Array) -> Array:
    """Return coordinates (nq,) near q that place a frame at a pose in the world.

    A vehicle is placed in its plane: its position and heading are those nearest to the pose. An
    arm is placed by inverse kinematics, and by the position alone if it does not reach the pose,
    because it may have fewer than six joints. Raise InputError if no robot carries the frame, or if
    the position is not reachable.
    """
    robot, link = find_carrier(scene, frame)
    first = sum(each.nq for each in scene.robots[: scene.robots.index(robot)])
    own = slice(first, first + robot.nq)
    vehicle = _find_vehicle_link(robot, link)
    if vehicle is None:
        placed = _solve_arm(scene, robot, link, frame, T_w_f, q, own)
    else:
        placed = _solve_vehicle(scene, robot, vehicle, frame, T_w_f, q, own)
    return np.concatenate([q[: own.start], placed, q[own.stop :]])


def find_carrier(scene: Scene, frame: str) -> tuple[Robot, str]:
    """Return the robot and the link that carry a frame; raise InputError without such a robot."""
    carriers = {obj.name: obj.on for obj in scene.objects}
    carriers |= {eye.name: eye.on for eye in scene.cameras}
    while frame in carriers:
        frame = carriers[frame]
    owner, _, link = frame.partition(".")
    robot = next((each for each in scene.robots if each.name == owner), None)
    if robot is None:
        raise InputError(f"no robot carries {frame}")
    return robot, link


def _solve_arm(
    scene: Scene, robot: Robot, link: str, frame: str, T_w_f: Pose, q: Array, own: slice
) -> Array:
    """Return the coordinates of an arm that place a frame on one of its links."""
    name = f"{robot.name}.{link}"
    T_l_f = scene.pose(name, q).inv() @ scene.pose(frame, q)
    T_w_b = scene.pose(f"{robot.name}.{robot.links[0].name}", q)
    T_b_l = T_w_b.inv() @ T_w_f @ T_l_f.inv()
    result = robot.ik(T_b_l, q0=q[own], link=link, restarts=RESTARTS)
    if not result.success:  # an arm with fewer joints: solve for the position alone
        result = robot.ik(T_b_l, q0=q[own], link=link, restarts=RESTARTS, mask="position")
    if not result.success:
        raise InputError(f"{frame} does not reach this pose")
    return np.asarray(result.q)


def _find_vehicle_link(robot: Robot, link: str) -> Link | None:
    """Return the link with the planar joint below a link; None if another joint moves the link."""
    links = {each.name: each for each in robot.links}
    above, moving = links[link], list[Link]()
    while above.parent is not None:
        if above.joint.parts.coordinates:
            moving.append(above)
        above = links[above.parent]
    is_vehicle = len(moving) == 1 and isinstance(moving[0].joint.model, PlanarKind)
    return moving[0] if is_vehicle else None


def _solve_vehicle(
    scene: Scene, robot: Robot, vehicle: Link, frame: str, T_w_f: Pose, q: Array, own: slice
) -> Array:
    """Return the coordinates of a vehicle whose frame is nearest to a pose.

    The heading minimises the angle to the rotation, and the height and the tilt are ignored.
    """
    T_w_p = scene.pose(f"{robot.name}.{vehicle.parent}", q) @ vehicle.joint.place
    present, wanted = T_w_p.inv() @ scene.pose(frame, q), T_w_p.inv() @ T_w_f
    turned = wanted.rotation @ present.rotation.T
    turn = math.atan2(turned[1, 0] - turned[0, 1], turned[0, 0] + turned[1, 1])
    placed = q[own].copy()
    at = _find_coordinate(robot, vehicle)
    cos, sin = math.cos(turn), math.sin(turn)
    arm = present.position[:2] - placed[at : at + 2]
    placed[at : at + 2] = wanted.position[:2] - np.array([[cos, -sin], [sin, cos]]) @ arm
    placed[at + 2] += turn
    return placed


def _find_coordinate(robot: Robot, link: Link) -> int:
    """Return the index of the first coordinate of the joint of a link."""
    return len(list_coordinate_names(robot.links[: robot.links.index(link)]))
