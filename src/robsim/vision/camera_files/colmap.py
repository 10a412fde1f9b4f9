"""Cameras in COLMAP's cameras.txt.

The upper left corner of an image is at (0, 0) in COLMAP, and the centre of the first pixel at (0.5,
0.5). In this package the centre of the first pixel is (0, 0), so a principal point has coordinates
that are smaller by half a pixel.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from decimal import Context, Decimal

from robsim.base.arrays import Array, as_float
from robsim.base.errors import FileError, InputError, format_value
from robsim.vision.camera_files.camera_tables import (
    SUPPORTED,
    C,
    LensCoefficients,
    LensModelError,
    MakeCamera,
    OptionalSize,
)

# indices of (fx, fy, cx, cy), and of the distortion coefficients of OpenCV; None: zero
PERSPECTIVE: dict[str, tuple[tuple[int, ...], tuple[int | None, ...]]] = {
    "SIMPLE_PINHOLE": ((0, 0, 1, 2), ()),
    "PINHOLE": ((0, 1, 2, 3), ()),
    "SIMPLE_RADIAL": ((0, 0, 1, 2), (3, None, None, None)),
    "RADIAL": ((0, 0, 1, 2), (3, 4, None, None)),
    "OPENCV": ((0, 1, 2, 3), (4, 5, 6, 7)),
    "FULL_OPENCV": ((0, 1, 2, 3), (4, 5, 6, 7, 8, 9, 10, 11)),
}
FISHEYE: dict[str, tuple[tuple[int, ...], tuple[int | None, ...]]] = {
    "SIMPLE_FISHEYE": ((0, 0, 1, 2), ()),
    "FISHEYE": ((0, 1, 2, 3), ()),
    "SIMPLE_RADIAL_FISHEYE": ((0, 0, 1, 2), (3, None, None, None)),
    "RADIAL_FISHEYE": ((0, 0, 1, 2), (3, 4, None, None)),
    "OPENCV_FISHEYE": ((0, 1, 2, 3), (4, 5, 6, 7)),
}
MODELS = PERSPECTIVE | FISHEYE
HALF = Decimal("0.5")
EXACT = Context(prec=800)  # digits: enough for the exact sum of any float and a half
HEAD = (
    "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS"
)
_MODEL = re.compile("[A-Z][A-Z_]+")
_LINE = re.compile(r"\d+[ \t]+[A-Z][A-Z_]+[ \t]+\d+[ \t]+\d+([ \t]|$)")


def is_cameras_txt(text: str) -> bool:
    """Return whether the first line that is not a comment describes a COLMAP camera.

    >>> is_cameras_txt("# cameras\\n1 PINHOLE 640 480 500 500 320 240\\n")
    True
    """
    return any(map(_LINE.match, [line for _, line in _split_lines(text)][:1]))


def read_colmap_cameras(text: str, source: str, make: MakeCamera[C]) -> dict[str, C | InputError]:
    """Return the cameras of a text by number, or the reason why a camera is not supported.

    FileError is raised for an invalid line, or a number that occurs twice.
    """
    cameras: dict[str, C | InputError] = {}
    for at, line in _split_lines(text):
        try:
            name, model, *rest = line.split()
            if name in cameras:
                raise InputError(f"camera {format_value(name)} occurs twice")
            cameras[name] = _build_colmap_camera(model, rest, make)
        except LensModelError as reason:
            cameras[name] = FileError(f"{source}:{at}: {reason}")
        except (InputError, ValueError) as error:
            raise FileError(f"{source}:{at}: {error}") from None
    return cameras


def format_cameras_txt(K: Array, size: OptionalSize, lens: LensCoefficients, model: str) -> str:
    """Return the text of a cameras.txt with one camera, number 1, and all of its coefficients."""
    if size is None:
        raise InputError("COLMAP needs the size of the image: give size=(width, height)")
    word = {0: "PINHOLE", 4: "OPENCV"}.get(len(lens), "FULL_OPENCV")
    word = "OPENCV_FISHEYE" if model == "fisheye" else word
    lens = lens if len(lens) in (0, 4) else (*lens, *[0.0] * (8 - len(lens)))
    (fx, _, cx), (_, fy, cy), _ = K.tolist()
    centre = [str(_add_exactly(repr(c), HALF)) for c in (cx, cy)]
    row = ["1", word, *map(str, size), repr(fx), repr(fy), *centre, *map(repr, lens)]
    return f"{HEAD}\n{' '.join(row)}\n"


def _split_lines(text: str) -> list[tuple[int, str]]:
    """Return the lines with their numbers, without comments and empty lines."""
    stripped = ((i, line.strip()) for i, line in enumerate(text.splitlines(), 1))
    return [(i, line) for i, line in stripped if line and not line.startswith("#")]


def _build_colmap_camera(model: str, words: Sequence[str], make: MakeCamera[C]) -> C:
    """Return the camera of a model from the further words of its line: size and parameters."""
    if model not in MODELS:
        error = LensModelError if _MODEL.fullmatch(model) else InputError
        raise error(
            f"{format_value(model)} is not supported; choose {', '.join(MODELS)}; {SUPPORTED}"
        )
    places, lens = MODELS[model]
    count = max([*places, *(i for i in lens if i is not None)]) + 1
    size, values = words[:2], [_parse_number(word) for word in words[2:]]
    if len(values) != count:
        raise InputError(f"{model} has {count} parameters, got {len(values)}")
    fx, fy = (values[i] for i in places[:2])
    cx, cy = (float(_add_exactly(words[2 + i], -HALF)) for i in places[2:])
    K = [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]
    distortion = tuple(0.0 if i is None else values[i] for i in lens)
    kind_of_lens = "fisheye" if model in FISHEYE else "perspective"
    return make(K, (int(size[0]), int(size[1])), distortion=distortion, lens=kind_of_lens)


def _add_exactly(word: str, by: Decimal) -> Decimal:
    """Return the exact sum of two numbers: a shift by half a pixel and back loses no digit."""
    return EXACT.add(Decimal(word), by)


def _parse_number(word: str) -> float:
    """Return the finite number that a word represents."""
    try:
        return as_float(float(word), "a parameter")
    except ValueError:
        raise InputError(f"{format_value(word)} is not a finite number") from None
