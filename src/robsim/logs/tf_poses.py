"""Where bodies that drive or fly are, from the messages of /tf."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from robsim.base.arrays import Array
from robsim.base.errors import FileError
from robsim.geometry.pose import Pose
from robsim.logs.bag_files import TimedMessage
from robsim.logs.joint_states import JointStateFields
from robsim.logs.name_map import check_name_map
from robsim.logs.transforms import FrameTransforms
from robsim.robot.joints.planar_joint import PlanarKind
from robsim.world.scene import Scene

WORLD = "world"
TILT = 0.1  # radians, beyond which a body does not drive on its plane


@dataclass(frozen=True, eq=False)
class MobileBody:
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


class BodyPoses:
    """The bodies of a scene that drive or fly, and the frames that say where they are.

    called  {coordinate of the scene: its name in the messages}, where they differ
    frames  {"world" or "ROBOT.LINK": frame in the messages}, likewise

    InputError: a frame that does not move so.
    """

    def __init__(self, scene: Scene, called: Mapping[str, str], frames: Any) -> None:
        own = _find_mobile_bodies(scene, called)
        framed = _map_frame_names(frames, [each.frame for each in own])
        self.transforms = FrameTransforms()
        self._root = framed.get(WORLD, WORLD)
        self._bodies = [(framed.get(each.frame, each.frame), each) for each in own]
        self._last: dict[str, list[float]] = {}

    def __bool__(self) -> bool:
        return bool(self._bodies)

    def leave_out(self, told: Collection[str]) -> None:
        """Leave out the bodies of which joints have told a coordinate."""
        self._bodies = [each for each in self._bodies if not set(told) & set(each[1].names)]

    def of(self, name: str) -> str | None:
        """Return the link in the scene that a coordinate moves; None if that is none of these."""
        return next((body.frame for _, body in self._bodies if name in body.names), None)

    def still(self, what: str, transforms: Iterable[Any]) -> None:
        """Take transforms that do not change. FileError: one is no pose."""
        self.transforms.take(what, transforms, moving=False)

    def take(self, what: str, transforms: Iterable[Any]) -> Iterator[TimedMessage]:
        """Take transforms, and yield the coordinates of each body that they move, by name.

        Their time is that of the transform; zero if it says none.
        Those of other frames on the way to the world count as they were last, and move nothing.
        FileError: one is no pose.
        """
        times = self.transforms.take(what, transforms)
        for frame, body in self._bodies:
            moved = self.transforms.moves_with(frame, self._root)
            T = self.transforms.pose(frame, self._root)
            if moved in times and T is not None:
                self._last[frame] = body.coordinates(what, T, self._last.get(frame, ()))
                yield TimedMessage(
                    times[moved], JointStateFields(body.names, position=self._last[frame])
                )


def _map_frame_names(frames: Any, links: list[str]) -> Mapping[str, str]:
    """Return what a bag calls the world and the links of bodies. InputError: there is no such."""
    form, known = "{frame: frame in the bag}", [WORLD, *links]
    called = check_name_map(frames, "frames", form, known, "no {} that roams", "frames")
    return {name: own.removeprefix("/") for name, own in called.items()}


def _find_mobile_bodies(scene: Scene, called: Mapping[str, str]) -> tuple[MobileBody, ...]:
    """Return the bodies of a scene that drive or fly in the world itself, by names of a log."""
    links = [(robot, link) for robot in scene.robots for link in robot.links]
    every = (f"{robot.name}.{link.name}" for robot, link in links if link.joint.model.roams)
    found = (_make_mobile_body(scene, frame, called) for frame in every)
    return tuple(each for each in found if each is not None)


def _make_mobile_body(scene: Scene, frame: str, called: Mapping[str, str]) -> MobileBody | None:
    tree = scene.tree
    body, tail = tree.find(frame)
    member = next(each for each in tree.members if each.body == body)
    if tree.parent[body] != 0 or not (member.kind.free or isinstance(member.kind, PlanarKind)):
        return None
    home = scene.home.copy()
    home[member.q] = member.kind.rest
    before = tail @ scene.pose(frame, home).inv().matrix
    own = scene.coordinate_names[member.q][: 7 if member.kind.free else 3]
    names = tuple(called.get(name, name) for name in own)
    return MobileBody(frame, names, before, Pose(tail).inv().matrix)
