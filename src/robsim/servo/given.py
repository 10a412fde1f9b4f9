"""The rows of a program that a controller is given: the coordinates and the marks as measured."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.kernels import viewing
from robsim.kernels.program import Program
from robsim.robot.placed import Placed
from robsim.servo.sight import Key, Sight


@dataclass(frozen=True)
class View:
    """The rows of a camera and its target, and of the marks in its image."""

    T_w_c: int
    T_w_o: int
    pixels: int  # 2 for each mark
    depth: int


@dataclass
class Given:
    """The rows that a controller is given."""

    program: Program
    dt: int
    seconds: float  # dt, which is the same in all runs
    true: int  # coordinates as they are
    q: int  # and as measured
    views: dict[Key, View]  # of the true scene, with pixels and depths as measured
    placed: Placed | None = None  # the true scene, where it is as measured
    hides: bool = False  # whether marks may be hidden


@dataclass(frozen=True)
class Commanded:
    """The rows that a controller writes."""

    s: int  # k
    error: int  # k
    qd: int  # n, of the commanded velocities
    task_jacobian: int  # k n
    busy: int  # 1 where a run may not end because it has converged or stalls
    decide: Any = None  # from blocks, the decision of this step with all it is based on


def view(
    program: Program, placed: Placed, sight: Sight, pixels: int, depth: int, status: int, more: bool
) -> View:
    """Return the rows of what a camera sees, with the stages that compute them."""
    eye = sight.constants
    T_w_c, T_w_o = placed.frames([(eye.body, eye.hand_eye), (eye.target, eye.offset)])
    marks, camera = program.constant(eye.marks), program.constant(camera_rows(sight))
    program.add(
        viewing.project,
        marks, len(eye.marks), T_w_c, T_w_o, camera, bool(eye.lens.any()), pixels, depth,
        status, more,
    )  # fmt: skip
    return View(T_w_c, T_w_o, pixels, depth)


def camera_rows(sight: Sight) -> NDArray[np.float64]:
    """Return the numbers of a camera in the order of `robsim.kernels.viewing`."""
    eye = sight.constants
    return np.concatenate([eye.K.ravel(), eye.lens, eye.border.ravel(), [eye.valid_radius]])
