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
from robsim.vision.camera_files.tables import Lens, Size


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
