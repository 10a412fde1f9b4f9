"""The coordinates of bodies that drive or fly, from their poses in /tf messages."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from robsim.base.arrays import Array
from robsim.base.errors import FileError, raise_file_errors
from robsim.geometry.pose import Pose
from robsim.logs.bag_files import TimedMessage
from robsim.logs.joint_states import JointStateFields
from robsim.logs.message_types import Message
from robsim.logs.name_map import check_name_map
from robsim.logs.transforms import FrameTransforms
from robsim.robot.joints.planar_joint import PlanarKind
from robsim.run.ros_connection import RosConnection
from robsim.world.scene import Scene

WORLD = "world"
TILT = 0.1  # radians: largest tilt of a body that drives on its plane


@dataclass(frozen=True, eq=False)
class MobileBody:
    """A body that drives or flies, whose coordinates follow from the pose of its link."""

    frame: str  # ROBOT.LINK
    names: tuple[str, ...]  # names of these coordinates in the log
    before: Array  # (4, 4): the motion of the joint is before @ T_world_link @ after
    after: Array  # (4, 4)

    def coordinates(self, what: str, T: Array, last: Sequence[float]) -> list[float]:
        """Return the coordinates at a pose T (4, 4) of the link in the world.

        The heading is within half a turn of the heading in the `last` coordinates. FileError is
        raised if the body is tilted out of its plane.
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
    """A reader of the coordinates of bodies that drive or fly, from TFMessages.

    The object is false if the scene has no such bodies.

    Parameters
    ----------
    scene : Scene
        Scene with the bodies.
    log_names : mapping
        Names {coordinate of the scene: its name in the messages}, if they differ.
    frames : mapping or None
        Frames {"world" or "ROBOT.LINK": frame in the messages}, if they differ.
    connection : RosConnection, optional
        Connection whose frames are used instead of None.

    Raises
    ------
    InputError
        If `frames` contains a frame of no body that drives or flies.
    """

    def __init__(
        self,
        scene: Scene,
        log_names: Mapping[str, str],
        frames: Mapping[str, str] | None,
        connection: RosConnection | None = None,
    ) -> None:
        bodies = _find_mobile_bodies(scene, log_names)
        links = [each.frame for each in bodies]
        if frames is None and connection is not None:  # it may name other frames, too
            frames = {k: v for k, v in dict(connection.frames).items() if k in (WORLD, *links)}
        log_frames = _map_frame_names(frames, links)
        self.transforms = FrameTransforms()
        self._root = log_frames.get(WORLD, WORLD)
        self._bodies = [(log_frames.get(each.frame, each.frame), each) for each in bodies]
        self._last: dict[str, list[float]] = {}

    def __bool__(self) -> bool:
        return bool(self._bodies)

    @property
    def links(self) -> list[str]:
        """The links of the bodies, as ROBOT.LINK."""
        return [body.frame for _, body in self._bodies]

    @property
    def bases(self) -> list[str]:
        """The links of the bodies that drive on a plane."""
        return [body.frame for _, body in self._bodies if len(body.names) == 3]

    @property
    def names(self) -> list[str]:
        """The names in messages of the coordinates of the bodies."""
        return [name for _, body in self._bodies for name in body.names]

    def take_pose(self, what: str, link: str, message: Message) -> JointStateFields:
        """Return the coordinates of a body at the pose of its link in the world.

        The message is an Odometry or a PoseStamped. FileError is raised for an invalid pose.
        """
        body = next(body for _, body in self._bodies if body.frame == link)
        pose = message.pose.pose if hasattr(message.pose, "pose") else message.pose
        at, turn = pose.position, pose.orientation
        with raise_file_errors(f"{what}: '{link}'"):
            place, axes = (at.x, at.y, at.z), (turn.x, turn.y, turn.z, turn.w)
            T = Pose.from_quaternion(place, axes).matrix
        self._last[link] = body.coordinates(what, T, self._last.get(link, ()))
        return JointStateFields(body.names, position=self._last[link])

    def leave_out(self, names: Collection[str]) -> None:
        """Leave out the bodies with a coordinate in `names`, which JointState messages cover."""
        self._bodies = [each for each in self._bodies if not set(names) & set(each[1].names)]

    def link_of(self, name: str) -> str | None:
        """Return the link of the body that a coordinate moves, or None."""
        return next((body.frame for _, body in self._bodies if name in body.names), None)

    def store_static(self, what: str, transforms: Iterable[Message]) -> None:
        """Store transforms that do not change; raise FileError for an invalid pose."""
        self.transforms.take(what, transforms, moving=False)

    def take(self, what: str, transforms: Iterable[Message]) -> Iterator[TimedMessage]:
        """Store transforms, and yield the coordinates of each body that they move, by name.

        The time is the stamp of the transform, or zero. Between the world and a body there may be
        several frames. The coordinates are yielded if the first of them that moves, from the body
        on, has a new transform; the other frames keep their last transforms. FileError is raised
        for an invalid pose.
        """
        times = self.transforms.take(what, transforms)
        for frame, body in self._bodies:
            moving_frame = self.transforms.moves_with(frame, self._root)
            T = self.transforms.pose(frame, self._root)
            if moving_frame in times and T is not None:
                self._last[body.frame] = body.coordinates(what, T, self._last.get(body.frame, ()))
                found = JointStateFields(body.names, position=self._last[body.frame])
                yield TimedMessage(times[moving_frame], found)


def _map_frame_names(frames: Mapping[str, str] | None, links: list[str]) -> Mapping[str, str]:
    """Return the names in a bag of the world and of links; raise InputError for other frames."""
    form, known = "{frame: frame in the bag}", [WORLD, *links]
    log_frames = check_name_map(
        frames, "frames", form, known, "no {} that drives or flies", "frames"
    )
    return {name: frame.removeprefix("/") for name, frame in log_frames.items()}


def _find_mobile_bodies(scene: Scene, log_names: Mapping[str, str]) -> tuple[MobileBody, ...]:
    """Return the bodies of a scene that drive or fly in the world, with their names in a log."""
    links = [(robot, link) for robot in scene.robots for link in robot.links]
    frames = (f"{robot.name}.{link.name}" for robot, link in links if link.joint.model.roams)
    bodies = (_make_mobile_body(scene, frame, log_names) for frame in frames)
    return tuple(each for each in bodies if each is not None)


def _make_mobile_body(scene: Scene, frame: str, log_names: Mapping[str, str]) -> MobileBody | None:
    """Return the body of a frame, or None if it does not drive or fly in the world."""
    tree = scene.tree
    body, tail = tree.find(frame)
    member = next(each for each in tree.members if each.body == body)
    if tree.parent[body] != 0 or not (member.kind.free or isinstance(member.kind, PlanarKind)):
        return None
    home = scene.home.copy()
    home[member.q] = member.kind.rest
    before = tail @ scene.pose(frame, home).inv().matrix
    names_in_scene = scene.coordinate_names[member.q][: 7 if member.kind.free else 3]
    names = tuple(log_names.get(name, name) for name in names_in_scene)
    return MobileBody(frame, names, before, Pose(tail).inv().matrix)
