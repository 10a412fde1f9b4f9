"""Rotation matrices, random quaternions, and the check of rigid transforms."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array
from robsim.base.errors import InputError

ROTATION_TOLERANCE = 1e-6


def axis_rotation(axis: str, angle: ArrayLike) -> Array:
    """Return the rotation matrices (..., 3, 3) by angles (...) in rad about the x, y or z axis."""
    c, s, i = np.cos(angle), np.sin(angle), "xyz".index(axis)
    u, w = (i + 1) % 3, (i + 2) % 3
    R = np.zeros((*np.shape(angle), 3, 3))
    R[..., i, i], R[..., u, u], R[..., w, w] = 1.0, c, c
    R[..., u, w], R[..., w, u] = 0.0 - s, s
    return R


def rotation_to_rpy(R: Array) -> tuple[float, float, float]:
    """Return roll, pitch and yaw, in radians, of R = Rz(y) Ry(p) Rx(r), accurate to rounding.

    Yaw follows from the first column, and pitch and roll from Rz(-y) R = Ry(p) Rx(r). Near
    p = +-90 degrees, where yaw is arbitrary, this roll still belongs to the computed yaw.

    >>> rotation_to_rpy(axis_rotation("y", np.pi / 2))[1] == np.pi / 2
    True
    """
    y = math.atan2(R[1, 0], R[0, 0])
    c, s = math.cos(y), math.sin(y)
    p = math.atan2(-R[2, 0], c * R[0, 0] + s * R[1, 0])
    r = math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return r + 0.0, p + 0.0, y + 0.0


def random_quaternions(share: Array) -> Array:
    """Return quaternions (B, 4) = (x, y, z, w) of uniform rotations from uniform numbers (B, 3).

    Source: Shoemake 1992, "Uniform random rotations", Graphics Gems III.

    >>> random_quaternions(np.array([[0.5, 0.25, 0.0]])).round(3) + 0.0
    array([[0.707, 0.   , 0.   , 0.707]])
    """
    inner, outer = np.sqrt(1.0 - share[:, 0]), np.sqrt(share[:, 0])
    a, b = 2.0 * np.pi * share[:, 1:].T
    return np.stack([inner * np.sin(a), inner * np.cos(a), outer * np.sin(b), outer * np.cos(b)], 1)


def check_rigid(T: Array) -> None:
    """Raise InputError unless the matrices T (..., 4, 4) are rigid transforms."""
    is_single = T.ndim == 2  # floats of Python take a tenth of the time of small arrays
    rows: Any = T.tolist() if is_single else np.moveaxis(T, (-2, -1), (0, 1))
    largest: Callable[[Iterable[Any]], float] = max if is_single else _max_without_warnings
    x, y, z = zip(*(row[:3] for row in rows[:3]), strict=True)
    pairs = (x, x, 1.0), (y, y, 1.0), (z, z, 1.0), (x, y, 0.0), (y, z, 0.0), (z, x, 0.0)
    deviation = largest(abs(_dot_product_3d(a, b) - expected) for a, b, expected in pairs)
    if not deviation <= ROTATION_TOLERANCE:
        raise InputError(
            f"not a rotation: R'R differs from the identity by {deviation:.2g} "
            f"(allowed {ROTATION_TOLERANCE:g})"
        )
    normal = [y[i - 2] * z[i - 1] - y[i - 1] * z[i - 2] for i in range(3)]
    if largest([-_dot_product_3d(x, normal)]) > 0:
        raise InputError("not a rotation but a reflection: det R = -1")
    if largest(abs(n - w) for n, w in zip(rows[3], (0.0, 0.0, 0.0, 1.0), strict=True)) > 0:
        raise InputError("the last row of a pose must be 0 0 0 1")


def _dot_product_3d(a: Sequence[Any], b: Sequence[Any]) -> Any:
    """Return the dot product of two vectors of three numbers or arrays."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _max_without_warnings(values: Iterable[Any]) -> float:
    """Return the largest entry of all arrays and 0; overflow gives no warning."""
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.max(list(values), initial=0.0))
