"""ROS 2 bags as runs."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple

import xarray as xr

from robsim.base.errors import FileError, FileWarning, InputError, naming, said, suggest
from robsim.base.warned import callers
from robsim.logs import streams
from robsim.logs.bag_files import Bag, Timed
from robsim.logs.messages import JOINTS
from robsim.logs.topics import EXPERIMENT, TYPES, check_topic, chosen
from robsim.run.checks import of_kind
from robsim.run.commanded import RECORDED_K
from robsim.run.control.controller import Controller
from robsim.run.experiment import Experiment
from robsim.run.log import NANO, Log, Stream
from robsim.run.recorded import recorded
from robsim.servo.sight import Key

CLOCKS = ("header", "log")
SHOWN = 5  # names in a warning


class BagImage(NamedTuple):
    """A compressed image of a bag: seconds, the format as the bag names it, and the bytes."""

    time: float
    format: str
    data: bytes


def open_bag(
    path: str | os.PathLike[str],
    experiment: Experiment | None = None,
    *,
    topics: Mapping[str, str] | None = None,
    names: Mapping[str, str] | None = None,
    marks: Mapping[str, Sequence[str]] | None = None,
    clock: Literal["header", "log"] = "header",
) -> xr.Dataset:
    """Read a ROS 2 bag, a folder or a .mcap or .db3 file, as a run.

    Every period of the experiment has the last joints, marks and commands until then (zero-order
    hold), and `image_age` the seconds since the images; marks that are not seen are NaN. The run
    begins when all joints and all marks have been seen once, and ends with the joints.

    experiment  what was done: scene, task and period; None: the bag says it, if RobSim wrote it
    topics      {"joints", "commands", "marks.CAMERA" or "lens.CAMERA": topic}, where they are not
                those of `save_bag` nor the only ones of their type; commands are JointState (their
                velocities), or Float64MultiArray in the order of the commanded velocities
    names       {joint of the scene: joint in the bag}, where they differ
    marks       {target: the ids of its marks, in their order}; by default TARGET.NUMBER
    clock       "header": times are the stamps of the messages, where they have any; "log": when
                they were recorded

    FileError: what cannot be read, lacks or does not fit; InputError: an argument, or rosbags
    lacks. A FileWarning names what of the topics is left out.

    >>> open_bag("nothing.mcap")
    Traceback (most recent call last):
    ...
    robsim.base.errors.FileError: no file nothing.mcap
    """
    if clock not in CLOCKS:
        raise InputError(f"no clock {said(clock)}; {suggest(clock, CLOCKS, 'clocks')}")
    with Bag(path) as bag, naming(str(path)):
        made = _own(bag) if experiment is None else of_kind(experiment, Experiment, "experiment")
        reading = _Reading(bag, made, clock)
        return recorded(reading.log(topics, names, marks), made)


def bag_images(path: str | os.PathLike[str], topic: str) -> Iterator[BagImage]:
    """Yield the compressed images of a topic of a bag, as bytes, with their times in seconds.

    FileError: there is no such topic, or it holds something else.

    >>> next(bag_images("nothing.mcap", "/camera/image/compressed"))
    Traceback (most recent call last):
    ...
    robsim.base.errors.FileError: no file nothing.mcap
    """
    with Bag(path) as bag, naming(str(path)):
        check_topic(bag.topics, topic, TYPES["images"])
        for _, each in bag.messages(topic):  # one by one: all of them are too many
            image = each.message
            time = each.stamped or each.logged
            yield BagImage(time / NANO, str(image.format), bytes(image.data))


def _own(bag: Bag) -> Experiment:
    """Return the experiment that a bag says. FileError: it says none."""
    if bag.topics.get(EXPERIMENT) not in TYPES["experiment"]:
        raise FileError(f"it has no {EXPERIMENT}: give the experiment, open_bag(path, experiment)")
    text = next((each.message.data for _, each in bag.messages(EXPERIMENT)), "")
    return Experiment.from_text(text, f"topic {EXPERIMENT}")


class _Reading:
    """The topics of a bag as the streams of a log."""

    def __init__(self, bag: Bag, experiment: Experiment, clock: streams.Clock) -> None:
        self.bag, self.scene, self.clock = bag, experiment.scene, clock
        self.controller = Controller(experiment)
        self.roles: dict[str, str] = {}
        self.others: dict[str, None] = {}
        self.messages: dict[str, list[Timed]] = {}

    def log(self, given: Any, names: Any, marks: Any) -> Log:
        """Return the streams of the bag, as a log of the experiment."""
        self.roles = chosen(self.bag.topics, self.controller.cameras, given)
        self.messages = {topic: [] for topic in self.roles.values()}
        for topic, each in self.bag.messages(*self.messages):
            self.messages[topic].append(each)
        called = _called(names, {*self.scene.coordinate_names, *self.scene.velocity_names})
        joints, rates = self._joints(called)
        commands = self._commands(called)
        self._check_targets(marks)
        images: dict[Key, Stream] = {}
        for camera in self.controller.cameras:
            images |= self._images(camera, marks)
        log = Log(str(self.bag.path), joints, images, commands, rates, self._lenses())
        self._tell_others()
        return log

    def _joints(self, called: Mapping[str, str]) -> tuple[Stream, Stream | None]:
        """Return the coordinates, and the velocities as measured where there are such."""
        scene, topic = self.scene, f"topic {self.roles['joints']}"
        found = list(self._found("joints"))
        q = streams.Joints([called.get(name, name) for name in scene.coordinate_names])
        joints = q.stream(topic, found, "position")
        self.others |= dict.fromkeys(f"joint {name}" for name in q.others)
        if joints is None:
            name = q.lacking[0]
            raise FileError(
                f"{topic}: no position of joint {name}; say what it is called there, as "
                f"names={{'{name}': ...}}; {suggest(name, q.others, 'other joints')}"
            )
        qd = streams.Joints([called.get(name, name) for name in scene.velocity_names])
        return joints, qd.stream(topic, found, "velocity")

    def _commands(self, called: Mapping[str, str]) -> Stream | None:
        """Return the velocities that were commanded, zero for those that never were."""
        if "commands" not in self.roles:
            return None
        topic, scene = self.roles["commands"], self.scene
        found, what = self._found("commands"), f"topic {topic}"
        if self.bag.topics[topic] == JOINTS:
            qd = streams.Joints([called.get(name, name) for name in scene.velocity_names])
            stream = qd.stream(what, found, "velocity", every=False)
            self.others |= dict.fromkeys(f"joint {name}" for name in qd.others)
            return stream
        names = list(scene.velocity_names)
        columns = [names.index(name) for name in self.controller.velocity_names]
        return streams.numbered(what, found, columns, scene.nv)

    def _check_targets(self, marks: Any) -> None:
        """Raise InputError if ids are given for what is no target."""
        targets = {sight.target.name: None for sight in self.controller.sights}
        for name in marks if isinstance(marks, Mapping) else ():
            if name not in targets:
                raise InputError(
                    f"marks: no target {said(name)}; {suggest(name, targets, 'targets')}"
                )

    def _images(self, camera: str, marks: Any) -> dict[Key, Stream]:
        """Return the pixels of the targets of a camera."""
        own = [sight for sight in self.controller.sights if sight.eye.name == camera]
        sizes = {sight.key: len(sight.target.marks) for sight in own}
        ids = _ids(marks, {sight.target.name: len(sight.target.marks) for sight in own})
        names = {id_: ((camera, target), i) for id_, (target, i) in ids.items()}
        others: dict[str, None] = {}
        role = f"marks.{camera}"
        what = f"topic {self.roles[role]}"
        found = streams.images(what, self._found(role), names, sizes, others)
        self.others |= dict.fromkeys(f"mark {name}" for name in others)
        return found

    def _lenses(self) -> dict[str, Any]:
        """Return the intrinsics that the bag has, as attributes, by camera."""
        notes = {}
        for camera in self.controller.cameras:
            role = f"lens.{camera}"
            if role in self.roles:
                what, lens = f"topic {self.roles[role]}", self.scene.camera(camera).camera
                K = streams.check_lens(what, self._found(role), camera, lens)
                if K is not None:
                    notes[f"{RECORDED_K}{camera}"] = K.ravel()
        return notes

    def _found(self, role: str) -> Iterator[streams.At]:
        return streams.at_times(self.messages[self.roles[role]], self.clock)

    def _tell_others(self) -> None:
        """Warn of what is left out, since the scene does not have it."""
        if self.others:
            shown = ", ".join(list(self.others)[:SHOWN])
            more = f" and {len(self.others) - SHOWN} more" if len(self.others) > SHOWN else ""
            text = f"{self.bag.path}: left out, as the scene has no such thing: {shown}{more}"
            warnings.warn(text, FileWarning, stacklevel=callers())


def _called(names: Any, known: set[str]) -> Mapping[str, str]:
    """Return what joints are called in the bag, where that is something else."""
    if names is None:
        return {}
    if not isinstance(names, Mapping) or not all(isinstance(own, str) for own in names.values()):
        raise InputError(f"names: expected {{joint: joint in the bag}}, got {said(names)}")
    for name in names:
        if name not in known:
            raise InputError(
                f"names: no joint {said(name)}; {suggest(name, sorted(known), 'joints')}"
            )
    if len(set(names.values())) < len(names):
        raise InputError(f"names: two joints are one in the bag, in {said(dict(names))}")
    return names


def _ids(marks: Any, counts: Mapping[str, int]) -> dict[str, tuple[str, int]]:
    """Return target and number of each id of a mark."""
    given = {} if marks is None else marks
    if not isinstance(given, Mapping):
        raise InputError(f"marks: expected {{target: ids}}, got {said(marks)}")
    found: dict[str, tuple[str, int]] = {}
    for target, count in counts.items():
        ids = given.get(target, [f"{target}.{i}" for i in range(count)])
        texts = not isinstance(ids, str) and all(isinstance(each, str) for each in ids)
        if not texts or len(ids) != count:
            raise InputError(
                f"marks: '{target}' has {count} marks; expected as many ids, got {said(ids)}"
            )
        for i, each in enumerate(ids):
            if each in found:
                raise InputError(
                    f"marks: '{each}' is two marks, of '{found[each][0]}' and '{target}'"
                )
            found[each] = target, i
    return found
