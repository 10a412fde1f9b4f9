"""Parts of a scene with wrong parameters, for the belief of a controller."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import as_floats, as_positive
from robsim.base.errors import InputError, format_value, suggest_names
from robsim.geometry.pose import Pose, PoseLike, check_single_pose
from robsim.robot.dh_row import DHRow
from robsim.robot.joint import Joint
from robsim.robot.link import Link
from robsim.robot.robot import Robot
from robsim.vision.camera import Camera
from robsim.vision.camera_checks import check_lens
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object

DH_ERRORS = ("theta", "d", "a", "alpha")


def is_not_default(value: object, default: float | tuple[float, float]) -> bool:
    """Return whether a value is not its default. A value of a wrong type is rejected later."""
    is_number = isinstance(value, float | int | tuple) and not isinstance(value, bool)
    return not is_number or value != default


def perturb_camera(
    eye: MountedCamera,
    focal: ArrayLike,
    center: ArrayLike,
    distortion: ArrayLike | None,
    lens: str | None,
    hand_eye: PoseLike | None,
) -> MountedCamera:
    """Return a camera with wrong intrinsics and a wrong mount, see `Scene.believe`."""
    K, factor = np.array(eye.camera.K), as_floats(focal, "focal (a factor)", ())
    if factor.shape not in ((), (2,)) or not (factor > 0).all():
        raise InputError(f"focal: expected one factor above 0, or two, got {format_value(focal)}")
    with np.errstate(over="ignore"):  # Camera rejects numbers that are not finite
        K[[0, 1], [0, 1]] *= factor
    shift = as_floats(center, "center (pixels)", (2,))
    if shift.ndim != 1:
        raise InputError(f"center (pixels): expected (column, row), got {format_value(center)}")
    K[:2, 2] += shift
    true = eye.camera
    model = true.lens if lens is None else check_lens(lens).name
    if distortion is None and model != true.lens and any(true.distortion):
        raise InputError(
            f"lens: the coefficients of a {true.lens} lens are not those of another model: give "
            "distortion=, too"
        )
    given: Any = true.distortion if distortion is None else distortion
    believed = Camera(K, true.size, body=true.body, distortion=given, lens=model)
    return replace(eye, camera=believed, pose=_apply_pose_error(eye.pose, hand_eye, "hand_eye"))


def perturb_robot(
    robot: Robot,
    dh: Mapping[str, Mapping[str, float]] | None,
    convention: str,
    base: PoseLike | None,
) -> Robot:
    """Return a robot with wrong link parameters and a wrong base, see `Scene.believe`."""
    dh = {} if dh is None else dh
    if not isinstance(dh, Mapping):
        raise InputError(f"dh: expected {{link: {{'a': metres, ...}}}}, got {format_value(dh)}")
    names = [link.name for link in robot.links]
    for name in dh:
        if name not in names:
            raise InputError(
                f"dh: no link {name!r} in '{robot.name}'; {suggest_names(name, names, 'links')}"
            )
    links = [
        replace(link, joint=_perturb_joint(link, dh[link.name], convention))
        if link.name in dh
        else link
        for link in robot.links
    ]
    return replace(robot, links=tuple(links), base=_apply_pose_error(robot.base, base, "base"))


def _perturb_joint(link: Link, errors: Any, convention: str) -> Joint:
    """Return a joint with errors Rz(theta) Tz(d) along its axis and Tx(a) Rx(alpha) across it.

    Both pairs commute, so the error of each parameter is a separate factor.
    """
    if not isinstance(errors, Mapping) or not set(errors) <= set(DH_ERRORS):
        raise InputError(
            f"dh of '{link.name}': expected errors of {', '.join(DH_ERRORS)}, "
            f"got {format_value(errors)}"
        )
    theta, d, a, alpha = (
        _check_dh_error(errors.get(name, 0.0), f"{link.name}.{name}") for name in DH_ERRORS
    )
    joint = link.joint
    if joint.dh is not None and joint.dh.convention == convention:
        row = joint.dh
        return joint.with_constants(
            dh=DHRow(row.theta + theta, row.d + d, row.a + a, row.alpha + alpha, convention)
        )
    along, across = Pose.at(0, 0, d, rpy=(0, 0, theta)), Pose.at(a, 0, 0, rpy=(alpha, 0, 0))
    if convention == "standard":
        return joint.with_constants(joint.place, along @ joint.tail @ across)
    return joint.with_constants(across @ joint.place, along @ joint.tail)


def perturb_target(
    thing: Object, size: float, marks: ArrayLike | None, place: PoseLike | None
) -> Object:
    """Return an object with wrong marks and a wrong pose, see `Scene.believe`."""
    believed = thing.marks if marks is None else as_floats(marks, "marks (metres)", ("N", 3))
    if believed.shape != thing.marks.shape:
        raise InputError(
            f"marks of '{thing.name}': expected shape {thing.marks.shape}, got {believed.shape}"
        )
    with np.errstate(over="ignore"):  # Object rejects numbers that are not finite
        factor = as_positive(size, "size (a factor)")
        believed = believed if factor == 1 else factor * believed
    changes = {} if believed is thing.marks else {"marks": believed}
    return thing.revised(**changes, pose=_apply_pose_error(thing.pose, place, "place"))


def _apply_pose_error(pose: Pose, error: PoseLike | None, what: str) -> Pose:
    """Return a pose with an error, pose @ error, or the pose if there is no error."""
    return pose if error is None else pose @ check_single_pose(error, f"{what} (an error)")


def _check_dh_error(value: Any, what: str) -> float:
    """Return a checked error of a Denavit-Hartenberg parameter."""
    number = as_floats(value, f"dh of {what}", ())
    if number.ndim:
        raise InputError(f"dh of {what}: expected a number, got {format_value(value)}")
    return float(number)
