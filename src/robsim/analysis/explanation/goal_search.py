"""Search for a camera pose with the features of a goal that is given as numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

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
        e, T = _minimise_error(servo, _sample_search_starts(servo.sights[0], known_poses, depth))
    best = int(np.square(e).sum(0).argmin())
    one = np.ascontiguousarray(T[..., best : best + 1])
    *_, flags = servo.sights[0].image(np.eye(3, 4)[..., None], one)
    in_image = bool((flags == Visibility.IN_IMAGE).all())
    errors = e[:, best]
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


def _minimise_error(servo: ServoController, T: Array) -> tuple[Array, Array]:
    """Return the errors (k, B) at the end of the descents, in tolerances, and the poses T."""
    e, L = _error_and_interaction(servo, T)
    damping = np.full(T.shape[2], 1e-3)
    for _ in range(ROUNDS):
        next_T = _move_camera(T, _levenberg_step(e, L, damping, _mean_depth(servo, T)))
        next_e, next_L = _error_and_interaction(servo, next_T)
        better = np.square(next_e).sum(0) < np.square(e).sum(0)
        damping = np.clip(np.where(better, damping / 5, damping * 4), 1e-12, 1e12)
        T = np.where(better, next_T, T)
        e, L = np.where(better, next_e, e), np.where(better, next_L, L)
    return e, T


def _error_and_interaction(servo: ServoController, T: Array) -> tuple[Array, Array]:
    """Return the measured e (k, B) and L (k, 6, B); infinite behind the camera."""
    regulated = servo.bound_features
    (sight,) = regulated.sights
    depth, pixels, _ = sight.image(np.eye(3, 4)[..., None], T)
    more = {"model": sight.target.marks, "guess_last": np.ascontiguousarray(T)}
    observation = Observation.of_last(pixels, depth, sight.eye.camera, **more)
    views = [part.at_goal({sight.key: observation}, {}) for part in regulated.parts]
    pairs = list(zip(regulated.parts, views, strict=True))
    s = np.concatenate([part.measure(view) for part, view in pairs])
    L = np.concatenate([part.interaction(view) for part, view in pairs])
    scale = (servo.tolerance / servo.tolerances)[:, None]
    e = scale * (s - regulated.s_goal)
    return np.where(np.isfinite(e).all(0), e, np.inf), scale[:, None] * L


def _mean_depth(servo: ServoController, T: Array) -> Array:
    """Return the depths (B,) of the middle of the marks."""
    middle: Array = servo.sights[0].target.marks.mean(axis=0)
    return np.asarray(np.einsum("jb,j->b", T[2, :3], middle) + T[2, 3])


def _move_camera(T: Array, V: Array) -> Array:
    """Return T_c_o after a camera motion exp(V)."""
    inverse, displaced = np.empty(T.shape), np.empty(T.shape)
    se3.exp_se3(np.ascontiguousarray(-V), inverse)
    se3.compose(inverse, np.ascontiguousarray(T), displaced)
    return displaced


def _levenberg_step(e: Array, L: Array, damping: Array, depth: Array) -> Array:
    """Return steps V (6, B), with lengths in depths; zero if there is no finite step."""
    unit = np.ones((6, e.shape[1]))
    unit[:3] = depth
    usable = np.isfinite(e).all(0) & np.isfinite(L).all((0, 1))
    A = np.where(usable, L * unit, 0.0).transpose(2, 0, 1)
    H = np.swapaxes(A, 1, 2) @ A
    size = np.maximum(np.trace(H, axis1=1, axis2=2), 1e-300)
    H += (damping * size)[:, None, None] * np.eye(6)
    g = np.einsum("bki,kb->bi", A, np.where(usable, e, 0.0))
    z = -np.linalg.solve(H, g[..., None])[..., 0]
    z *= np.minimum(1.0, STEP / np.maximum(np.linalg.norm(z, axis=1), 1e-300))[:, None]
    return np.asarray(unit * z.T)
