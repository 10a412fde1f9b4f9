"""The messages of a run, as a robot publishes them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.logs import message_types, topics
from robsim.logs.command_messages import NONE, make_header, make_joint_state
from robsim.logs.message_types import Message, make_message
from robsim.run.experiment import Experiment
from robsim.run.log import NANO
from robsim.vision.camera import Camera
from robsim.vision.camera_files.calibration_files import name_ros_model
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

_make_header = partial(make_header, make_message)
COEFFICIENTS = {"plumb_bob": 5, "rational_polynomial": 8, "equidistant": 4}  # numbers of D


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
    poses = _frame_poses(scene, arrays.q)
    moving = [name for name, T in poses.items() if (T[:1] != T).any()]
    lenses = {camera: scene.camera(camera).camera for camera in arrays.marks}
    origin = experiment.origin
    for text in (origin["scenario"], origin.get("stored_data")):
        if text:
            message = make_message(message_types.TEXT, data=text)
            yield TopicMessage(topics.EXPERIMENT, message_types.TEXT, start, message)
    still = _transforms_message(
        {name: poses[name][0] for name in poses if name not in moving}, start
    )
    yield TopicMessage(topics.STATIC_FRAMES, message_types.FRAMES, start, still)
    for i, time in enumerate(times.tolist()):
        yield from _joint_messages(arrays, i, time)
        moving_poses = {name: poses[name][i] for name in moving}
        yield TopicMessage(
            topics.FRAMES, message_types.FRAMES, time, _transforms_message(moving_poses, time)
        )
        for camera, lens in lenses.items():
            info = _camera_info_message(lens, _make_header(time, camera))
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


def _frame_poses(scene: Scene, q: Array) -> dict[str, Array]:
    """Return the poses (T, 7) of all frames in the world: position and quaternion (x, y, z, w)."""
    links = [f"{robot.name}.{link.name}" for robot in scene.robots for link in robot.links]
    eyes, things = ([part.name for part in parts] for parts in (scene.cameras, scene.objects))
    poses = {name: scene.pose(name, q) for name in (*links, *eyes, *things)}
    return {name: np.broadcast_to(Pose(T.matrix).q, (len(q), 7)) for name, T in poses.items()}


def _transforms_message(poses: dict[str, Array], time: int) -> Message:
    """Return the TFMessage of poses (7,) of frames in the world."""
    transforms = []
    for name, T in poses.items():
        x, y, z, *rotation = T.tolist()
        move = make_message("geometry_msgs/msg/Vector3", x=x, y=y, z=z)
        turn = make_message(
            "geometry_msgs/msg/Quaternion", **dict(zip("xyzw", rotation, strict=True))
        )
        both = make_message("geometry_msgs/msg/Transform", translation=move, rotation=turn)
        transforms.append(
            make_message(
                "geometry_msgs/msg/TransformStamped",
                header=_make_header(time, "world"),
                child_frame_id=name,
                transform=both,
            )
        )
    return make_message(message_types.FRAMES, transforms=transforms)


def _camera_info_message(camera: Camera, header: Message) -> Message:
    """Return the CameraInfo of a camera; its size is 0 x 0 if the camera has no size."""
    width, height = camera.size or (0, 0)
    model = name_ros_model(camera.lens, len(camera.distortion))
    d = np.zeros(COEFFICIENTS[model])
    d[: len(camera.distortion)] = camera.distortion
    K = np.array(camera.K)
    whole = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False}
    return make_message(
        message_types.LENS,
        header=header,
        height=height,
        width=width,
        distortion_model=model,
        d=d,
        k=K.ravel(),
        r=np.eye(3).ravel(),
        p=np.column_stack([K, np.zeros(3)]).ravel(),
        binning_x=0,
        binning_y=0,
        roi=make_message("sensor_msgs/msg/RegionOfInterest", **whole),
    )


def _detections_message(arrays: _RunArrays, camera: str, i: int, time: int) -> Message:
    """Return the Detection2DArray of the marks that a camera sees at an instant."""
    header = _make_header(time, camera)
    places = ((name, *arrays.pixels[i, mark].tolist()) for mark, name in arrays.marks[camera])
    detections = [
        _detection_message(header, *each) for each in places if math.isfinite(each[1] + each[2])
    ]
    return make_message(message_types.DETECTIONS, header=header, detections=detections)


def _detection_message(header: Message, name: str, column: float, row: float) -> Message:
    """Return the Detection2D of one mark, as a box of size zero."""
    point = make_message("vision_msgs/msg/Point2D", x=column, y=row)
    centre = make_message("vision_msgs/msg/Pose2D", position=point, theta=0.0)
    box = make_message("vision_msgs/msg/BoundingBox2D", center=centre, size_x=0.0, size_y=0.0)
    return make_message("vision_msgs/msg/Detection2D", header=header, results=[], bbox=box, id=name)
