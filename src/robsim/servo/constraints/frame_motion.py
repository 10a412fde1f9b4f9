"""Rows of the motion of a frame by the commanded velocities and by prescribed motions."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FrameError, InputError
from robsim.kernels.control import control_law
from robsim.kernels.formulas.jacobian import BodyMoves
from robsim.kernels.images.projection import relative_pose_stage
from robsim.kernels.machine.block_rows import BlockRows
from robsim.servo.constraints.constraint import ConstraintInputs, ConstraintPlace
from robsim.servo.frame_rows import add_prescribed_velocities


class FrameMotion(NamedTuple):
    """Rows of a frame, in axes of the world or of a camera.

    The twist of the frame is J qdot + drift. In axes of a camera it is the twist of the camera
    relative to the frame.
    """

    T: BlockRows  # (3, 4)
    J: BlockRows  # (6, n)
    drift: BlockRows  # (6,)


def check_frames(who: str, place: ConstraintPlace, frames: list[str]) -> None:
    """Raise InputError unless all frames exist."""
    for frame in frames:
        try:
            place.scene.tree.find(frame)
        except FrameError as error:
            raise InputError(f"{who}: {error}") from None


def is_moved_relative(place: ConstraintPlace, frame: str, other: str = "world") -> bool:
    """Return whether a commanded velocity moves a frame relative to another frame."""
    tree = place.scene.tree
    sign = tree.flag_moves(frame) - tree.flag_moves(other)
    return bool(np.isin(tree.velocity[sign != 0.0], place.columns).any())


def add_motion_in_world(of: ConstraintInputs, frame: str) -> FrameMotion:
    """Add the stages of the motion of a frame in axes of the world; return the rows."""
    tree, placed = of.scene.tree, of.placed
    (T,) = placed.frames([tree.find(frame)])
    sign = tree.flag_moves(frame)
    J = placed.base_jacobian(T, tree.moves(sign, of.columns))
    return FrameMotion(T, J, _add_drift(of, sign, partial(placed.base_jacobian, T)))


def add_motion_in_camera(of: ConstraintInputs, camera: str, frame: str) -> FrameMotion:
    """Add the stages of the motion of a camera relative to a frame; return the rows.

    T is the pose of the frame in the camera. J and the drift are twists in axes of the camera.
    """
    tree, placed = of.scene.tree, of.placed
    T_w_c, T_w_f = placed.frames([tree.find(camera), tree.find(frame)])
    T = of.inputs.program.result(relative_pose_stage, "T", 3, 4, A=T_w_c, B=T_w_f)
    sign = tree.flag_moves(camera) - tree.flag_moves(frame)
    J = placed.frame_jacobian(T_w_c, tree.moves(sign, of.columns))
    return FrameMotion(T, J, _add_drift(of, sign, partial(placed.frame_jacobian, T_w_c)))


def add_camera_drift(of: ConstraintInputs, camera: str, frame: str) -> BlockRows | None:
    """Return the rows of the twist (6,) of a camera relative to a frame by prescribed motions.

    None if no prescribed motion moves one relative to the other.
    """
    tree, placed = of.scene.tree, of.placed
    sign = tree.flag_moves(camera) - tree.flag_moves(frame)
    if not of.scene.prescribed[np.unique(tree.velocity[sign != 0.0])].any():
        return None
    (T_w_c,) = placed.frames([tree.find(camera)])
    return _add_drift(of, sign, partial(placed.frame_jacobian, T_w_c))


def _add_drift(
    of: ConstraintInputs, sign: Array, add_jacobian: Callable[[BodyMoves], BlockRows]
) -> BlockRows:
    """Return the rows of the twist (6,) by the prescribed motions of the scene."""
    program, tree, scene = of.inputs.program, of.scene.tree, of.scene
    moving = np.unique(tree.velocity[sign != 0.0])
    columns = moving[scene.prescribed[moving]]
    if not columns.size:
        return program.constant(np.zeros(6))
    J = add_jacobian(tree.moves(sign, columns))
    rates = add_prescribed_velocities(of.inputs, scene, columns)
    return program.result(control_law.multiply_vector, "out", 6, A=J, x=rates)
