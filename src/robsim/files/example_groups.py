"""The shipped scenarios in groups, in the order of a gallery."""

from __future__ import annotations

GROUPS: dict[str, tuple[str, ...]] = {
    "Begin here": (
        *("visp_tutorial", "chapter_6_1", "eye_in_hand", "local_minimum", "unicycle_docking"),
    ),
    "Schemes compared": (
        *("schemes_compared", "camera_retreat", "retreat_cures", "looking_ahead"),
        *("pbvs_straight", "straight_image_lines"),
    ),
    "Failures and their reasons": (
        *("pbvs_loses_target", "tilted_square", "desired_through_the_target", "camera_law_stalls"),
    ),
    "Wrong depths and calibration": (
        *("depth_scale", "uneven_depth", "wrong_calibration", "wrong_dh"),
        *("calibration_errors", "calibration_bench"),
    ),
    "Gains and delays": (
        *("latency_and_gain", "slow_camera", "joint_lag", "smooth_start", "adaptive_gain"),
    ),
    "Feature points and cameras": (
        *("noise_floor", "marks_that_lie", "marks_come_and_go", "detected_dots"),
        *("disc_centers", "photometric", "watching_head", "pan_tilt_tracking"),
    ),
    "Robot arms": (
        *("eye_to_hand", "chapter_6_2", "stereo_in_hand", "second_robot", "joint_limits"),
    ),
    "Constraints": (
        *("base_in_view", "seven_joints", "limits_by_constraints", "line_of_sight"),
        "view_without_depth",
    ),
    "Bodies with weight": (
        *("velocity_loop", "joint_friction", "unknown_payload", "torque_planar", "torque_in_hand"),
    ),
    "Mobile robots": ("differential_drive", "holonomic", "car", "mobile_arm"),
    "Missions": ("inspection_a", "inspection_b"),
}


def find_group(name: str) -> str:
    """Return the group of a shipped scenario; "" if it is in none.

    >>> find_group("car")
    'Mobile robots'
    """
    return next((group for group, names in GROUPS.items() if name in names), "")
