"""The lens of a camera in a text: numbers, or the calibration file that contains them.

A scenario file refers to a calibration file, `calibration = "ost.yaml"`. The text that a run stores
contains the numbers as well, with the SHA-256 of the content of the file. The run can therefore be
repeated without the file.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.errors import FileError, InputError
from robsim.base.file_content import format_relative_path
from robsim.declare import ListOf, Number, OneOf, Table, Text, Word, described
from robsim.declare.context import Context
from robsim.declare.fields import is_identical
from robsim.declare.problems import prefix_path
from robsim.vision.camera import Camera
from robsim.vision.camera_files.calibration_files import CalibrationOrigin, load_camera
from robsim.vision.image_size import SIZE
from robsim.vision.intrinsics import MATRIX, build_intrinsics, image_center, split_intrinsics
from robsim.vision.lens_models import LENS_MODELS

COEFFICIENTS = ListOf(Number(), most=14)
LENS = Word(tuple(LENS_MODELS), "model")
PERSPECTIVE = "perspective"  # the model of a lens in files without one


@dataclass(frozen=True)
class CalibrationPath(Text):
    """The declaration of the path of a calibration file."""

    least: int = 1
    phrase: ClassVar[str] = "the path of a calibration file"


@described
@dataclass(frozen=True)
class CalibrationFile:
    """The calibration file of a camera, and in a stored run the camera of the file.

    Without `K` the file is read. With `K` the file is not needed: the numbers are the content of
    the file when the run was made.

    Raises
    ------
    InputError
        If `size` or `distortion` is given without `K`.

    Examples
    --------
    >>> CalibrationFile("camchain.yaml", camera="cam1").K is None
    True
    """

    file: Annotated[str, CalibrationPath(), "Path of the file, relative to the scenario file."]
    camera: Annotated[
        str | None, Text(least=1), "Name of the camera in a file of several cameras."
    ] = None
    sha256: Annotated[
        str | None,
        Text(pattern="[0-9a-f]{64}"),
        "SHA-256 of the content of the file. A file of another content is refused.",
    ] = None
    size: Annotated[Any, SIZE, "[width, height] of the image in pixels, beside K."] = None
    K: Annotated[Any, MATRIX, "Matrix of intrinsics in pixels, instead of reading the file."] = None
    distortion: Annotated[
        tuple[float, ...], COEFFICIENTS, "Distortion coefficients as in OpenCV, beside K."
    ] = ()
    lens: Annotated[
        str | None, LENS, "Model of the lens, beside K or for a file that does not name it."
    ] = None

    def __post_init__(self) -> None:
        if self.K is None and (self.size is not None or self.distortion):
            raise InputError("size and distortion: give them with K, or none of the three")


CALIBRATION = OneOf(
    CalibrationPath(),
    Table(CalibrationFile),
    words='the path of a calibration file, or a table: { file = "camchain.yaml", camera = "cam0" }',
)


def build_camera(table: Any, c: Context) -> Camera:
    """Return the camera of a table: of its numbers, or of its calibration.

    The old value of a changed table is a calibration, too: a camera with its origin, which the new
    camera keeps if its numbers are the same.
    """
    given = table.calibration
    if given is None or isinstance(given, Camera):
        camera = _build_from_numbers(table)
        return camera.read_from(given.origin) if given and is_identical(camera, given) else camera
    with prefix_path("calibration"):
        camera = _read_calibration(CalibrationFile(given) if isinstance(given, str) else given, c)
        if table.size is not None and camera.size not in (None, table.size):
            sizes = f"size {list(table.size)}, but the calibration is for {list(camera.size or ())}"
            raise InputError(sizes)
    whole = replace(camera, size=camera.size or table.size, body=table.body)
    return whole.read_from(camera.origin)


def _read_calibration(calibration: CalibrationFile, c: Context) -> Camera:
    """Return the camera of a calibration, from its numbers or from its file."""
    path = Path(c.facts.get("folder", "")) / calibration.file
    if calibration.K is not None:
        model: Any = {"distortion": calibration.distortion, "lens": calibration.lens or PERSPECTIVE}
        camera = Camera(calibration.K, calibration.size, **model)
        place = os.path.abspath(path)
        origin = CalibrationOrigin("", calibration.camera, calibration.sha256, place)
    else:
        try:
            camera, origin = load_camera(path, calibration.camera, Camera, calibration.lens)
        except FileError as error:
            raise InputError(str(error)) from None
        if calibration.sha256 not in (None, origin.sha256):
            digests = f"expected SHA-256 {calibration.sha256}, got {origin.sha256}"
            raise InputError(f"{path}: the content has changed: {digests}")
    return camera.read_from(replace(origin, file=calibration.file))


def _build_from_numbers(table: Any) -> Camera:
    """Return the camera of a table with numbers: K or its parts, size, distortion and body."""
    K = table.K
    if K is None:
        K = build_intrinsics(table.focal, table.center, table.skew, table.size)
    with prefix_path("K"):
        camera = Camera(np.array(K), table.size, body=table.body)
    with prefix_path("distortion"):
        return replace(camera, distortion=table.distortion, lens=table.lens)


def describe_lens(camera: Camera, c: Context) -> dict[str, Any]:
    """Return the keys of a camera in a text: its numbers, or its calibration."""
    numbers = {key: getattr(camera, key) for key in ("size", "distortion", "lens")}
    numbers |= _describe_intrinsics(camera, c)
    origin = camera.origin
    if origin is None or c.facts.get("by_hand") or c.facts.get("changes"):
        return numbers
    values: dict[str, Any] = {"size": camera.size, "K": camera.K.tolist()}
    values |= {"distortion": camera.distortion, "lens": _name_special_lens(camera)}
    stored = CalibrationFile(origin.file, origin.camera, origin.sha256, **values)
    in_file = {"calibration": stored, "lens": None}
    if "read_origin" in c.facts:  # a short text, which may refer to files
        return _refer_to_file(camera, origin, c.facts["folder"]) or in_file
    if c.facts.get("short"):  # the old value of a change: each number may be replaced
        return {**numbers, "calibration": camera}
    return in_file


def _name_special_lens(camera: Camera) -> str | None:
    """Return the model of a lens, or None for a perspective lens."""
    return None if camera.lens == PERSPECTIVE else camera.lens


def _refer_to_file(
    camera: Camera, origin: CalibrationOrigin, folder: Path
) -> dict[str, Any] | None:
    """Return the keys that refer to the file of a camera; None if it has another content now."""
    lens = None
    try:
        plain, now = load_camera(origin.path, origin.camera, Camera)
        if plain.lens != camera.lens:
            lens = camera.lens
            plain, now = load_camera(origin.path, origin.camera, Camera, lens)
    except (InputError, OSError):
        return None
    whole = replace(plain, size=plain.size or camera.size, body=camera.body)
    if now.sha256 != origin.sha256 or not is_identical(whole, camera):
        return None
    reference = format_relative_path(Path(origin.path), folder)
    table = CalibrationFile(reference, origin.camera, lens=lens)
    given = reference if origin.camera is None and lens is None else table
    return {"calibration": given, "size": None if plain.size else camera.size, "lens": None}


def _describe_intrinsics(camera: Camera, c: Context) -> dict[str, Any]:
    """Return the keys of the intrinsics: K, or in a short text its parts if they are exact."""
    parts = split_intrinsics(camera.K)
    if c.facts.get("by_hand"):
        return parts
    in_pixels = min(parts["focal"]) >= 1.0  # else the image has normalised coordinates
    if not (c.facts.get("short") and in_pixels) or not is_identical(
        camera.K, np.array(build_intrinsics(**parts, size=None))
    ):
        return {"K": camera.K.tolist()}
    if c.facts.get("changes"):
        return parts
    defaults = {"center": image_center(camera.size), "skew": 0.0}
    return {key: None if is_identical(x, defaults.get(key)) else x for key, x in parts.items()}
