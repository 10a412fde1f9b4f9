"""A scene as somebody believes it who is wrong about it, each mistake by its name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from robsim.base.arrays import numbers, positive
from robsim.base.errors import InputError, suggest
from robsim.geometry.pose import Pose, one_pose
from robsim.robot.joint import Joint
from robsim.robot.link import Link
from robsim.robot.robot import Robot
from robsim.vision.camera import Camera
from robsim.world.scene import MountedCamera, Object, Scene

ROW = ("theta", "d", "a", "alpha")


def believe(
    scene: Scene,
    *,
    camera: str | None = None,
    focal: Any = 1.0,
    center: Any = (0.0, 0.0),
    distortion: Any = None,
    hand_eye: Any = None,
    robot: str | None = None,
    dh: Mapping[str, Mapping[str, float]] | None = None,
    convention: Literal["standard", "modified"] = "standard",
    base: Any = None,
    target: str | None = None,
    size: float = 1.0,
    marks: Any = None,
    place: Any = None,
) -> Scene:
    """The scene with mistakes, for a task's `belief`; what is not named is right.

    camera      which camera; None: the only one
    focal       factor of the focal lengths (one, or one for columns and one for rows)
    center      error of the principal point, (column, row) in pixels
    distortion  the coefficients that are believed instead
    hand_eye    error of the mount, a pose: T_mount_camera as believed is the true one @ hand_eye
    robot       which robot; None: the only one
    dh          {link: {"theta": rad, "d": m, "a": m, "alpha": rad}}: errors that are added to the
                rows of a Denavit-Hartenberg table of this `convention`
    base        error of where the robot stands, a pose: the true one @ base
    target      which object; None: the only one with marks
    size        factor of the marks of the target
    marks       (N, 3) marks of the target that are believed instead, in its axes
    place       error of where the target stands, a pose: the true one @ place

    InputError: what there is not, or what is no pose or number.

    >>> eye = MountedCamera("eye", Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]))
    >>> believe(Scene(cameras=eye), focal=1.5).camera().camera.K[0]
    array([1200.,    0.,  320.])
    """
    if not isinstance(scene, Scene):
        raise InputError(f"scene: expected a Scene, got {scene!r:.80}")
    if convention not in ("standard", "modified"):
        raise InputError(f"convention must be 'standard' or 'modified', got {convention!r:.80}")
    wrong: list[Robot | Object | MountedCamera] = []
    lens = _differs(focal, 1.0) or _differs(center, (0.0, 0.0)) or distortion is not None
    if camera is not None or lens or hand_eye is not None:
        wrong.append(_camera(scene.camera(camera), focal, center, distortion, hand_eye))
    if robot is not None or dh is not None or base is not None:
        wrong.append(_robot(scene.robot(robot), {} if dh is None else dh, convention, base))
    if target is not None or marks is not None or place is not None or _differs(size, 1.0):
        wrong.append(_target(scene.object(target), size, marks, place))
    return scene.replacing(*wrong)


def _differs(value: Any, right: float | tuple[float, float]) -> bool:
    """Whether it is not what is believed by default, or no number at all, which is told later."""
    return isinstance(value, bool) or not isinstance(value, float | int | tuple) or value != right


def _camera(
    eye: MountedCamera, focal: Any, center: Any, distortion: Any, hand_eye: Any
) -> MountedCamera:
    K, factor = np.array(eye.camera.K), numbers(focal, "focal (a factor)", ())
    if factor.shape not in ((), (2,)) or not (factor > 0).all():
        raise InputError(f"focal: expected one factor above 0, or two, got {focal!r:.80}")
    with np.errstate(over="ignore"):  # the camera refuses what is not finite
        K[[0, 1], [0, 1]] *= factor
    shift = numbers(center, "center (pixels)", (2,))
    if shift.ndim != 1:
        raise InputError(f"center (pixels): expected (column, row), got {center!r:.80}")
    K[:2, 2] += shift
    lens = eye.camera.distortion if distortion is None else distortion
    believed = Camera(K, eye.camera.size, body=eye.camera.body, distortion=lens)
    return replace(eye, camera=believed, pose=_moved(eye.pose, hand_eye, "hand_eye"))


def _robot(robot: Robot, dh: Any, convention: str, base: Any) -> Robot:
    if not isinstance(dh, Mapping):
        raise InputError(f"dh: expected {{link: {{'a': metres, ...}}}}, got {dh!r:.80}")
    names = [link.name for link in robot.links]
    for name in dh:
        if name not in names:
            raise InputError(
                f"dh: no link {name!r} in '{robot.name}'; {suggest(name, names, 'links')}"
            )
    links = [
        replace(link, joint=_wrong(link, dh[link.name], convention)) if link.name in dh else link
        for link in robot.links
    ]
    return replace(robot, links=tuple(links), base=_moved(robot.base, base, "base"))


def _wrong(link: Link, errors: Any, convention: str) -> Joint:
    """Small errors of a row: Rz(theta) Tz(d) along the joint's axis, Tx(a) Rx(alpha) across it.

    Both pairs commute, so an error of one number is a factor of its own.
    """
    if not isinstance(errors, Mapping) or not set(errors) <= set(ROW):
        raise InputError(
            f"dh of '{link.name}': expected errors of {', '.join(ROW)}, got {errors!r:.80}"
        )
    theta, d, a, alpha = (_number(errors.get(name, 0.0), f"{link.name}.{name}") for name in ROW)
    joint = link.joint
    along, across = Pose.at(0, 0, d, rpy=(0, 0, theta)), Pose.at(a, 0, 0, rpy=(alpha, 0, 0))
    if convention == "standard":
        return replace(joint, tail=along @ joint.tail @ across)
    return replace(joint, place=across @ joint.place, tail=along @ joint.tail)


def _target(thing: Object, size: Any, marks: Any, place: Any) -> Object:
    believed = thing.marks if marks is None else numbers(marks, "marks (metres)", ("N", 3))
    if believed.shape != thing.marks.shape:
        raise InputError(
            f"marks of '{thing.name}': expected shape {thing.marks.shape}, got {believed.shape}"
        )
    with np.errstate(over="ignore"):  # the object refuses what is not finite
        believed = positive(size, "size (a factor)") * believed
    return replace(thing, marks=believed, pose=_moved(thing.pose, place, "place"))


def _moved(pose: Pose, error: Any, what: str) -> Pose:
    return pose if error is None else pose @ one_pose(error, f"{what} (an error)")


def _number(value: Any, what: str) -> float:
    number = numbers(value, f"dh of {what}", ())
    if number.ndim:
        raise InputError(f"dh of {what}: expected a number, got {value!r:.80}")
    return float(number)
