"""What a robot would have said on its topics during a run."""

from __future__ import annotations

from collections.abc import Iterator
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

LENSES = {0: ("plumb_bob", 5), 4: ("plumb_bob", 5), 5: ("plumb_bob", 5)}
RATIONAL = ("rational_polynomial", 8)


class Said(NamedTuple):
    """A message of a topic, with its type and its time in nanoseconds."""

    topic: str
    kind: str
    time: int
    message: Any


def spoken(run: xr.Dataset, experiment: Experiment, start: int) -> Iterator[Said]:
    """Yield what is said in a run, in order; its first instant is at `start` nanoseconds."""
    scene = experiment.scene
    times = start + np.round(run["time"].values * NANO).astype(np.int64)
    poses = _poses(scene, run["q"].values)
    moving = [name for name, T in poses.items() if (T[:1] != T).any()]
    text = experiment.origin["scenario"]
    if text:
        yield Said(topics.EXPERIMENT, messages.TEXT, start, message(messages.TEXT, data=text))
    still = _frames({name: poses[name][0] for name in poses if name not in moving}, start)
    yield Said(topics.STILL, messages.FRAMES, start, still)
    for i, each in enumerate(times):
        time = int(each)
        yield from _of_joints(run, i, time)
        moved = {name: poses[name][i] for name in moving}
        yield Said(topics.FRAMES, messages.FRAMES, time, _frames(moved, time))
        for camera in dict.fromkeys(run["mark_camera"].values.tolist()):
            lens = scene.camera(camera).camera
            info = _lens(lens, _header(time, camera))
            yield Said(topics.of_camera(camera, "camera_info"), messages.LENS, time, info)
            seen = _marks(run, camera, i, time)
            yield Said(topics.of_camera(camera, "detections"), messages.DETECTIONS, time, seen)


def _of_joints(run: xr.Dataset, i: int, time: int) -> Iterator[Said]:
    coordinates, velocities = (run[name].values.tolist() for name in ("coordinate", "velocity"))
    rates = run["qd_actual" if "qd_actual" in run else "qd"].values[i]
    alike = coordinates == velocities
    none = np.empty(0)
    state = joint_state(message, time, coordinates, run["q"].values[i], rates if alike else none)
    yield Said(topics.JOINTS, messages.JOINTS, time, state)
    command = joint_state(message, time, velocities, none, run["qd"].values[i])
    yield Said(topics.COMMANDS, messages.JOINTS, time, command)


def _header(time: int, frame: str) -> Any:
    return header(message, time, frame)


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


def _marks(run: xr.Dataset, camera: str, i: int, time: int) -> Any:
    """Return the message of the marks that a camera sees; those that it does not are left out."""
    header, found = _header(time, camera), []
    counts: dict[str, int] = {}
    own = np.flatnonzero(run["mark_camera"].values == camera)
    for mark, target in zip(own, run["mark_target"].values[own].tolist(), strict=True):
        number = counts[target] = counts.get(target, -1) + 1
        place = run["pixels"].values[i, mark]
        if np.isfinite(place).all():
            found.append(_mark(header, f"{target}.{number}", *place.tolist()))
    return message(messages.DETECTIONS, header=header, detections=found)


def _mark(header: Any, name: str, column: float, row: float) -> Any:
    """Return the message of one mark, as a box without width."""
    point = message("vision_msgs/msg/Point2D", x=column, y=row)
    centre = message("vision_msgs/msg/Pose2D", position=point, theta=0.0)
    box = message("vision_msgs/msg/BoundingBox2D", center=centre, size_x=0.0, size_y=0.0)
    return message("vision_msgs/msg/Detection2D", header=header, results=[], bbox=box, id=name)
