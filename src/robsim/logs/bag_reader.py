"""ROS 2 bags as runs."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from heapq import merge
from typing import Any, Literal, NamedTuple

import xarray as xr

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
from robsim.run.run_checks import check_instance
from robsim.run.run_from_log import make_run_from_log
from robsim.servo.camera_target import PairKey

CLOCKS = ("header", "log")
SHOWN = 5  # names in a warning


class BagImage(NamedTuple):
    """A compressed image of a bag: seconds, the format as the bag names it, and the bytes."""

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
    """Read a ROS 2 bag, a folder or a .mcap or .db3 file, as a run.

    Every period of the experiment has the last joints, marks and commands until then (zero-order
    hold), and `image_age` the seconds since the images; marks that are not seen are NaN. The run
    begins when all joints and all marks have been seen once, and ends with the joints.

    experiment  what was done: scene, task and period; None: the bag says it, if RobSim wrote it
    topics      {"joints", "commands", "marks.CAMERA" or "lens.CAMERA": topic}, where they are not
                those of `write_bag` nor the only ones of their type; commands are JointState or
                JointTrajectory of one point (their velocities), Float64MultiArray in the order of
                the commanded velocities, or Twist or TwistStamped of a body in its own axes; marks
                are Detection2DArray, or AprilTagDetectionArray, whose corners are tag36h11_7.0 ...
    names       {joint of the scene: joint in the bag}, where they differ
    marks       {target: the ids of its marks, in their order}; by default TARGET.NUMBER
    frames      {"world" or "ROBOT.LINK" of a body that drives or flies: frame in /tf}, where they
                are called otherwise; they say where it is if no JointState does
    clock       "header": times are the stamps of the messages, where they have any; "log": when
                they were recorded

    FileError: what cannot be read, lacks or does not fit; InputError: an argument, or rosbags
    lacks. A FileWarning names what of the topics is left out.

    >>> read_bag("nothing.mcap")
    Traceback (most recent call last):
    ...
    robsim.base.errors.FileError: no file nothing.mcap
    """
    check_known(clock, CLOCKS, "no clock {}", "clocks")
    with Bag(path) as bag, prefix_errors(str(path)):
        made = (
            _load_bag_experiment(bag)
            if experiment is None
            else check_instance(experiment, Experiment, "experiment")
        )
        return make_run_from_log(
            _BagReader(bag, made, clock).log(topics, names, marks, frames), made
        )


def read_bag_images(path: str | os.PathLike[str], topic: str) -> Iterator[BagImage]:
    """Yield the compressed images of a topic of a bag, as bytes, with their times in seconds.

    FileError: there is no such topic, or it holds something else.

    >>> next(read_bag_images("nothing.mcap", "/camera/image/compressed"))
    Traceback (most recent call last):
    ...
    robsim.base.errors.FileError: no file nothing.mcap
    """
    with Bag(path) as bag, prefix_errors(str(path)):
        check_topic(bag.topics, topic, TYPES["images"])
        for _, each in bag.messages(topic):  # one by one: all of them are too many
            image = each.message
            time = each.stamped or each.logged
            yield BagImage(time / NANO, str(image.format), bytes(image.data))


def _load_bag_experiment(bag: Bag) -> Experiment:
    """Return the experiment that a bag says. FileError: it says none."""
    if bag.topics.get(EXPERIMENT) not in TYPES["experiment"]:
        raise FileError(f"it has no {EXPERIMENT}: give the experiment, open_bag(path, experiment)")
    text = next((each.message.data for _, each in bag.messages(EXPERIMENT)), "")
    return Experiment.from_text(text, f"topic {EXPERIMENT}")


class _BagReader:
    """The topics of a bag as the streams of a log."""

    def __init__(self, bag: Bag, experiment: Experiment, clock: Clock) -> None:
        self.bag, self.scene, self.clock = bag, experiment.scene, clock
        self.controller = Controller(experiment)
        self.roles: dict[str, str] = {}
        self.others: dict[str, None] = {}
        self.messages: dict[str, list[RecordedMessage]] = {}

    def log(self, given: Any, names: Any, marks: Any, frames: Any) -> Log:
        """Return the streams of the bag, as a log of the experiment."""
        called = map_joint_names(names, self.scene)
        places = BodyPoses(self.scene, called, frames)
        self.roles = choose_topics(self.bag.topics, self.controller.cameras, given, bool(places))
        self.messages = {topic: [] for role, topic in self.roles.items() if role not in FRAME_ROLES}
        for topic, each in self.bag.messages(*self.messages):
            self.messages[topic].append(each)
        joints, rates = self._joints(called, places)
        commands = self._commands(called)
        seen: dict[PairKey, Stream] = {}
        for camera in self.controller.cameras:
            seen |= self._images(camera, marks)
        log = Log(str(self.bag.path), joints, seen, commands, rates, self._lenses())
        self._tell_others()
        return log

    def _joints(self, called: Mapping[str, str], places: BodyPoses) -> tuple[Stream, Stream | None]:
        """Return the coordinates, and the velocities as measured where there are such."""
        scene, topic = self.scene, f"topic {self.roles.get('joints', self.roles.get('frames'))}"
        found = list(self._found("joints")) if "joints" in self.roles else []
        states = (each.message for each in found if len(each.message.position))
        places.leave_out({name for state in states for name in state.name})
        if places and "frames" in self.roles:
            found = list(merge(found, self._moved(places), key=lambda each: each.time))
        q = JointValues([called.get(name, name) for name in scene.coordinate_names], "position")
        joints = read_joint_stream(topic, found, q)
        self.others |= dict.fromkeys(f"joint {name}" for name in q.others)
        if joints is None:
            raise FileError(f"{topic}: {_describe_missing_joint(q, places)}")
        qd = JointValues([called.get(name, name) for name in scene.velocity_names], "velocity")
        return joints, read_joint_stream(topic, found, qd)

    def _moved(self, places: BodyPoses) -> Iterator[TimedMessage]:
        """Yield where bodies are of which no JointState says it."""
        moving, still = self.roles["frames"], self.roles.get("still")
        for _, each in self.bag.messages(still) if still else ():
            places.still(f"topic {still}", each.message.transforms)
        for _, each in self.bag.messages(moving):
            for time, joints in places.take(f"topic {moving}", each.message.transforms):
                yield TimedMessage((self.clock == "header" and time) or each.logged, joints)

    def _commands(self, called: Mapping[str, str]) -> Stream | None:
        """Return the velocities that were commanded, zero for those that never were."""
        if "commands" not in self.roles:
            return None
        topic = self.roles["commands"]
        commands = CommandReader(self.controller, self.bag.topics[topic], called)
        stream = commands.stream(f"topic {topic}", self._found("commands"))
        self.others |= commands.others
        return stream

    def _images(self, camera: str, marks: Any) -> dict[PairKey, Stream]:
        """Return the pixels of the targets of a camera."""
        ids, sizes = map_mark_ids(self.controller, camera, marks)
        others: dict[str, None] = {}
        role = f"marks.{camera}"
        found = read_mark_streams(
            f"topic {self.roles[role]}", self._found(role), ids, sizes, others
        )
        self.others |= dict.fromkeys(f"mark {name}" for name in others)
        return found

    def _lenses(self) -> dict[str, Any]:
        """Return the intrinsics that the bag has, as attributes, by camera."""
        notes = {}
        for camera in self.controller.cameras:
            role = f"lens.{camera}"
            if role in self.roles:
                what, lens = f"topic {self.roles[role]}", self.scene.camera(camera).camera
                K = check_camera_info(what, self._found(role), camera, lens)
                if K is not None:
                    notes[f"{LOG_INTRINSICS}{camera}"] = K.ravel()
        return notes

    def _found(self, role: str) -> Iterator[TimedMessage]:
        return assign_times(self.messages[self.roles[role]], self.clock)

    def _tell_others(self) -> None:
        """Warn of what is left out, since the scene does not have it."""
        if self.others:
            shown = ", ".join(list(self.others)[:SHOWN])
            more = f" and {len(self.others) - SHOWN} more" if len(self.others) > SHOWN else ""
            text = f"{self.bag.path}: left out, as the scene has no such thing: {shown}{more}"
            warnings.warn(text, FileWarning, stacklevel=find_user_stacklevel())


def _describe_missing_joint(q: JointValues, places: BodyPoses) -> str:
    """Return in words which coordinate lacks, and how to say what it is called."""
    name = q.lacking[0]
    link, frames = places.of(name), places.transforms.frames
    text = f"no position of joint {name}; say what it is called there, as names={{'{name}': ...}}"
    if link is None or not frames:
        return f"{text}; {suggest_names(name, q.others, 'other joints')}"
    how = f"or which frame it moves, as frames={{'{link}': ..., 'world': ...}}"
    return f"{text}, {how}; {suggest_names(link, frames, 'frames')}"
