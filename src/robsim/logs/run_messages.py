"""The messages of a run, as a robot publishes them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.logs import message_types, topics
from robsim.logs.command_messages import NONE, make_header, make_joint_state
from robsim.logs.message_layout import MessageLayout
from robsim.logs.message_types import Message, make_message
from robsim.logs.scene_messages import (
    compute_frame_poses,
    make_camera_info,
    make_detections,
    make_transforms,
)
from robsim.run.experiment import Experiment
from robsim.run.log import NANO, Times
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

BLOCK = 4096  # instants that are serialised at once
BOX = 5  # numbers of a box: column, row, angle and size
_make_header = partial(make_header, make_message)


class TopicMessage(NamedTuple):
    """A message in CDR, with its topic, type and time."""

    topic: str
    kind: str
    time: int  # nanoseconds
    data: bytes


class _TopicMessages(NamedTuple):
    """The messages (T,) of a topic in CDR, one for each instant."""

    topic: str
    kind: str
    data: list[bytes]


class _RunArrays(NamedTuple):
    """The arrays of a run that are written to messages, and their names."""

    coordinates: list[str]
    velocities: list[str]
    q: Array
    qd: Array
    rates: Array  # (T, nq), or (T, 0) if velocities have other names than coordinates
    pixels: Array
    commands_torques: bool  # whether qd are torques
    marks: dict[str, list[tuple[int, str]]]  # by camera: index in `pixels`, and id


def _read_run_arrays(run: xr.Dataset) -> _RunArrays:
    """Return the arrays of a run that are written to messages, and their names."""
    coordinates, velocities = (run[name].values.tolist() for name in ("coordinate", "velocity"))
    rates = run["qd_actual" if "qd_actual" in run else "qd"].values
    alike = rates if coordinates == velocities else rates[:, :0]
    q, qd, pixels = (run[name].values for name in ("q", "qd", "pixels"))
    torques = str(run["qd"].attrs.get("units", "")).startswith("N")
    return _RunArrays(coordinates, velocities, q, qd, alike, pixels, torques, _mark_names(run))


def _mark_names(run: xr.Dataset) -> dict[str, list[tuple[int, str]]]:
    """Return the index and the id (TARGET.NUMBER) of the marks of each camera."""
    names: dict[str, list[tuple[int, str]]] = {}
    counts: dict[tuple[str, str], int] = {}
    pairs = zip(run["mark_camera"].values.tolist(), run["mark_target"].values.tolist(), strict=True)
    for mark, (camera, target) in enumerate(pairs):
        number = counts[camera, target] = counts.get((camera, target), -1) + 1
        names.setdefault(camera, []).append((mark, f"{target}.{number}"))
    return names


def generate_messages(
    run: xr.Dataset, experiment: Experiment, start: int
) -> Iterator[TopicMessage]:
    """Yield the messages of a run in the order of time; its first instant is at `start` ns."""
    scene, arrays = experiment.scene, _read_run_arrays(run)
    times = start + np.round(run["time"].values * NANO).astype(np.int64)
    poses = compute_frame_poses(scene, arrays.q)
    moving = {name: T for name, T in poses.items() if (T[:1] != T).any()}
    standing = {name: T[0] for name, T in poses.items() if name not in moving}
    yield from _first_messages(experiment, standing, start)
    for i in range(0, len(times), BLOCK):
        some = slice(i, i + BLOCK)
        topic_messages = [
            *_joint_messages(arrays, some, times[some]),
            _frame_messages({name: T[some] for name, T in moving.items()}, times[some]),
        ]
        for camera in arrays.marks:
            topic_messages.append(_lens_messages(scene, camera, times[some]))
            topic_messages.append(_detection_messages(arrays, camera, some, times[some]))
        for k, time in enumerate(times[some].tolist()):
            for topic, kind, data in topic_messages:
                yield TopicMessage(topic, kind, time, data[k])


def _first_messages(
    experiment: Experiment, standing: Mapping[str, Array], start: int
) -> Iterator[TopicMessage]:
    """Yield the experiment, and the poses of the frames that do not move."""
    origin = experiment.origin
    for text in (origin["scenario"], origin.get("stored_data")):
        if text:
            kind = message_types.TEXT
            data = message_types.serialize_message(kind, make_message(kind, data=text))
            yield TopicMessage(topics.EXPERIMENT, kind, start, data)
    still = make_transforms(make_message, standing, start)
    data = message_types.serialize_message(message_types.FRAMES, still)
    yield TopicMessage(topics.STATIC_FRAMES, message_types.FRAMES, start, data)


def _joint_messages(arrays: _RunArrays, some: slice, times: Times) -> Iterator[_TopicMessages]:
    """Yield the messages of coordinates and of commanded velocities or efforts."""
    q, rates, qd = arrays.q[some], arrays.rates[some], arrays.qd[some]
    state = make_joint_state(make_message, 0, arrays.coordinates, q[0], rates[0])
    yield _serialize_topic(topics.JOINTS, message_types.JOINTS, state, times, np.hstack([q, rates]))
    velocity, effort = (NONE, qd[0]) if arrays.commands_torques else (qd[0], NONE)
    command = make_joint_state(make_message, 0, arrays.velocities, NONE, velocity, effort)
    yield _serialize_topic(topics.COMMANDS, message_types.JOINTS, command, times, qd)


def _frame_messages(poses: Mapping[str, Array], times: Times) -> _TopicMessages:
    """Return the messages of the poses (T, 7) of frames."""
    first = make_transforms(make_message, {name: T[0] for name, T in poses.items()}, 0)
    values = np.hstack([np.empty((len(times), 0)), *poses.values()])
    return _serialize_topic(topics.FRAMES, message_types.FRAMES, first, times, values)


def _lens_messages(scene: Scene, camera: str, times: Times) -> _TopicMessages:
    """Return the messages of the intrinsics of a camera."""
    lens, kind = scene.camera(camera).camera, message_types.LENS
    info = make_camera_info(make_message, lens, _make_header(0, camera))
    numbers = np.concatenate([info.d, info.k, info.r, info.p])
    topic = topics.camera_topic(camera, "camera_info")
    return _serialize_topic(topic, kind, info, times, np.tile(numbers, (len(times), 1)))


def _detection_messages(
    arrays: _RunArrays, camera: str, some: slice, times: Times
) -> _TopicMessages:
    """Return the messages of the marks that a camera sees; those of the same marks at once."""
    pixels = arrays.pixels[some][:, [mark for mark, _ in arrays.marks[camera]]]
    names = np.array([name for _, name in arrays.marks[camera]], dtype=object)
    patterns, rows = np.unique(np.isfinite(pixels).all(axis=2), axis=0, return_inverse=True)
    topic, kind = topics.camera_topic(camera, "detections"), message_types.DETECTIONS
    found: list[bytes] = [b""] * len(times)
    for k, seen in enumerate(patterns):
        alike = np.flatnonzero(rows == k)
        marks = pixels[alike][:, seen]
        ids, header = names[seen].tolist(), _make_header(0, camera)
        first = make_detections(make_message, header, ids, marks[0])
        boxes = np.zeros((*marks.shape[:2], BOX))
        boxes[:, :, :2] = marks
        some_messages = _serialize_topic(topic, kind, first, times[alike], boxes)
        for i, data in zip(alike.tolist(), some_messages.data, strict=True):
            found[i] = data
    return _TopicMessages(topic, kind, found)


def _serialize_topic(
    topic: str, kind: str, example: Message, times: Times, numbers: Array
) -> _TopicMessages:
    """Return messages of a topic that differ from an example in their times and numbers."""
    return _TopicMessages(topic, kind, MessageLayout(kind, example).serialize(times, numbers))
