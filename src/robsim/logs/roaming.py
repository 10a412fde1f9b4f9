"""Bodies that drive or fly: their coordinates, from where they are in the world."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from robsim.base.arrays import Array
from robsim.base.errors import FileError
from robsim.geometry.pose import Pose
from robsim.robot.joints.planar import InPlane
from robsim.world.scene import Scene

TILT = 0.1  # radians, beyond which a body does not drive on its plane


@dataclass(frozen=True, eq=False)
class Roamer:
    """A body that drives or flies, whose coordinates follow from the pose of its link."""

    frame: str
    names: tuple[str, ...]  # of its coordinates that its pose says
    before: Array  # (4, 4), so that the motion of its joint is before @ T_world_link @ after
    after: Array

    def coordinates(self, what: str, T: Array, last: Sequence[float]) -> list[float]:
        """Return the coordinates at a pose (4, 4) in the world, the heading next to the last.

        FileError: the body is tilted out of the plane it drives on.
        """
        motion = self.before @ T @ self.after
        if len(self.names) > 3:
            return [float(value) for value in Pose(motion).q]
        if motion[2, 2] < math.cos(TILT):
            angle = math.degrees(math.acos(max(float(motion[2, 2]), -1.0)))
            raise FileError(f"{what}: '{self.frame}' is tilted by {angle:.3g} deg")
        theta = math.atan2(motion[1, 0], motion[0, 0])
        turns = round((last[2] - theta) / math.tau) if last else 0
        return [float(motion[0, 3]), float(motion[1, 3]), theta + turns * math.tau]


def roamers(scene: Scene, called: Mapping[str, str]) -> tuple[Roamer, ...]:
    """Return the bodies of a scene that drive or fly in the world itself, by names of a log."""
    links = [(robot, link) for robot in scene.robots for link in robot.links]
    every = (f"{robot.name}.{link.name}" for robot, link in links if link.joint.model.roams)
    found = (_roamer(scene, frame, called) for frame in every)
    return tuple(each for each in found if each is not None)


def _roamer(scene: Scene, frame: str, called: Mapping[str, str]) -> Roamer | None:
    tree = scene.tree
    body, tail = tree.find(frame)
    member = next(each for each in tree.members if each.body == body)
    if tree.parent[body] != 0 or not (member.kind.free or isinstance(member.kind, InPlane)):
        return None
    home = scene.home.copy()
    home[member.q] = member.kind.rest
    before = tail @ scene.pose(frame, home).inv().matrix
    own = scene.coordinate_names[member.q][: 7 if member.kind.free else 3]
    names = tuple(called.get(name, name) for name in own)
    return Roamer(frame, names, before, Pose(tail).inv().matrix)
