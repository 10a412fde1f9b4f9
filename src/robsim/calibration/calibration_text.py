"""The result of a calibration as tables and as TOML, in forms that other programs take."""

from __future__ import annotations

from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.calibration.calibration_fit import CalibrationFit
from robsim.files.toml import SCHEMA
from robsim.files.toml_layout import format_toml
from robsim.geometry.pose import Pose
from robsim.geometry.rotation import rotation_to_rpy

HEAD = ("number", "value", "", "", "", "unit", "std", "", "")
DIGITS = 10  # significant digits of numbers in TOML
FACTORS = {"m": (1e3, "mm"), "rad": (180 / np.pi, "deg"), "px": (1.0, "px"), "1": (1.0, "")}


def list_table_rows(fit: CalibrationFit) -> list[tuple[str, ...]]:
    """Return the rows of a table of all numbers, with deviations in the axes of the values."""
    parts = fit.free.parts
    rows: list[tuple[str, ...]] = [HEAD]
    for part, pose in (("mount", fit.mount), ("target", fit.place)):
        C = fit.covariance[parts[part], parts[part]]
        rows += [(f"{part} {name}", *rest) for name, *rest in _pose_rows(pose, C)]
    deviations = list(fit.deviations.items())[12:]
    each = zip(deviations, fit.free.units[12:], fit.model.numbers(fit.free), strict=True)
    for (name, std), unit, value in each:
        factor, shown = FACTORS[unit]
        rows.append(_row(name, np.array([factor * value]), shown, np.array([factor * std])))
    return rows


def _pose_rows(pose: Pose, C: Array) -> list[tuple[str, ...]]:
    """Return a pose as position, rpy, quaternion and rotation vector.

    C (6, 6) is the covariance of the twist (v, omega) from the pose to the truth, in its own axes.
    """
    R = pose.rotation
    position = np.sqrt(np.diag(R @ C[:3, :3] @ R.T))
    angles = np.array(rotation_to_rpy(R))
    rates = rpy_rates(angles)
    rpy = np.sqrt(np.diag(rates @ C[3:, 3:] @ rates.T))
    return [
        _row("position", 1e3 * pose.position, "mm", 1e3 * position),
        _row("rpy", np.degrees(angles), "deg", np.degrees(rpy)),
        _row("quaternion (x, y, z, w)", pose.quaternion, "", np.array([])),
        _row("rotation vector", np.degrees(pose.rotvec), "deg", np.array([])),
    ]


def _row(name: str, values: Array, unit: str, stds: Array) -> tuple[str, ...]:
    """Return a row of four values, their unit, and three standard deviations."""
    texts = [f"{value:z.6g}" for value in values.tolist()]
    deviations = [f"{std:.2g}" for std in stds.tolist()]
    pad = [""] * 4
    return (name, *(texts + pad)[:4], unit, *(deviations + pad)[:3])


def rpy_rates(rpy: Array) -> Array:
    """Return the derivatives (3, 3) of roll, pitch and yaw by a rotation vector in body axes.

    Source: the inverse of the matrix of Diebel 2006, "Representing attitude", eq. 76. At a pitch of
    +-90 degrees, where roll and yaw are not determined, the derivatives are infinite.

    >>> rpy_rates(np.zeros(3))
    array([[ 1.,  0.,  0.],
           [ 0.,  1., -0.],
           [ 0.,  0.,  1.]])
    """
    (sr, sp, _), (cr, cp, _) = np.sin(rpy), np.cos(rpy)
    with np.errstate(divide="ignore"):
        over = np.divide(1.0, cp if abs(cp) > 1e-9 else 0.0)
    return np.array(
        [[1.0, sr * sp * over, cr * sp * over], [0.0, cr, -sr], [0.0, sr * over, cr * over]]
    )


def format_camera(fit: CalibrationFit) -> str:
    """Return the table `[[cameras]]` of a scenario file with the calibrated camera."""
    camera = fit.camera
    (fx, skew, cx), (_, fy, cy), _ = camera.K.tolist()
    table: dict[str, Any] = {"name": fit.views.camera, "on": fit.views.eye.on}
    table["position"] = f"{_join_numbers(1e3 * fit.mount.position)} mm"
    table["rpy"] = f"{_join_numbers(np.degrees(rotation_to_rpy(fit.mount.rotation)))} deg"
    if camera.size is not None:
        table["size"] = list(camera.size)
    table["focal"], table["center"] = _round_numbers([fx, fy]), _round_numbers([cx, cy])
    if skew:
        table["skew"] = _round_numbers([skew])[0]
    if camera.lens == "fisheye":
        table["lens"] = camera.lens
    if camera.distortion:
        table["distortion"] = _round_numbers(camera.distortion)
    return format_toml({"cameras": [table]}).removeprefix(f"schema = {SCHEMA}\n").strip() + "\n"


def _round_numbers(values: Any) -> list[float]:
    """Return numbers with ten significant digits."""
    return [float(f"{value:z.{DIGITS}g}") for value in values]


def _join_numbers(values: Array) -> str:
    """Return numbers with ten significant digits, separated by commas."""
    return ", ".join(f"{value:z.{DIGITS}g}" for value in values)
