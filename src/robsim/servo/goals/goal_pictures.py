"""Pictures of a camera at the goal of a task."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import GoalError
from robsim.base.value import replace_unchecked
from robsim.features.feature import Observation
from robsim.features.images.taken_pictures import TakenPictures
from robsim.geometry.picture_spec import open_picture
from robsim.kernels.formulas import se3
from robsim.servo.camera_target import CameraTarget
from robsim.servo.goals.goal import GoalFeatures, GoalKind, TaughtGoal

BEFORE_START = 2**63  # step of the noise of a picture that is taken before the run


def draw_pictures(sight: CameraTarget, q: Array, T_w_c: Array | None = None) -> NDArray[np.uint8]:
    """Return the pictures (B, h, w) of a camera at coordinates q (nq, B), at rest.

    T_w_c (3, 4, B) replaces the pose of the camera.
    """
    from robsim.world.scene_picture import CameraPictures, NoiseKey  # late: it imports renderers

    runs = np.arange(q.shape[1])
    key = NoiseKey(0, runs.astype(np.uint64), BEFORE_START)
    return CameraPictures(sight.scene, sight.eye).take(q, np.zeros_like(q), key, T_w_c=T_w_c)


def draw_exact_pictures(sight: CameraTarget, q: Array) -> TakenPictures:
    """Return the pictures of a camera at q (nq, B), with grey values that are not rounded."""
    from robsim.world.scene_picture import CameraPictures  # late: it imports renderers

    return TakenPictures(CameraPictures(sight.scene, sight.eye).draw(q), np.arange(q.shape[1]))


def observe_goal_pictures(
    goal: GoalKind, q: Array | None, truth: CameraTarget, belief: CameraTarget, seen: Observation
) -> NDArray[np.uint8]:
    """Return the pictures (B, h, w) of a goal: drawn where it is shown, computed, or a photograph.

    Raises GoalError for a goal of numbers.
    """
    if isinstance(goal, GoalFeatures):
        raise GoalError("a feature of pictures needs a picture at the goal; numbers have none")
    if isinstance(goal, TaughtGoal) and goal.picture is not None:
        return open_picture(goal.picture).grey[None]
    if q is not None:
        return draw_pictures(truth, q)
    assert seen.guess_last is not None
    home = belief.home(seen.guess_last.shape[-1])
    T_w_o = belief.project(home).T_w_o
    T_w_c = compose_with_inverse(T_w_o, seen.guess_last)
    return draw_pictures(belief, home, T_w_c)


def compose_with_inverse(T_w_o: Array, T_c_o: Array) -> Array:
    """Return T_w_c (3, 4, B) = T_w_o T_c_o^-1."""
    back, T_w_c = np.empty_like(T_c_o), np.empty_like(T_c_o)
    se3.inverse_pose(T_c_o.copy(), back)
    se3.compose(np.array(np.broadcast_to(T_w_o, T_c_o.shape)), back, T_w_c)
    return T_w_c


def add_goal_pictures(
    goal: Observation, believed: CameraTarget, pictures: NDArray[np.uint8]
) -> Observation:
    """Return the observation of a goal with pictures; raise GoalError if they do not fit."""
    size = believed.eye.camera.size
    if size is None or pictures.shape[1:] != size[::-1]:
        words = "none" if size is None else f"{size[0]} x {size[1]} pixels"
        raise GoalError(
            f"the picture at the goal has {pictures.shape[2]} x {pictures.shape[1]} pixels, and "
            f"camera '{believed.eye.name}' has the believed size {words}"
        )
    return replace_unchecked(goal, pictures=make_read_only(pictures))
