"""Calibration files, whose content tells the format; of a new one the ending of its name does."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError, InputError, check_known, in_file
from robsim.base.input import read_bytes
from robsim.base.output import write_whole
from robsim.geometry.pose import Pose
from robsim.vision.camera_files import colmap, kalibr, tables, xml_text, yaml_text
from robsim.vision.camera_files.tables import Lens, Make, Size

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


def write(path: str | os.PathLike[str], K: Array, size: Size, lens: Lens) -> Path:
    """Write the file that the ending of its name tells; see `Camera.to_file`."""
    ending = Path(path).suffix.lower() if isinstance(path, str | os.PathLike) else ""
    if ending not in ENDINGS:
        raise FileError(f"{path}: expected a name that ends in {', '.join(ENDINGS)}")
    with in_file(path):
        if K[0, 1]:
            raise InputError(f"a skew of {K[0, 1]:g} px, which other programs leave out")
        text = ENDINGS[ending](K, size, lens)
    return write_whole(path, text)


def _yaml(K: Array, size: Size, lens: Lens) -> str:
    """Return a text for OpenCV, whose tags ROS does not mind, with all that ROS asks for."""
    lines = ["%YAML 1.0", "---", *(f"{key}: {value}" for key, value in _plain(size, lens))]
    for key, values in _matrices(K, lens):
        rows, cols = values.shape
        lines += [f"{key}: !!opencv-matrix", f"   rows: {rows}", f"   cols: {cols}", "   dt: d"]
        lines += [f"   data: [ {', '.join(map(repr, values.ravel().tolist()))} ]"]
    return "\n".join(lines) + "\n"


def _xml(K: Array, size: Size, lens: Lens) -> str:
    """Return a text for OpenCV."""
    lines = ['<?xml version="1.0"?>', "<opencv_storage>"]
    lines += [f"<{key}>{value}</{key}>" for key, value in _plain(size, lens)]
    for key, values in _matrices(K, lens):
        rows, cols = values.shape
        lines += [f'<{key} type_id="opencv-matrix">', f"  <rows>{rows}</rows>"]
        lines += [f"  <cols>{cols}</cols>", "  <dt>d</dt>"]
        lines += [f"  <data>{' '.join(map(repr, values.ravel().tolist()))}</data>", f"</{key}>"]
    return "\n".join([*lines, "</opencv_storage>"]) + "\n"


def _plain(size: Size, lens: Lens) -> Iterator[tuple[str, object]]:
    """Yield the keys that are no matrices."""
    if size is not None:
        yield from zip(("image_width", "image_height"), size, strict=True)
    yield "camera_name", "camera"
    yield "distortion_model", "rational_polynomial" if len(lens) > 5 else "plumb_bob"


def _matrices(K: Array, lens: Lens) -> Iterator[tuple[str, Array]]:
    """Yield the matrices; those of a rectified image are those of this one without its lens."""
    yield "camera_matrix", K
    yield "distortion_coefficients", np.array([lens]) if lens else NONE
    yield "rectification_matrix", np.eye(3)
    yield "projection_matrix", np.hstack([K, np.zeros((3, 1))])


NONE = np.empty((0, 0))
ENDINGS: dict[str, Callable[[Array, Size, Lens], str]] = {
    ".yaml": _yaml,
    ".yml": _yaml,
    ".xml": _xml,
    ".txt": colmap.written,
}
