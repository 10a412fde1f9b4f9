"""Panda with a camera in hand: 500 starts near the limits of its joints.

Each joint starts within 0.9 rad of its home coordinate and at least 0.02 rad from its limits, and
the camera sees all marks, at least 8 pixels inside the image. The goal is home, 50 cm in front of
a square of 16 cm. Beside the textbooks' schemes, three of them run within constraints: 0.01 rad
from the limits of the joints, at most 2 rad/s and 8 rad/s^2, and marks 8 pixels inside the image.
"""

from __future__ import annotations

from robsim.base.arrays import Array
from robsim.files import robots
from robsim.geometry.pose import Pose
from robsim.servo.constraints.field_of_view import FieldOfView
from robsim.servo.constraints.joint_accelerations import JointAccelerations
from robsim.servo.constraints.joint_limits import JointLimits
from robsim.servo.constraints.joint_speeds import JointSpeeds
from robsim.statistics.random_numbers import SUITES, uniform
from robsim.suites.builtin_schemes import BUILT_IN, constrain_schemes
from robsim.suites.camera_poses import SIZE, interpolate_range
from robsim.suites.published.large_rolls import is_at_goal, sees_marks
from robsim.suites.suite import Suite, square_marks
from robsim.vision.camera import Camera
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

STARTS, SAMPLES, SEED = 500, 40_000, 2
SPREAD = 0.9  # radians about home
FROM_LIMIT = 0.02  # radians
FOCAL = 600.0  # pixels
CONSTRAINTS = FieldOfView(), JointLimits(0.01), JointSpeeds(2.0), JointAccelerations(8.0)
DISTANCE, SIDE = 0.5, 0.16  # of the square from the camera at home, and its side, metres


def suite() -> Suite:
    """Return the suite."""
    scene = _make_arm_scene()
    q = _sample_coordinates(scene)
    return Suite(
        "near_limits",
        1,
        "500 starts of a Panda near its joint limits, with the camera in hand",
        "RobSim; the arm: robots.panda",
        "at the end within 1 cm and 1 degree",
        is_at_goal,
        scene,
        scene.home,
        q[sees_marks(scene, q)][:STARTS],
        gain=1.5,
        dt=0.02,
        duration=20.0,
        schemes={**BUILT_IN, **constrain_schemes("within limits", *CONSTRAINTS)},
    )


def _make_arm_scene() -> Scene:
    """Return the arm, its camera, and a square in front of the camera at home."""
    arm = robots.load("panda")
    K: list[list[float]] = [[FOCAL, 0, (SIZE[0] - 1) / 2], [0, FOCAL, (SIZE[1] - 1) / 2], [0, 0, 1]]
    eye = MountedCamera("eye", Camera(K, size=SIZE), on=f"panda.{arm.tip}")
    T_w_c = Scene((arm,), (), (eye,)).pose("eye", arm.home)
    place = Pose(T_w_c.matrix) @ Pose.at(0, 0, DISTANCE)
    return Scene((arm,), (Object("square", marks=square_marks(SIDE), pose=place),), (eye,))


def _sample_coordinates(scene: Scene) -> Array:
    """Return coordinates (N, 7) about home and within the limits of the joints."""
    u = uniform(SEED, SUITES, SAMPLES, scene.nq)
    q = scene.home + interpolate_range(u, -SPREAD, SPREAD)
    low, high = scene.limits.T
    inside = (q > low + FROM_LIMIT) & (q < high - FROM_LIMIT)
    valid: Array = q[inside.all(axis=1)]
    return valid
