"""Camera poses that look at a target, and a scene with a flying camera."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.files import robots
from robsim.geometry.look_at import look_at_rotation
from robsim.geometry.pose import Pose
from robsim.vision.camera import Camera
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

SIZE = 640, 480  # pixels


def make_flying_scene(focal: float, marks: Array) -> Scene:
    """Return a flying camera, 640 x 480 pixels, and a target at the origin of the world."""
    K: list[list[float]] = [[focal, 0, (SIZE[0] - 1) / 2], [0, focal, (SIZE[1] - 1) / 2], [0, 0, 1]]
    eye = MountedCamera("eye", Camera(K, size=SIZE), on="free_camera.body")
    return Scene((robots.load("free_camera"),), (Object("square", marks=marks),), (eye,))


def look_at_points(positions: Array, at: Array, roll: Array, y: Array) -> Pose:
    """Return poses of cameras at positions (N, 3) that look at points (N, 3), rolled by (N,).

    Without roll the image columns run as close as possible to the direction y (3,).
    """
    axis = at - positions
    T = np.tile(np.eye(4), (len(axis), 1, 1))
    T[:, :3, :3] = look_at_rotation(axis / np.linalg.norm(axis, axis=1, keepdims=True), roll, y)
    T[:, :3, 3] = positions
    return Pose(T)


def directions_in_cap(u: Array, angle: float) -> Array:
    """Return directions (N, 3) within an angle of -z, uniform on the sphere, from u (N, 2) in 0..1.

    >>> directions_in_cap(np.array([[0.0, 0.3]]), 0.5)[0] + 0.0
    array([ 0.,  0., -1.])
    """
    z, turn = 1.0 - u[:, 0] * (1.0 - np.cos(angle)), 2.0 * np.pi * u[:, 1]
    r = np.sqrt(1.0 - z**2)
    return np.stack([r * np.cos(turn), r * np.sin(turn), -z], axis=1)


def interpolate_range(u: Array, low: float, high: float) -> Array:
    """Return numbers between low and high from numbers u in 0..1."""
    return low + (high - low) * u
