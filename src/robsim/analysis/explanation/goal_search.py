"""Search for a camera pose with the features of a goal that is given as numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robsim.analysis.explanation.damped_search import minimise_errors, shorten_steps
from robsim.base.arrays import Array, move_runs_last
from robsim.features.feature import Observation
from robsim.geometry.pose import Pose, homogeneous_matrix
from robsim.geometry.rotation import random_quaternions
from robsim.kernels.formulas import se3
from robsim.servo.camera_target import CameraTarget
from robsim.servo.servo_controller import ServoController
from robsim.statistics.random_numbers import RandomNumbers
from robsim.vision.camera import Visibility

STARTS = 300  # random poses around the target
NEAREST_DEPTH, FARTHEST_DEPTH = 0.2, 5.0  # range of depths, in units of the depth at the start
LATERAL = 0.5  # largest tangent of the angle from the optical axis
ROUNDS = 100  # iterations of Levenberg and Marquardt
STEP = 0.5  # longest step, in radians and in depths


@dataclass(frozen=True, eq=False)
class NearestPose:
    """The pose of the target in camera axes with the features nearest to the goal.

    `error` is the largest error of a feature, and `length` the norm of all errors, both in units of
    one tolerance. `is_in_image` is whether the camera sees all marks from this pose.
    """

    T_c_o: Pose
    error: float
    length: float
    is_in_image: bool


def find_nearest_pose(
    servo: ServoController, known_poses: Sequence[Pose], depth: float
) -> NearestPose | None:
    """Return the nearest pose; None unless one camera regulates features given as numbers.

    The search starts from the poses T_c_o in `known_poses`, and from random poses around a target
    at a depth (m). Damped steps V = -(L'L + mu I)^-1 L'e of the camera reduce the error, with
    lengths in units of the depth (Levenberg 1944; Marquardt 1963).
    """
    if servo.bound_features.goal_values is None or len(servo.sights) != 1:
        return None
    with np.errstate(all="ignore"):  # invalid poses are dropped
        T, e = minimise_errors(
            lambda T: _error_and_rates(servo, T),
            lambda T, steps: _move_camera(servo, T, steps),
            _sample_search_starts(servo.sights[0], known_poses, depth),
            ROUNDS,
        )
    best = int(np.square(e).sum(axis=1).argmin())
    one = np.ascontiguousarray(T[..., best : best + 1])
    *_, flags = servo.sights[0].image(np.eye(3, 4)[..., None], one)
    in_image = bool((flags == Visibility.IN_IMAGE).all())
    errors = e[best]
    size, length = float(np.abs(errors).max()), float(np.linalg.norm(errors))
    return NearestPose(Pose(homogeneous_matrix(one)[0]), size, length, in_image)


def _sample_search_starts(sight: CameraTarget, known_poses: Sequence[Pose], depth: float) -> Array:
    """Return poses T_c_o (3, 4, B): the given poses, and random poses around the target."""
    share = RandomNumbers(0, "goal search", np.arange(STARTS)).uniform(6)
    T = np.array(Pose.from_quaternion(np.zeros(3), random_quaternions(share[:, :3])).matrix)
    depths = NEAREST_DEPTH * (FARTHEST_DEPTH / NEAREST_DEPTH) ** share[:, 3] * depth
    aside = LATERAL * (2.0 * share[:, 4:] - 1.0)
    middle = np.concatenate([aside, np.ones((STARTS, 1))], axis=1) * depths[:, None]
    T[:, :3, 3] = middle - T[:, :3, :3] @ sight.target.marks.mean(axis=0)
    return move_runs_last(np.concatenate([[each.matrix for each in known_poses], T])[:, :3], 2)


def _error_and_rates(servo: ServoController, T: Array) -> tuple[Array, Array]:
    """Return e (B, k) in tolerances, infinite behind the camera, and L (B, k, 6) in depths."""
    regulated = servo.bound_features
    (sight,) = regulated.sights
    depth, pixels, _ = sight.image(np.eye(3, 4)[..., None], T)
    more = {"model": sight.target.marks, "guess_last": np.ascontiguousarray(T)}
    observation = Observation.of_last(pixels, depth, sight.eye.camera, **more)
    views = [part.at_goal({sight.key: observation}, {}) for part in regulated.parts]
    pairs = list(zip(regulated.parts, views, strict=True))
    s = np.concatenate([part.measure(view) for part, view in pairs])
    L = np.concatenate([part.interaction(view) for part, view in pairs])
    scale = servo.tolerance_scale[:, None]
    e = scale * (s - regulated.s_goal)
    seen = np.isfinite(e).all(0)
    usable = seen & np.isfinite(L).all((0, 1))
    L = np.where(usable, scale[:, None] * L * _depth_units(servo, T), 0.0)
    return np.where(seen, e, np.inf).T, L.transpose(2, 0, 1)


def _depth_units(servo: ServoController, T: Array) -> Array:
    """Return the units (6, B) of camera motions: the depth of the middle of the marks, and 1."""
    middle: Array = servo.sights[0].target.marks.mean(axis=0)
    units = np.ones((6, T.shape[2]))
    units[:3] = np.einsum("jb,j->b", T[2, :3], middle) + T[2, 3]
    return units


def _move_camera(servo: ServoController, T: Array, steps: Array) -> Array:
    """Return T_c_o after camera motions exp(V) by shortened steps (B, 6) in depths."""
    V = _depth_units(servo, T) * shorten_steps(steps, np.linalg.norm(steps, axis=1), STEP).T
    inverse, displaced = np.empty(T.shape), np.empty(T.shape)
    se3.exp_se3(np.ascontiguousarray(-V), inverse)
    se3.compose(inverse, np.ascontiguousarray(T), displaced)
    return displaced
