"""Calibration files as other programs read them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError, InputError, in_file
from robsim.base.output import write_whole
from robsim.vision.camera_files import colmap
from robsim.vision.camera_files.content import Intrinsics


def write(camera: Intrinsics, path: str | os.PathLike[str]) -> Path:
    """Write the file that the ending of its name tells; see `Camera.to_file`."""
    ending = Path(path).suffix.lower() if isinstance(path, str | os.PathLike) else ""
    if ending not in ENDINGS:
        raise FileError(f"{path}: expected a name that ends in {', '.join(ENDINGS)}")
    with in_file(path):
        if camera.K[0, 1]:
            raise InputError(f"a skew of {camera.K[0, 1]:g} px, which other programs leave out")
        text = ENDINGS[ending](camera)
    return write_whole(path, text)


def _yaml(camera: Intrinsics) -> str:
    """Return a text for OpenCV, whose tags ROS does not mind, with all that ROS asks for."""
    lines = ["%YAML 1.0", "---", *(f"{key}: {value}" for key, value in _plain(camera))]
    for key, values in _matrices(camera):
        rows, cols = values.shape
        lines += [f"{key}: !!opencv-matrix", f"   rows: {rows}", f"   cols: {cols}", "   dt: d"]
        lines += [f"   data: [ {', '.join(map(repr, values.ravel().tolist()))} ]"]
    return "\n".join(lines) + "\n"


def _xml(camera: Intrinsics) -> str:
    """Return a text for OpenCV."""
    lines = ['<?xml version="1.0"?>', "<opencv_storage>"]
    lines += [f"<{key}>{value}</{key}>" for key, value in _plain(camera)]
    for key, values in _matrices(camera):
        rows, cols = values.shape
        lines += [f'<{key} type_id="opencv-matrix">', f"  <rows>{rows}</rows>"]
        lines += [f"  <cols>{cols}</cols>", "  <dt>d</dt>"]
        lines += [f"  <data>{' '.join(map(repr, values.ravel().tolist()))}</data>", f"</{key}>"]
    return "\n".join([*lines, "</opencv_storage>"]) + "\n"


def _plain(camera: Intrinsics) -> Iterator[tuple[str, object]]:
    """Yield the keys that are no matrices."""
    if camera.size is not None:
        yield from zip(("image_width", "image_height"), camera.size, strict=True)
    yield "camera_name", "camera"
    yield "distortion_model", "rational_polynomial" if len(camera.distortion) > 5 else "plumb_bob"


def _matrices(camera: Intrinsics) -> Iterator[tuple[str, Array]]:
    """Yield the matrices; those of a rectified image are those of this one without its lens."""
    lens = np.array(camera.distortion)
    yield "camera_matrix", camera.K
    yield "distortion_coefficients", lens.reshape(min(len(lens), 1), -1) if len(lens) else NONE
    yield "rectification_matrix", np.eye(3)
    yield "projection_matrix", np.hstack([camera.K, np.zeros((3, 1))])


NONE = np.empty((0, 0))
ENDINGS: dict[str, Callable[[Intrinsics], str]] = {
    ".yaml": _yaml,
    ".yml": _yaml,
    ".xml": _xml,
    ".txt": colmap.written,
}
