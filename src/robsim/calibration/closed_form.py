"""The first estimate of a calibration in closed form, from the pose of the target in each view."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.errors import InputError, format_value, is_known_name, prefix_errors, suggest_names
from robsim.calibration.calibration_model import CalibrationModel
from robsim.calibration.calibration_views import CalibrationViews
from robsim.calibration.hand_eye import METHODS, solve_hand_eye
from robsim.calibration.relative_motions import build_pose, mean_pose
from robsim.calibration.robot_world import solve_robot_world, solve_scaled_positions
from robsim.geometry.pose import Pose
from robsim.vision.camera import Camera
from robsim.vision.pose_estimation import estimate_pose

SHAH = "shah"


def check_start(start: str) -> str:
    """Return the name of a closed-form method; raise InputError if it is unknown."""
    known = [SHAH, *METHODS]
    if not is_known_name(start, known):
        raise InputError(
            f"start: no method {format_value(start)}; {suggest_names(start, known, 'methods')}"
        )
    return start


class TargetPoses(NamedTuple):
    """The poses of the target in each view by itself."""

    T_c_o: Pose  # (V, 4, 4)
    certain: NDArray[np.bool_]  # (V,), whether the pose is unambiguous

    def select(self, views: slice | NDArray[np.int64]) -> TargetPoses:
        """Return the poses in some views."""
        return TargetPoses(self.T_c_o[views], self.certain[views])


def estimate_first_model(
    views: CalibrationViews,
    start: str = SHAH,
    *,
    scaled: bool = False,
    poses: TargetPoses | None = None,
) -> CalibrationModel:
    """Return the first estimate of mount and place, and of the scale of the target if `scaled`.

    Ambiguous poses are not used if at least three others remain. Default of `poses`: estimated.
    """
    B, certain = estimate_target_poses(views, views.lens) if poses is None else poses
    A = Pose(views.poses())
    used = certain if certain.sum() >= 3 else np.ones_like(certain)
    scale = 1.0
    if start == SHAH:
        X, Z = solve_robot_world(A[used], B[used])
    else:
        X = solve_hand_eye(A[used], B[used], start)
        Z = mean_pose(A[used].inv() @ X @ B[used])
    if scaled:
        t_X, t_Z, scale = solve_scaled_positions(X.rotation, A[used], B[used])
        if scale <= 0.0:
            raise InputError("views: no positive scale of the target fits them")
        X, Z = build_pose(X.rotation, t_X), build_pose(Z.rotation, t_Z)
    return CalibrationModel(X, Z, views.lens, np.zeros(views.scene.nq), scale)


def estimate_target_poses(
    views: CalibrationViews, camera: Camera, scale: float = 1.0
) -> TargetPoses:
    """Return the poses of the target in each view by itself.

    The marks are `scale` times as large as in the scene. InputError is raised for a view without a
    pose.
    """
    T, certain = np.empty((len(views), 4, 4)), np.zeros(len(views), dtype=bool)
    patterns, group = np.unique(views.seen, axis=0, return_inverse=True)
    for number, seen in enumerate(patterns):
        group_views = np.flatnonzero(group.reshape(-1) == number)
        with prefix_errors(f"pixels: marks seen in view {group_views[0]}"):
            estimate = estimate_pose(
                scale * views.thing.marks[seen], views.pixels[group_views][:, seen], camera
            )
        T[group_views], certain[group_views] = estimate.T_c_o, ~estimate.ambiguous
    lost = np.flatnonzero(~np.isfinite(T).all((1, 2)))
    if lost.size:
        raise InputError(f"pixels: view {lost[0]} shows no pose of the target: leave it out")
    return TargetPoses(Pose(T), certain)
