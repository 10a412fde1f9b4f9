"""Cameras in tables with the keys of OpenCV and ROS."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, has_items
from robsim.base.errors import InputError, format_value
from robsim.vision.lens_models import find_lens_model

C = TypeVar("C")  # the class of cameras
MakeCamera = Callable[..., C]  # Make(K, size, distortion=..., lens=...) returns a camera
OptionalSize = tuple[int, int] | None  # the width and height of the image in pixels
LensCoefficients = tuple[float, ...]  # the distortion coefficients
# keys of other programs for each part of a camera, reduced to letters and digits in lower case; a
# number at the end of a key is the number of the camera
WORDS = {
    "K": "cameramatrix k m mtx intrinsicmatrix",
    "distortion": "distortioncoefficients distortioncoeffs distcoeffs distcoefs dist d distortion",
    "size": "imagesize resolution",
    "width": "imagewidth width",
    "height": "imageheight height",
}
SIZES = "size", "width", "height"  # parts that all cameras of a table may share
PARTS = {word: part for part, words in WORDS.items() for word in words.split()}
EXPECTED = "camera_matrix, cameraMatrix or K"
MODEL_KEYS = "distortion_model", "camera_model", "model"
NO_MODEL = "", "none", "pinhole"  # values that do not determine the model of the lens
FISHEYE_KEYS = "fisheye_model", "fisheye"  # of OpenCV, for a fisheye lens if their values are not 0
OMNIDIRECTIONAL_KEY = "xi"
SUPPORTED = (
    "expected a perspective lens with k1 k2 p1 p2 [k3 [k4 k5 k6]] "
    "(plumb_bob, radtan, rational_polynomial) or a fisheye lens with k1 k2 k3 k4 (equidistant)"
)


class LensModelError(InputError):
    """Error about a camera or lens model that is not supported, in a valid file."""


def read_table_cameras(table: object, make: MakeCamera[C]) -> dict[str, C]:
    """Return the cameras of a table by the number at the end of their keys, or "camera".

    InputError is raised if the camera matrix is missing, two keys belong to the same part, or the
    camera model is not supported.
    """
    if not isinstance(table, Mapping):
        raise InputError(f"expected keys such as {EXPECTED}, got {format_value(table)}")
    model = read_lens_model(table)
    keys_of: dict[str, dict[str, str]] = {}  # key by part, of each camera
    for key in table:
        word, number = _split_key(str(key))
        if word in PARTS:
            _record_key(keys_of.setdefault(number, {}), PARTS[word], str(key))
    shared = {part: key for part, key in keys_of.get("", {}).items() if part in SIZES}
    cameras = {number or "camera": shared | k for number, k in keys_of.items() if "K" in k}
    if not cameras:
        keys = format_value(", ".join(map(str, table)))
        raise InputError(f"no camera matrix: expected {EXPECTED}; keys: {keys}")
    return {name: _build_table_camera(table, keys, make, model) for name, keys in cameras.items()}


def read_lens_model(table: Mapping[str, Any]) -> dict[str, str]:
    """Return the model of the lens as the argument `lens`, or nothing if the table has no model.

    LensModelError is raised for a model that is not supported, and for two different models.
    """
    if table.get(OMNIDIRECTIONAL_KEY) not in (None, 0.0):
        key = OMNIDIRECTIONAL_KEY
        raise LensModelError(f"{key}: omnidirectional lenses are not supported: {SUPPORTED}")
    key_of: dict[str, str] = {}
    for key in MODEL_KEYS:
        word = str("" if table.get(key) is None else table[key])
        if word.strip().lower() not in NO_MODEL:
            key_of[_require_lens_model(key, word)] = key
    for key in FISHEYE_KEYS:
        if table.get(key) not in (None, 0.0, "false", "False", False):
            key_of["fisheye"] = key
    if len(key_of) > 1:
        both = " and ".join(f"{key} {format_value(table[key])}" for key in key_of.values())
        raise LensModelError(f"{both} are different models of a lens: give one")
    return dict(zip(["lens"], key_of, strict=False))


def _require_lens_model(key: str, word: str) -> str:
    """Return the model that a word names; raise LensModelError if it is not supported."""
    model = find_lens_model(word)
    if model is None:
        raise LensModelError(f"{key} {format_value(word)} is not supported: {SUPPORTED}")
    return model


def parse_matrix(value: Any, what: str) -> Array:
    """Return the numbers of a list, or of a table with rows, cols and data.

    >>> parse_matrix({"rows": 1.0, "cols": 2.0, "data": [3.0, 4.0]}, "D")
    array([[3., 4.]])
    """
    if not isinstance(value, Mapping):
        if not has_items(value):
            raise InputError(f"{what}: expected a matrix, got {format_value(value)}")
        return as_floats(value, what, ())
    if missing := [key for key in ("rows", "cols", "data") if key not in value]:
        raise InputError(f"{what}: a matrix has rows, cols and data; {missing[0]} is missing")
    data = as_floats(value["data"] if has_items(value["data"]) else [], f"{what}.data", ())
    shape = [value["rows"], value["cols"]]
    if (
        data.ndim != 1
        or not all(_is_whole_number(n) for n in shape)
        or data.size != shape[0] * shape[1]
    ):
        raise InputError(
            f"{what}: {format_value(shape[0])} rows and {format_value(shape[1])} columns, "
            f"but {data.size} numbers"
        )
    return data.reshape([int(n) for n in shape])


def _build_table_camera(
    table: Mapping[str, Any], keys: Mapping[str, str], make: MakeCamera[C], model: Mapping[str, str]
) -> C:
    """Return the camera of a table from the keys of its parts."""
    K = parse_matrix(table[keys["K"]], keys["K"])
    if K.shape == (9,):
        K = K.reshape(3, 3)
    if K.shape != (3, 3):
        raise InputError(f"{keys['K']}: expected 3 x 3 numbers, got shape {K.shape}")
    lens = (
        parse_matrix(table[keys["distortion"]], keys["distortion"]) if "distortion" in keys else ()
    )
    return make(K, _read_image_size(table, keys), distortion=lens, **model)


def _read_image_size(table: Mapping[str, Any], keys: Mapping[str, str]) -> ArrayLike | None:
    """Return (width, height), or None if the table has neither."""
    if "size" in keys and not keys.keys() & {"width", "height"}:
        return parse_matrix(table[keys["size"]], keys["size"]).ravel()
    if not keys.keys() & {"width", "height"}:
        return None
    if missing := [part for part in ("width", "height") if part not in keys]:
        raise InputError(f"image_{missing[0]} is missing")
    return [table[keys["width"]], table[keys["height"]]]


def _split_key(key: str) -> tuple[str, str]:
    """Return the letters and digits of a key in lower case, split before a number at the end."""
    word = re.sub(r"[^a-z0-9]", "", key.lower())
    stem = word.rstrip("0123456789")
    return stem, word[len(stem) :]


def _record_key(keys: dict[str, str], part: str, key: str) -> None:
    """Store the key of a part; raise InputError if the part already has a key."""
    if part in keys:
        raise InputError(f"{keys[part]} and {key} are the same parameter: give one")
    keys[part] = key


def _is_whole_number(value: object) -> bool:
    """Return whether a value is a whole number, 0 or larger."""
    return isinstance(value, int | float) and value >= 0 and value == int(value)
