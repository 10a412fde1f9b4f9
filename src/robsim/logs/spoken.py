"""What a robot would have said on its topics during a run."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.logs import messages, topics
from robsim.logs.messages import message
from robsim.logs.write_commands import header, joint_state
from robsim.run.experiment import Experiment
from robsim.run.log import NANO
from robsim.vision.camera import Camera
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

_header = partial(header, message)
LENSES = {0: ("plumb_bob", 5), 4: ("plumb_bob", 5), 5: ("plumb_bob", 5)}
RATIONAL = ("rational_polynomial", 8)


class Said(NamedTuple):
    """A message of a topic, with its type and its time in nanoseconds."""

    topic: str
    kind: str
    time: int
    message: Any


class _Told(NamedTuple):
    """The arrays of a run that are said, each taken out of it once."""

    coordinates: list[str]
    velocities: list[str]
    q: Array
    qd: Array
    rates: Array  # (T, nq), or (T, 0) where they have other names
    pixels: Array
    marks: dict[str, list[tuple[int, str]]]  # by camera: the number in the run, and the name


def _told(run: xr.Dataset) -> _Told:
    coordinates, velocities = (run[name].values.tolist() for name in ("coordinate", "velocity"))
    rates = run["qd_actual" if "qd_actual" in run else "qd"].values
    alike = rates if coordinates == velocities else rates[:, :0]
    q, qd, pixels = (run[name].values for name in ("q", "qd", "pixels"))
    return _Told(coordinates, velocities, q, qd, alike, pixels, _names(run))


def _names(run: xr.Dataset) -> dict[str, list[tuple[int, str]]]:
    """Return number and name of the marks of each camera, TARGET.NUMBER."""
    found: dict[str, list[tuple[int, str]]] = {}
    counts: dict[tuple[str, str], int] = {}
    pairs = zip(run["mark_camera"].values.tolist(), run["mark_target"].values.tolist(), strict=True)
    for mark, (camera, target) in enumerate(pairs):
        number = counts[camera, target] = counts.get((camera, target), -1) + 1
        found.setdefault(camera, []).append((mark, f"{target}.{number}"))
    return found


def spoken(run: xr.Dataset, experiment: Experiment, start: int) -> Iterator[Said]:
    """Yield what is said in a run, in order; its first instant is at `start` nanoseconds."""
    scene, told = experiment.scene, _told(run)
    times = start + np.round(run["time"].values * NANO).astype(np.int64)
    poses = _poses(scene, told.q)
    moving = [name for name, T in poses.items() if (T[:1] != T).any()]
    lenses = {camera: scene.camera(camera).camera for camera in told.marks}
    text = experiment.origin["scenario"]
    if text:
        yield Said(topics.EXPERIMENT, messages.TEXT, start, message(messages.TEXT, data=text))
    still = _frames({name: poses[name][0] for name in poses if name not in moving}, start)
    yield Said(topics.STILL, messages.FRAMES, start, still)
    for i, time in enumerate(times.tolist()):
        yield from _of_joints(told, i, time)
        moved = {name: poses[name][i] for name in moving}
        yield Said(topics.FRAMES, messages.FRAMES, time, _frames(moved, time))
        for camera, lens in lenses.items():
            info = _lens(lens, _header(time, camera))
            yield Said(topics.of_camera(camera, "camera_info"), messages.LENS, time, info)
            seen = _marks(told, camera, i, time)
            yield Said(topics.of_camera(camera, "detections"), messages.DETECTIONS, time, seen)


def _of_joints(told: _Told, i: int, time: int) -> Iterator[Said]:
    state = joint_state(message, time, told.coordinates, told.q[i], told.rates[i])
    yield Said(topics.JOINTS, messages.JOINTS, time, state)
    command = joint_state(message, time, told.velocities, np.empty(0), told.qd[i])
    yield Said(topics.COMMANDS, messages.JOINTS, time, command)


def _poses(scene: Scene, q: Array) -> dict[str, Array]:
    """Return poses (T, 7) in the world of all frames: position, and quaternion x, y, z, w."""
    links = [f"{robot.name}.{link.name}" for robot in scene.robots for link in robot.links]
    eyes, things = ([part.name for part in parts] for parts in (scene.cameras, scene.objects))
    found = {name: scene.pose(name, q) for name in (*links, *eyes, *things)}
    return {name: np.broadcast_to(Pose(T.matrix).q, (len(q), 7)) for name, T in found.items()}


def _frames(poses: dict[str, Array], time: int) -> Any:
    """Return the message of poses (7,) of frames in the world."""
    transforms = []
    for name, T in poses.items():
        x, y, z, *rotation = T.tolist()
        move = message("geometry_msgs/msg/Vector3", x=x, y=y, z=z)
        turn = message("geometry_msgs/msg/Quaternion", **dict(zip("xyzw", rotation, strict=True)))
        both = message("geometry_msgs/msg/Transform", translation=move, rotation=turn)
        transforms.append(
            message(
                "geometry_msgs/msg/TransformStamped",
                header=_header(time, "world"),
                child_frame_id=name,
                transform=both,
            )
        )
    return message(messages.FRAMES, transforms=transforms)


def _lens(camera: Camera, header: Any) -> Any:
    """Return the message of intrinsics; without a border the image is 0 by 0 pixels."""
    width, height = camera.size or (0, 0)
    model, count = LENSES.get(len(camera.distortion), RATIONAL)
    d = np.zeros(count)
    d[: len(camera.distortion)] = camera.distortion
    K = np.array(camera.K)
    whole = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False}
    return message(
        messages.LENS,
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
        roi=message("sensor_msgs/msg/RegionOfInterest", **whole),
    )


def _marks(told: _Told, camera: str, i: int, time: int) -> Any:
    """Return the message of the marks that a camera sees; those that it does not are left out."""
    header = _header(time, camera)
    places = ((name, *told.pixels[i, mark].tolist()) for mark, name in told.marks[camera])
    found = [_mark(header, *each) for each in places if math.isfinite(each[1] + each[2])]
    return message(messages.DETECTIONS, header=header, detections=found)


def _mark(header: Any, name: str, column: float, row: float) -> Any:
    """Return the message of one mark, as a box without width."""
    point = message("vision_msgs/msg/Point2D", x=column, y=row)
    centre = message("vision_msgs/msg/Pose2D", position=point, theta=0.0)
    box = message("vision_msgs/msg/BoundingBox2D", center=centre, size_x=0.0, size_y=0.0)
    return message("vision_msgs/msg/Detection2D", header=header, results=[], bbox=box, id=name)
