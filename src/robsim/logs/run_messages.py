"""The messages of a run, as a robot publishes them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.logs import message_types, topics
from robsim.logs.command_messages import NONE, make_header, make_joint_state
from robsim.logs.message_series import MessageSeries
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
    origin, store = experiment.origin, message_types.load_typestore()
    for text in (origin["scenario"], origin.get("stored_data")):
        if text:
            kind = message_types.TEXT
            data = bytes(store.serialize_cdr(make_message(kind, data=text), kind))
            yield TopicMessage(topics.EXPERIMENT, kind, start, data)
    still = make_transforms(make_message, standing, start)
    data = bytes(store.serialize_cdr(still, message_types.FRAMES))
    yield TopicMessage(topics.STATIC_FRAMES, message_types.FRAMES, start, data)


def _joint_messages(arrays: _RunArrays, some: slice, times: Times) -> Iterator[_TopicMessages]:
    """Yield the messages of coordinates and of commanded velocities or efforts."""
    nq, names, kind = len(arrays.coordinates), arrays.velocities, message_types.JOINTS

    def state(time: int, numbers: Array) -> Message:
        parts = numbers[:nq], numbers[nq:]
        return make_joint_state(make_message, time, arrays.coordinates, *parts)

    def command(time: int, qd: Array) -> Message:
        velocity, effort = (NONE, qd) if arrays.commands_torques else (qd, NONE)
        return make_joint_state(make_message, time, names, NONE, velocity, effort)

    values = np.hstack([arrays.q[some], arrays.rates[some]])
    series = MessageSeries(kind, state, values.shape[1])
    yield _TopicMessages(topics.JOINTS, kind, series.serialize(times, values))
    series = MessageSeries(kind, command, len(names))
    yield _TopicMessages(topics.COMMANDS, kind, series.serialize(times, arrays.qd[some]))


def _frame_messages(poses: Mapping[str, Array], times: Times) -> _TopicMessages:
    """Return the messages of the poses (T, 7) of frames."""

    def transforms(time: int, numbers: Array) -> Message:
        return make_transforms(
            make_message, dict(zip(poses, numbers.reshape(-1, 7), strict=True)), time
        )

    series = MessageSeries(message_types.FRAMES, transforms, 7 * len(poses))
    values = np.hstack([np.empty((len(times), 0)), *poses.values()])
    return _TopicMessages(topics.FRAMES, series.kind, series.serialize(times, values))


def _lens_messages(scene: Scene, camera: str, times: Times) -> _TopicMessages:
    """Return the messages of the intrinsics of a camera."""
    lens = scene.camera(camera).camera

    def info(time: int, _: Array) -> Message:
        return make_camera_info(make_message, lens, _make_header(time, camera))

    series = MessageSeries(message_types.LENS, info, 0)
    data = series.serialize(times, np.empty((len(times), 0)))
    return _TopicMessages(topics.camera_topic(camera, "camera_info"), series.kind, data)


def _detection_messages(
    arrays: _RunArrays, camera: str, some: slice, times: Times
) -> _TopicMessages:
    """Return the messages of the marks that a camera sees; those with the same marks at once."""
    pixels = arrays.pixels[some][:, [mark for mark, _ in arrays.marks[camera]]]
    names = np.array([name for _, name in arrays.marks[camera]], dtype=object)
    patterns, rows = np.unique(np.isfinite(pixels).all(axis=2), axis=0, return_inverse=True)
    found: list[bytes] = [b""] * len(times)
    for k, seen in enumerate(patterns):
        ids = names[seen].tolist()

        def detections(time: int, numbers: Array, ids: list[str] = ids) -> Message:
            header = _make_header(time, camera)
            return make_detections(make_message, header, ids, numbers.reshape(-1, 2))

        alike = np.flatnonzero(rows == k)
        series = MessageSeries(message_types.DETECTIONS, detections, 2 * len(ids))
        for i, data in zip(
            alike.tolist(), series.serialize(times[alike], pixels[alike][:, seen]), strict=True
        ):
            found[i] = data
    topic = topics.camera_topic(camera, "detections")
    return _TopicMessages(topic, message_types.DETECTIONS, found)
