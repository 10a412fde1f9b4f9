"""Calibration files: the content determines the format for reading, the suffix for writing."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.atomic_files import write_whole
from robsim.base.errors import FileError, InputError, check_known, raise_file_errors
from robsim.base.file_content import read_bytes
from robsim.geometry.pose import Pose
from robsim.vision.camera_files import camera_tables, colmap, kalibr, yaml_text
from robsim.vision.camera_files.camera_tables import (
    C,
    LensCoefficients,
    LensModelError,
    MakeCamera,
    OptionalSize,
)
from robsim.vision.camera_files.xml_text import parse_xml_table

LARGEST_FILE = 1_000_000  # bytes
EXPECTED = "a calibration of OpenCV, ROS, Kalibr or COLMAP"


@dataclass(frozen=True)
class CalibrationOrigin:
    """Calibration file that a camera was read from.

    Attributes
    ----------
    file : str
        Path of the file, as it was given.
    camera : str or None
        Name of the camera in the file, if it was given.
    sha256 : str or None
        SHA-256 of the content of the file, in hexadecimal digits.
    path : str
        Absolute path of the file. It has no effect on equality.
    """

    file: str
    camera: str | None
    sha256: str | None
    path: str = field(default="", compare=False)


def load_camera(
    path: str | os.PathLike[str], name: str | None, make: MakeCamera[C], lens: str | None = None
) -> tuple[C, CalibrationOrigin]:
    """Return the camera of a file with a name, or its only camera; see `Camera.from_file`."""
    data = read_bytes(path, EXPECTED, LARGEST_FILE)
    cameras, _ = _parse_cameras(data, path, _expect_lens(make, lens))
    if name is None and len(cameras) > 1:
        raise FileError(
            f"{path}: {len(cameras)} cameras, {', '.join(cameras)}: choose one by name=, "
            "in a scenario file by camera="
        )
    with raise_file_errors(path):
        if name is not None:
            check_known(name, cameras, "no camera {}", "cameras")
        camera = _require_supported(cameras[next(iter(cameras)) if name is None else name])
    return camera, _make_origin(data, path, name)


def load_rig(
    path: str | os.PathLike[str], make: MakeCamera[C]
) -> dict[str, tuple[C, CalibrationOrigin, Pose]]:
    """Return the cameras of Kalibr's chain, with their poses in axes of the first camera.

    FileError is raised for files of other programs, which do not store the poses of cameras.
    """
    data = read_bytes(path, EXPECTED, LARGEST_FILE)
    cameras, content = _parse_cameras(data, path, make)
    if not kalibr.is_camera_chain(content):
        raise FileError(f"{path}: no poses of cameras, as in Kalibr's camchain.yaml")
    with raise_file_errors(path):
        poses = kalibr.read_chain_poses(content)
        return {
            name: (_require_supported(each), _make_origin(data, path, name), poses[name])
            for name, each in cameras.items()
        }


def _expect_lens(make: MakeCamera[C], expected: str | None) -> MakeCamera[C]:
    """Return the class of cameras with an expected model of the lens, for files without one.

    LensModelError is raised for files with another model.
    """

    def make_expected(*args: Any, **parts: Any) -> C:
        if expected is not None and parts.setdefault("lens", expected) != expected:
            raise LensModelError(f"lens='{expected}', but the file has a {parts['lens']} lens")
        return make(*args, **parts)

    return make_expected


def _make_origin(data: bytes, path: str | os.PathLike[str], name: str | None) -> CalibrationOrigin:
    """Return the origin of a camera in a file with this content."""
    digest = hashlib.sha256(data).hexdigest()
    return CalibrationOrigin(str(path), name, digest, os.path.abspath(path))


def _require_supported(camera: C | InputError) -> C:
    """Return the camera; raise the reason if it is not supported."""
    if isinstance(camera, InputError):
        raise camera
    return camera


def _parse_cameras(
    data: bytes, path: str | os.PathLike[str], make: MakeCamera[C]
) -> tuple[Mapping[str, C | InputError], Any]:
    """Return the cameras of a file by name, and its content as plain tables."""
    source = str(path)
    if data.lstrip().startswith(b"<"):
        content: Any = parse_xml_table(data, source)
    else:
        text = _decode_text(data, source)
        if colmap.is_cameras_txt(text):
            return colmap.read_colmap_cameras(text, source, make), None
        content = yaml_text.parse_yaml_table(text, source)
    with raise_file_errors(path):
        if kalibr.is_camera_chain(content):
            return kalibr.read_chain_cameras(content, make), content
        return camera_tables.read_table_cameras(content, make), content


def _decode_text(data: bytes, source: str) -> str:
    """Return the text of a file that is not XML; raise FileError if it is empty or not UTF-8."""
    if not data.strip():
        raise FileError(f"{source}: empty; expected {EXPECTED}")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError(f"{source}: byte {error.start} is not UTF-8; expected {EXPECTED}") from None


def save_camera(
    path: str | os.PathLike[str], K: Array, size: OptionalSize, lens: LensCoefficients, model: str
) -> Path:
    """Write a camera in the format of the suffix, and return the path; see `Camera.to_file`."""
    ending = Path(path).suffix.lower() if isinstance(path, str | os.PathLike) else ""
    if ending not in ENDINGS:
        raise FileError(f"{path}: expected a name that ends in {', '.join(ENDINGS)}")
    with raise_file_errors(path):
        if K[0, 1]:
            raise InputError(f"a skew of {K[0, 1]:g} px, which calibration files cannot store")
        text = ENDINGS[ending](K, size, lens, model)
    return write_whole(path, text)


def _format_yaml(K: Array, size: OptionalSize, lens: LensCoefficients, model: str) -> str:
    """Return a YAML text for OpenCV, with all keys that ROS requires."""
    scalars = _scalar_entries(size, lens, model)
    lines = ["%YAML 1.0", "---", *(f"{key}: {value}" for key, value in scalars)]
    for key, values in _matrix_entries(K, lens):
        rows, cols = values.shape
        lines += [f"{key}: !!opencv-matrix", f"   rows: {rows}", f"   cols: {cols}", "   dt: d"]
        lines += [f"   data: [ {', '.join(map(repr, values.ravel().tolist()))} ]"]
    return "\n".join(lines) + "\n"


def _format_xml(K: Array, size: OptionalSize, lens: LensCoefficients, model: str) -> str:
    """Return an XML text for OpenCV."""
    lines = ['<?xml version="1.0"?>', "<opencv_storage>"]
    scalars = _scalar_entries(size, lens, model)
    lines += [f"<{key}>{value}</{key}>" for key, value in scalars]
    for key, values in _matrix_entries(K, lens):
        rows, cols = values.shape
        lines += [f'<{key} type_id="opencv-matrix">', f"  <rows>{rows}</rows>"]
        lines += [f"  <cols>{cols}</cols>", "  <dt>d</dt>"]
        lines += [f"  <data>{' '.join(map(repr, values.ravel().tolist()))}</data>", f"</{key}>"]
    return "\n".join([*lines, "</opencv_storage>"]) + "\n"


def _scalar_entries(
    size: OptionalSize, lens: LensCoefficients, model: str
) -> Iterator[tuple[str, object]]:
    """Yield the keys and values that are not matrices."""
    if size is not None:
        yield from zip(("image_width", "image_height"), size, strict=True)
    yield "camera_name", "camera"
    yield "distortion_model", name_ros_model(model, len(lens))
    if model == "fisheye":
        yield "fisheye_model", 1  # as OpenCV's calibration program writes it


def name_ros_model(model: str, count: int) -> str:
    """Return the name in ROS of the model of a lens with some number of coefficients.

    >>> name_ros_model("fisheye", 4)
    'equidistant'
    """
    if model == "fisheye":
        return "equidistant"
    return "rational_polynomial" if count > 5 else "plumb_bob"


def _matrix_entries(K: Array, lens: LensCoefficients) -> Iterator[tuple[str, Array]]:
    """Yield the matrices by key; the rectified camera is this camera without its distortion."""
    yield "camera_matrix", K
    yield "distortion_coefficients", np.array([lens]) if lens else EMPTY_MATRIX
    yield "rectification_matrix", np.eye(3)
    yield "projection_matrix", np.hstack([K, np.zeros((3, 1))])


EMPTY_MATRIX = np.empty((0, 0))
ENDINGS: dict[str, Callable[[Array, OptionalSize, LensCoefficients, str], str]] = {
    ".yaml": _format_yaml,
    ".yml": _format_yaml,
    ".xml": _format_xml,
    ".txt": colmap.format_cameras_txt,
}
