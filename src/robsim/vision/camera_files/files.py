"""The cameras of a calibration file, whose content tells the format."""

from __future__ import annotations

import os
from typing import Any

from robsim.base.errors import FileError, check_known, in_file
from robsim.base.input import read_bytes
from robsim.geometry.pose import Pose
from robsim.vision.camera_files import colmap, kalibr, tables, xml_text, yaml_text
from robsim.vision.camera_files.tables import Make

LARGEST_FILE = 1_000_000  # bytes
EXPECTED = "a calibration of OpenCV, ROS, Kalibr or COLMAP"


def camera_of(path: str | os.PathLike[str], name: str | None, make: Make) -> Any:
    """Return the camera of a file, or the one of a name; see `Camera.from_file`."""
    cameras, _ = _read(path, make)
    if name is None and len(cameras) == 1:
        return next(iter(cameras.values()))
    if name is None:
        raise FileError(f"{path}: {len(cameras)} cameras, {', '.join(cameras)}: say which, name=")
    with in_file(path):
        check_known(name, cameras, "no camera {}", "cameras")
        return cameras[name]


def rig_of(path: str | os.PathLike[str], make: Make) -> dict[str, tuple[Any, Pose]]:
    """Return the cameras of Kalibr's chain with their poses in the axes of the first.

    FileError: a file of another program, which does not tell such poses.
    """
    cameras, content = _read(path, make)
    if not kalibr.is_chain(content):
        raise FileError(f"{path}: no poses of cameras, as in Kalibr's camchain.yaml")
    with in_file(path):
        poses = kalibr.poses_of(content)
    return {name: (camera, poses[name]) for name, camera in cameras.items()}


def _read(path: str | os.PathLike[str], make: Make) -> tuple[dict[str, Any], Any]:
    """Return the cameras of a file by name, and its content as plain tables."""
    data, source = read_bytes(path, EXPECTED, LARGEST_FILE), str(path)
    if data.lstrip().startswith(b"<"):
        content: Any = xml_text.tables_of(data, source)
    else:
        text = _text(data, source)
        if colmap.is_list(text):
            return colmap.cameras_of(text, source, make), None
        content = yaml_text.tables_of(text, source)
    with in_file(path):
        program = kalibr if kalibr.is_chain(content) else tables
        return program.cameras_of(content, make), content


def _text(data: bytes, source: str) -> str:
    """Return the text of a file that is no XML; FileError: empty, or not UTF-8."""
    if not data.strip():
        raise FileError(f"{source}: empty; expected {EXPECTED}")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError(f"{source}: byte {error.start} is not UTF-8; expected {EXPECTED}") from None
