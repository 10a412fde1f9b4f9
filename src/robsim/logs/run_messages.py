"""The messages of a run, as a robot publishes them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.logs import message_types, topics
from robsim.logs.command_messages import NONE, make_header, make_joint_state
from robsim.logs.message_types import Message, make_message
from robsim.logs.scene_messages import (
    compute_frame_poses,
    make_camera_info,
    make_detections,
    make_transforms,
)
from robsim.run.experiment import Experiment
from robsim.run.log import NANO

if TYPE_CHECKING:
    import xarray as xr

_make_header = partial(make_header, make_message)


class TopicMessage(NamedTuple):
    """A message with its topic, type and time."""

    topic: str
    kind: str
    time: int  # nanoseconds
    message: Message


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
    moving = [name for name, T in poses.items() if (T[:1] != T).any()]
    infos = {
        camera: make_camera_info(
            make_message, scene.camera(camera).camera, _make_header(start, camera)
        )
        for camera in arrays.marks
    }
    origin = experiment.origin
    for text in (origin["scenario"], origin.get("stored_data")):
        if text:
            message = make_message(message_types.TEXT, data=text)
            yield TopicMessage(topics.EXPERIMENT, message_types.TEXT, start, message)
    standing = {name: poses[name][0] for name in poses if name not in moving}
    still = make_transforms(make_message, standing, start)
    yield TopicMessage(topics.STATIC_FRAMES, message_types.FRAMES, start, still)
    for i, time in enumerate(times.tolist()):
        yield from _joint_messages(arrays, i, time)
        moving_poses = {name: poses[name][i] for name in moving}
        yield TopicMessage(
            topics.FRAMES,
            message_types.FRAMES,
            time,
            make_transforms(make_message, moving_poses, time),
        )
        for camera, first in infos.items():
            info = replace(first, header=_make_header(time, camera))
            yield TopicMessage(
                topics.camera_topic(camera, "camera_info"), message_types.LENS, time, info
            )
            seen = _detections_message(arrays, camera, i, time)
            yield TopicMessage(
                topics.camera_topic(camera, "detections"), message_types.DETECTIONS, time, seen
            )


def _joint_messages(arrays: _RunArrays, i: int, time: int) -> Iterator[TopicMessage]:
    """Yield the messages of coordinates and commanded velocities or efforts at an instant."""
    state = make_joint_state(make_message, time, arrays.coordinates, arrays.q[i], arrays.rates[i])
    yield TopicMessage(topics.JOINTS, message_types.JOINTS, time, state)
    names, qd = arrays.velocities, arrays.qd[i]
    velocity, effort = (NONE, qd) if arrays.commands_torques else (qd, NONE)
    command = make_joint_state(make_message, time, names, NONE, velocity, effort)
    yield TopicMessage(topics.COMMANDS, message_types.JOINTS, time, command)


def _detections_message(arrays: _RunArrays, camera: str, i: int, time: int) -> Message:
    """Return the Detection2DArray of the marks that a camera sees at an instant."""
    pixels = arrays.pixels[i, [mark for mark, _ in arrays.marks[camera]]]
    seen = np.flatnonzero(np.isfinite(pixels).all(axis=1))
    ids = [arrays.marks[camera][i][1] for i in seen]
    return make_detections(make_message, _make_header(time, camera), ids, pixels[seen])
