"""What a robot would have said on its topics during a run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.logs import message_types, topics
from robsim.logs.command_messages import make_header, make_joint_state
from robsim.logs.message_types import make_message
from robsim.run.experiment import Experiment
from robsim.run.log import NANO
from robsim.vision.camera import Camera
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

_make_header = partial(make_header, make_message)
DISTORTION_MODELS = {0: ("plumb_bob", 5), 4: ("plumb_bob", 5), 5: ("plumb_bob", 5)}
RATIONAL = ("rational_polynomial", 8)


class TopicMessage(NamedTuple):
    """A message of a topic, with its type and its time in nanoseconds."""

    topic: str
    kind: str
    time: int
    message: Any


class _RunArrays(NamedTuple):
    """The arrays of a run that are said, each taken out of it once."""

    coordinates: list[str]
    velocities: list[str]
    q: Array
    qd: Array
    rates: Array  # (T, nq), or (T, 0) where they have other names
    pixels: Array
    marks: dict[str, list[tuple[int, str]]]  # by camera: the number in the run, and the name


def _read_run_arrays(run: xr.Dataset) -> _RunArrays:
    coordinates, velocities = (run[name].values.tolist() for name in ("coordinate", "velocity"))
    rates = run["qd_actual" if "qd_actual" in run else "qd"].values
    alike = rates if coordinates == velocities else rates[:, :0]
    q, qd, pixels = (run[name].values for name in ("q", "qd", "pixels"))
    return _RunArrays(coordinates, velocities, q, qd, alike, pixels, _mark_names(run))


def _mark_names(run: xr.Dataset) -> dict[str, list[tuple[int, str]]]:
    """Return number and name of the marks of each camera, TARGET.NUMBER."""
    found: dict[str, list[tuple[int, str]]] = {}
    counts: dict[tuple[str, str], int] = {}
    pairs = zip(run["mark_camera"].values.tolist(), run["mark_target"].values.tolist(), strict=True)
    for mark, (camera, target) in enumerate(pairs):
        number = counts[camera, target] = counts.get((camera, target), -1) + 1
        found.setdefault(camera, []).append((mark, f"{target}.{number}"))
    return found


def generate_messages(
    run: xr.Dataset, experiment: Experiment, start: int
) -> Iterator[TopicMessage]:
    """Yield what is said in a run, in order; its first instant is at `start` nanoseconds."""
    scene, told = experiment.scene, _read_run_arrays(run)
    times = start + np.round(run["time"].values * NANO).astype(np.int64)
    poses = _frame_poses(scene, told.q)
    moving = [name for name, T in poses.items() if (T[:1] != T).any()]
    lenses = {camera: scene.camera(camera).camera for camera in told.marks}
    text = experiment.origin["scenario"]
    if text:
        yield TopicMessage(
            topics.EXPERIMENT,
            message_types.TEXT,
            start,
            make_message(message_types.TEXT, data=text),
        )
    still = _transforms_message(
        {name: poses[name][0] for name in poses if name not in moving}, start
    )
    yield TopicMessage(topics.STATIC_FRAMES, message_types.FRAMES, start, still)
    for i, time in enumerate(times.tolist()):
        yield from _joint_messages(told, i, time)
        moved = {name: poses[name][i] for name in moving}
        yield TopicMessage(
            topics.FRAMES, message_types.FRAMES, time, _transforms_message(moved, time)
        )
        for camera, lens in lenses.items():
            info = _camera_info_message(lens, _make_header(time, camera))
            yield TopicMessage(
                topics.camera_topic(camera, "camera_info"), message_types.LENS, time, info
            )
            seen = _detections_message(told, camera, i, time)
            yield TopicMessage(
                topics.camera_topic(camera, "detections"), message_types.DETECTIONS, time, seen
            )


def _joint_messages(told: _RunArrays, i: int, time: int) -> Iterator[TopicMessage]:
    state = make_joint_state(make_message, time, told.coordinates, told.q[i], told.rates[i])
    yield TopicMessage(topics.JOINTS, message_types.JOINTS, time, state)
    command = make_joint_state(make_message, time, told.velocities, np.empty(0), told.qd[i])
    yield TopicMessage(topics.COMMANDS, message_types.JOINTS, time, command)


def _frame_poses(scene: Scene, q: Array) -> dict[str, Array]:
    """Return poses (T, 7) in the world of all frames: position, and quaternion x, y, z, w."""
    links = [f"{robot.name}.{link.name}" for robot in scene.robots for link in robot.links]
    eyes, things = ([part.name for part in parts] for parts in (scene.cameras, scene.objects))
    found = {name: scene.pose(name, q) for name in (*links, *eyes, *things)}
    return {name: np.broadcast_to(Pose(T.matrix).q, (len(q), 7)) for name, T in found.items()}


def _transforms_message(poses: dict[str, Array], time: int) -> Any:
    """Return the message of poses (7,) of frames in the world."""
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


def _camera_info_message(camera: Camera, header: Any) -> Any:
    """Return the message of intrinsics; without a border the image is 0 by 0 pixels."""
    width, height = camera.size or (0, 0)
    model, count = DISTORTION_MODELS.get(len(camera.distortion), RATIONAL)
    d = np.zeros(count)
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


def _detections_message(told: _RunArrays, camera: str, i: int, time: int) -> Any:
    """Return the message of the marks that a camera sees; those that it does not are left out."""
    header = _make_header(time, camera)
    places = ((name, *told.pixels[i, mark].tolist()) for mark, name in told.marks[camera])
    found = [
        _detection_message(header, *each) for each in places if math.isfinite(each[1] + each[2])
    ]
    return make_message(message_types.DETECTIONS, header=header, detections=found)


def _detection_message(header: Any, name: str, column: float, row: float) -> Any:
    """Return the message of one mark, as a box without width."""
    point = make_message("vision_msgs/msg/Point2D", x=column, y=row)
    centre = make_message("vision_msgs/msg/Pose2D", position=point, theta=0.0)
    box = make_message("vision_msgs/msg/BoundingBox2D", center=centre, size_x=0.0, size_y=0.0)
    return make_message("vision_msgs/msg/Detection2D", header=header, results=[], bbox=box, id=name)
