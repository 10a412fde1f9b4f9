"""Messages of frames, cameras and marks, for the message classes of rclpy or rosbags."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from robsim.base.arrays import Array, move_runs_last
from robsim.geometry.pose import Pose, homogeneous_matrix
from robsim.logs import message_types
from robsim.logs.command_messages import MakeMessage, make_header
from robsim.logs.message_types import Message
from robsim.vision.camera import Camera
from robsim.vision.camera_files.calibration_files import name_ros_model
from robsim.world.scene import Scene

COEFFICIENTS = {"plumb_bob": 5, "rational_polynomial": 8, "equidistant": 4}  # numbers of D


def list_frame_names(scene: Scene) -> list[str]:
    """Return the names of all links, cameras and objects of a scene."""
    links = [f"{robot.name}.{link.name}" for robot in scene.robots for link in robot.links]
    eyes, things = ([part.name for part in parts] for parts in (scene.cameras, scene.objects))
    return [*links, *eyes, *things]


def compute_frame_poses(
    scene: Scene, q: Array, names: Sequence[str] | None = None
) -> dict[str, Array]:
    """Return poses (T, 7) of frames in the world: position and quaternion (x, y, z, w).

    The coordinates are q (T, nq), and the default is all frames of the scene.
    """
    every = list_frame_names(scene) if names is None else list(names)
    if not every:
        return {}
    bodies = scene.tree.bodies(move_runs_last(q, 1))
    T = [homogeneous_matrix(scene.tree.frame(bodies, name), q.shape[:-1]) for name in every]
    return dict(zip(every, Pose(np.array(T)).q, strict=True))


def make_transforms(
    make: MakeMessage, poses: Mapping[str, Array], time: int, root: str = "world"
) -> Message:
    """Return the TFMessage of poses (7,) of frames in a root frame, at a time in ns."""
    transforms = []
    for name, T in poses.items():
        move = make("geometry_msgs/msg/Vector3", **dict(zip("xyz", T[:3].tolist(), strict=True)))
        both = make(
            "geometry_msgs/msg/Transform", translation=move, rotation=make_quaternion(make, T)
        )
        transforms.append(
            make(
                "geometry_msgs/msg/TransformStamped",
                header=make_header(make, time, root),
                child_frame_id=name,
                transform=both,
            )
        )
    return make(message_types.FRAMES, transforms=transforms)


def make_quaternion(make: MakeMessage, pose: Array) -> Message:
    """Return the Quaternion of a pose (7,): position and quaternion (x, y, z, w)."""
    return make("geometry_msgs/msg/Quaternion", **dict(zip("xyzw", pose[3:].tolist(), strict=True)))


def make_pose(make: MakeMessage, pose: Array) -> Message:
    """Return the Pose of a pose (7,): position and quaternion (x, y, z, w)."""
    point = make("geometry_msgs/msg/Point", **dict(zip("xyz", pose[:3].tolist(), strict=True)))
    orientation = make_quaternion(make, pose)
    return make("geometry_msgs/msg/Pose", position=point, orientation=orientation)


def make_camera_info(make: MakeMessage, camera: Camera, header: Message) -> Message:
    """Return the CameraInfo of a camera; its size is 0 x 0 if the camera has no size."""
    width, height = camera.size or (0, 0)
    model = name_ros_model(camera.lens, len(camera.distortion))
    d = np.zeros(COEFFICIENTS[model])
    d[: len(camera.distortion)] = camera.distortion
    K = np.array(camera.K)
    whole = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False}
    return make(
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
        roi=make("sensor_msgs/msg/RegionOfInterest", **whole),
    )


def make_detections(
    make: MakeMessage, header: Message, ids: Sequence[str], pixels: Array
) -> Message:
    """Return the Detection2DArray of marks at pixels (N, 2)."""
    each = zip(ids, pixels.tolist(), strict=True)
    detections = [_make_detection(make, header, name, *pixel) for name, pixel in each]
    return make(message_types.DETECTIONS, header=header, detections=detections)


def _make_detection(
    make: MakeMessage, header: Message, name: str, column: float, row: float
) -> Message:
    """Return the Detection2D of one mark, as a box of size zero."""
    point = make("vision_msgs/msg/Point2D", x=column, y=row)
    centre = make("vision_msgs/msg/Pose2D", position=point, theta=0.0)
    box = make("vision_msgs/msg/BoundingBox2D", center=centre, size_x=0.0, size_y=0.0)
    return make("vision_msgs/msg/Detection2D", header=header, results=[], bbox=box, id=name)
