"""Conversion of ROS 2 bags to runs."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from heapq import merge
from typing import Literal, NamedTuple

import xarray as xr

from robsim.base.arrays import Array
from robsim.base.errors import FileError, FileWarning, check_known, prefix_errors, suggest_names
from robsim.base.unit_warnings import find_user_stacklevel
from robsim.logs.bag_files import Bag, Clock, RecordedMessage, TimedMessage, assign_times
from robsim.logs.command_reader import CommandReader
from robsim.logs.detections import read_mark_streams
from robsim.logs.joint_states import JointValues, read_joint_stream
from robsim.logs.lens import check_camera_info
from robsim.logs.name_map import map_joint_names, map_mark_ids
from robsim.logs.tf_poses import BodyPoses
from robsim.logs.topics import EXPERIMENT, FRAME_ROLES, TYPES, check_topic, choose_topics
from robsim.run.control.standalone_controller import Controller
from robsim.run.experiment import Experiment
from robsim.run.log import NANO, Log, Stream
from robsim.run.log_commands import LOG_INTRINSICS
from robsim.run.ros_connection import RosConnection
from robsim.run.run_checks import check_instance
from robsim.run.run_from_log import make_run_from_log
from robsim.run.stored_data import unpack_stored_data
from robsim.servo.camera_target import PairKey

CLOCKS = ("header", "log")
SHOWN = 5  # names that a warning lists


class BagImage(NamedTuple):
    """A compressed image of a bag.

    Attributes
    ----------
    time : float
        Time in seconds: the stamp of the header, or the time of recording without a stamp.
    format : str
        Format as named in the message, such as "jpeg".
    data : bytes
        Compressed image, which an image library decodes.

    Examples
    --------
    >>> BagImage(1.5, "jpeg", bytes([255, 216, 255])).format
    'jpeg'
    """

    time: float
    format: str
    data: bytes


def read_bag(
    path: str | os.PathLike[str],
    experiment: Experiment | None = None,
    *,
    topics: Mapping[str, str] | None = None,
    names: Mapping[str, str] | None = None,
    marks: Mapping[str, Sequence[str]] | None = None,
    frames: Mapping[str, str] | None = None,
    clock: Literal["header", "log"] = "header",
) -> xr.Dataset:
    """Read a ROS 2 bag as a run.

    The run has one instant for each period of the experiment, with the joints, marks and commands
    nearest to it, within half a period. Without joints it has interpolated joints, and without
    marks or commands the last ones; the Notes of `read_log` give the rules and the variables with
    the times of the messages. Marks that are not seen are NaN. The run begins when every joint and
    every mark has been measured once, and ends with the last joint message.

    These messages are supported:

    - joints: JointState; for bodies that drive or fly also poses in /tf,
    - commands: JointState; JointTrajectory with one point, for its velocities; Float64MultiArray in
      the order of the commanded velocities; Twist or TwistStamped of a body in its own axes,
    - marks: Detection2DArray, or AprilTagDetectionArray, whose corners have the ids tag36h11_7.0
      and so on,
    - lens: CameraInfo.

    Parameters
    ----------
    path : path_like
        Folder, .mcap file or .db3 file.
    experiment : Experiment, optional
        Experiment with the scene, the task and the period. Default: the experiment in the bag, if
        RobSim wrote the bag.
    topics : mapping, optional
        Topics {"joints", "commands", "marks.CAMERA" or "lens.CAMERA": topic}, CAMERA being the name
        of a camera. Default: the topics of `write_bag`, or the only topic of a suitable type.
    names : mapping, optional
        Names {joint of the scene: joint in the bag}, if they differ.
    marks : mapping, optional
        Ids {target: ids of its marks in the messages, in order}. Default: TARGET.NUMBER, such as
        "plate.0".
    frames : mapping, optional
        Frames {"world" or "ROBOT.LINK": frame in /tf} of bodies that drive or fly, if they differ.
    clock : {"header", "log"}, default "header"
        Times of the messages: the stamps of their headers if they have any, or the times of
        recording.

    Returns
    -------
    xarray.Dataset
        Run with the recorded values.

    Raises
    ------
    FileError
        If the bag cannot be read, lacks a topic, or does not fit the experiment.
    InputError
        If an argument is invalid, or rosbags is not installed.

    Warns
    -----
    FileWarning
        If the messages contain joints or marks that the scene does not have.

    Examples
    --------
    >>> read_bag("nothing.mcap")
    Traceback (most recent call last):
    ...
    robsim.base.errors.FileError: no file nothing.mcap
    """
    check_known(clock, CLOCKS, "no clock {}", "clocks")
    with Bag(path) as bag, prefix_errors(str(path)):
        recorded_experiment = (
            _load_bag_experiment(bag)
            if experiment is None
            else check_instance(experiment, Experiment, "experiment")
        )
        return make_run_from_log(
            _BagReader(bag, recorded_experiment, clock).log(topics, names, marks, frames),
            recorded_experiment,
        )


def read_bag_images(path: str | os.PathLike[str], topic: str) -> Iterator[BagImage]:
    """Yield the compressed images of a topic of a bag, with their times in seconds.

    Parameters
    ----------
    path : path_like
        Folder, .mcap file or .db3 file.
    topic : str
        Topic of type CompressedImage.

    Yields
    ------
    BagImage
        Time, format and bytes of an image.

    Raises
    ------
    FileError
        If there is no such topic, or it has another type.

    Examples
    --------
    >>> next(read_bag_images("nothing.mcap", "/camera/image/compressed"))
    Traceback (most recent call last):
    ...
    robsim.base.errors.FileError: no file nothing.mcap
    """
    with Bag(path) as bag, prefix_errors(str(path)):
        check_topic(bag.topics, topic, TYPES["images"])
        for _, each in bag.messages(topic):  # one at a time, to save memory
            image = each.message
            time = each.stamped or each.logged
            yield BagImage(time / NANO, str(image.format), bytes(image.data))


def _load_bag_experiment(bag: Bag) -> Experiment:
    """Return the experiment in a bag; raise FileError if there is none."""
    if bag.topics.get(EXPERIMENT) not in TYPES["experiment"]:
        raise FileError(f"it has no {EXPERIMENT}: give the experiment, read_bag(path, experiment)")
    messages = (each.message.data for _, each in bag.messages(EXPERIMENT))
    text, data = next(messages, ""), next(messages, "")
    known = unpack_stored_data(data)
    return Experiment.from_text(text, f"topic {EXPERIMENT}", stored_data=known)


class _BagReader:
    """A converter of the topics of a bag to the streams of a log."""

    def __init__(self, bag: Bag, experiment: Experiment, clock: Clock) -> None:
        self.bag, self.scene, self.clock = bag, experiment.scene, clock
        self.controller = Controller(experiment)
        self.roles: dict[str, str] = {}
        self.others: dict[str, None] = {}
        self.messages: dict[str, list[RecordedMessage]] = {}

    def log(
        self,
        topics: Mapping[str, str] | None,
        names: Mapping[str, str] | None,
        marks: Mapping[str, Sequence[str]] | None,
        frames: Mapping[str, str] | None,
    ) -> Log:
        """Return the streams of the bag as a log of the experiment."""
        told = self.controller.experiment.ros2 or RosConnection()
        log_names = map_joint_names(dict(told.names) if names is None else names, self.scene)
        bodies = BodyPoses(self.scene, log_names, frames, told)
        marks = dict(told.ids) if marks is None else marks
        own = topics, bodies.links, told
        self.roles = choose_topics(self.bag.topics, self.controller.cameras, *own)
        self.messages = {topic: [] for role, topic in self.roles.items() if role not in FRAME_ROLES}
        for topic, each in self.bag.messages(*self.messages):
            self.messages[topic].append(each)
        joints, rates = self._joints(log_names, bodies)
        commands = self._commands(log_names)
        pixels: dict[PairKey, Stream] = {}
        for camera in self.controller.cameras:
            pixels |= self._images(camera, marks)
        log = Log(str(self.bag.path), joints, pixels, commands, rates, notes=self._lenses())
        self._warn_of_others()
        return log

    def _joints(
        self, log_names: Mapping[str, str], bodies: BodyPoses
    ) -> tuple[Stream, Stream | None]:
        """Return the coordinates, and the measured velocities if there are any."""
        scene, topic = self.scene, f"topic {self.roles.get('joints', self.roles.get('frames'))}"
        messages = list(self._timed_messages("joints")) if "joints" in self.roles else []
        states = (each.message for each in messages if len(each.message.position))
        bodies.leave_out({name for state in states for name in state.name})
        if bodies:
            moved = self._mobile_bodies(bodies) if "frames" in self.roles else self._poses(bodies)
            messages = list(merge(messages, moved, key=lambda each: each.time))
        q = JointValues([log_names.get(name, name) for name in scene.coordinate_names], "position")
        joints = read_joint_stream(topic, messages, q)
        self.others |= dict.fromkeys(f"joint {name}" for name in q.others)
        if joints is None:
            raise FileError(f"{topic}: {_describe_missing_joint(q, bodies)}")
        qd = JointValues([log_names.get(name, name) for name in scene.velocity_names], "velocity")
        return joints, read_joint_stream(topic, messages, qd)

    def _mobile_bodies(self, bodies: BodyPoses) -> Iterator[TimedMessage]:
        """Yield the coordinates of bodies that no JointState message covers, from their poses."""
        moving, still = self.roles["frames"], self.roles.get("still")
        for _, each in self.bag.messages(still) if still else ():
            bodies.store_static(f"topic {still}", each.message.transforms)
        for _, each in self.bag.messages(moving):
            for time, joints in bodies.take(f"topic {moving}", each.message.transforms):
                yield TimedMessage((self.clock == "header" and time) or each.logged, joints)

    def _poses(self, bodies: BodyPoses) -> Iterator[TimedMessage]:
        """Yield the coordinates of bodies that no JointState message covers, from odometry."""
        links = [link for link in bodies.links if f"pose.{link}" in self.roles]
        streams = (self._timed_messages(f"pose.{link}") for link in links)
        topics = (f"topic {self.roles[f'pose.{link}']}" for link in links)
        for what, link, stream in zip(topics, links, streams, strict=True):
            for time, message in stream:
                yield TimedMessage(time, bodies.take_pose(what, link, message))

    def _commands(self, log_names: Mapping[str, str]) -> Stream | None:
        """Return the commanded velocities; velocities without a command are zero."""
        if "commands" not in self.roles:
            return None
        topic = self.roles["commands"]
        told = self.controller.experiment.ros2
        order = told.order if told and topic == told.commands else ()
        commands = CommandReader(self.controller, self.bag.topics[topic], log_names, order)
        stream = commands.stream(f"topic {topic}", self._timed_messages("commands"))
        self.others |= commands.others
        return stream

    def _images(
        self, camera: str, marks: Mapping[str, Sequence[str]] | None
    ) -> dict[PairKey, Stream]:
        """Return the pixels of the targets of a camera."""
        ids, sizes = map_mark_ids(self.controller, camera, marks)
        others: dict[str, None] = {}
        role = f"marks.{camera}"
        streams = read_mark_streams(
            f"topic {self.roles[role]}", self._timed_messages(role), ids, sizes, others
        )
        self.others |= dict.fromkeys(f"mark {name}" for name in others)
        return streams

    def _lenses(self) -> dict[str, Array]:
        """Return the intrinsics in the bag by camera, as attributes of the run."""
        attributes = {}
        for camera in self.controller.cameras:
            role = f"lens.{camera}"
            if role in self.roles:
                what, lens = f"topic {self.roles[role]}", self.scene.camera(camera).camera
                K = check_camera_info(what, self._timed_messages(role), camera, lens)
                if K is not None:
                    attributes[f"{LOG_INTRINSICS}{camera}"] = K.ravel()
        return attributes

    def _timed_messages(self, role: str) -> Iterator[TimedMessage]:
        return assign_times(self.messages[self.roles[role]], self.clock)

    def _warn_of_others(self) -> None:
        """Warn of joints and marks that are ignored because the scene does not have them."""
        if self.others:
            shown = ", ".join(list(self.others)[:SHOWN])
            more = f" and {len(self.others) - SHOWN} more" if len(self.others) > SHOWN else ""
            text = f"{self.bag.path}: ignored, because the scene does not have them: {shown}{more}"
            warnings.warn(text, FileWarning, stacklevel=find_user_stacklevel())


def _describe_missing_joint(q: JointValues, bodies: BodyPoses) -> str:
    """Return an error text on the first coordinate without values, with a hint on its name."""
    name = q.missing[0]
    link, frames = bodies.link_of(name), bodies.transforms.frames
    text = f"no position of joint {name}; give its name in the bag as names={{'{name}': ...}}"
    if link is None or not frames:
        return f"{text}; {suggest_names(name, q.others, 'other joints')}"
    how = f"or the frame that the joint moves, as frames={{'{link}': ..., 'world': ...}}"
    return f"{text}, {how}; {suggest_names(link, frames, 'frames')}"
