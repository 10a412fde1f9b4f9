"""Cameras in Kalibr's camera chain, camchain.yaml."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeGuard

from robsim.base.arrays import as_floats
from robsim.base.errors import InputError, format_value, prefix_errors
from robsim.geometry.pose import IDENTITY, Pose
from robsim.vision.camera_files.camera_tables import C, LensModelError, MakeCamera, read_lens_model

KEYS = "camera_model", "intrinsics", "distortion_model", "distortion_coeffs", "resolution"


def is_camera_chain(table: object) -> TypeGuard[Mapping[str, Mapping[str, Any]]]:
    """Return whether a table is a camera chain: whether it has the camera cam0."""
    return isinstance(table, Mapping) and isinstance(table.get("cam0"), Mapping)


def read_chain_cameras(
    chain: Mapping[str, Mapping[str, Any]], make: MakeCamera[C]
) -> dict[str, C | LensModelError]:
    """Return the cameras of a chain by name, or the reason why a camera is not supported."""
    cameras: dict[str, C | LensModelError] = {}
    for name in _chain_names(chain):
        try:
            cameras[name] = _build_chain_camera(name, chain[name], make)
        except LensModelError as reason:
            cameras[name] = reason
    return cameras


def read_chain_poses(chain: Mapping[str, Mapping[str, Any]]) -> dict[str, Pose]:
    """Return the pose of each camera in axes of cam0.

    Kalibr's T_cn_cnm1 transforms points from the previous camera to this camera, so it is the
    inverse of the pose of this camera in axes of the previous camera.
    """
    poses: dict[str, Pose] = {}
    T = IDENTITY
    for name in _chain_names(chain):
        if poses:
            T = T @ _read_relative_pose(name, chain[name])
        poses[name] = T
    return poses


def _chain_names(chain: Mapping[str, Any]) -> list[str]:
    """Return the consecutive names cam0, cam1, ... of the chain."""
    names = [f"cam{i}" for i in range(len(chain))]
    return [name for name in names if name in chain]


def _build_chain_camera(name: str, table: object, make: MakeCamera[C]) -> C:
    """Return the camera of an entry of the chain."""
    if not isinstance(table, Mapping):
        raise InputError(f"{name}: expected {', '.join(KEYS)}, got {format_value(table)}")
    with prefix_errors(name):
        if missing := [key for key in KEYS if key not in table]:
            raise InputError(f"{missing[0]} is missing")
        model = read_lens_model(table)
        fx, fy, cx, cy = as_floats(table["intrinsics"], "intrinsics", (4,))
        lens = as_floats(table["distortion_coeffs"], "distortion_coeffs", ())
        K = [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]
        return make(K, table["resolution"], distortion=lens, **model)


def _read_relative_pose(name: str, table: Mapping[str, Any]) -> Pose:
    """Return the pose of a camera in axes of the previous camera."""
    with prefix_errors(f"{name}: T_cn_cnm1"):
        if "T_cn_cnm1" not in table:
            raise InputError("is missing: the transform from the previous camera")
        return Pose(as_floats(table["T_cn_cnm1"], "T", (4, 4))).inv()
