"""A grey picture, from a file or an array."""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import make_read_only
from robsim.base.errors import FileError, InputError, format_value
from robsim.base.file_content import check_regular_file

if TYPE_CHECKING:
    from PIL.Image import Image as OpenedImage

MOST_PIXELS = 50_000_000
FORMATS = ("PNG", "JPEG", "BMP", "TIFF", "PPM", "WEBP")  # decoders that only decode
GREY_MODES, COLOR_MODES = ("1", "L"), ("RGB", "P", "CMYK", "YCbCr", "LAB", "HSV")


@dataclass(frozen=True, eq=False)
class GreyPicture:
    """Grey values of 8 bits.

    Parameters
    ----------
    grey : array_like of uint8, shape (h, w)
        Grey values, 0 black and 255 white.

    Raises
    ------
    InputError
        If the array does not have the type uint8 and two dimensions, or is empty or huge.

    Examples
    --------
    >>> GreyPicture(np.zeros((2, 3), dtype=np.uint8)).digest[:8]
    'e4395e6d'
    """

    grey: NDArray[np.uint8]

    if TYPE_CHECKING:  # the type of the argument is wider than the type of the attribute

        def __init__(self, grey: ArrayLike) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "grey", make_read_only(_check_grey(self.grey)))

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> GreyPicture:
        """Return the picture of a file, by the luminance of its colours.

        Raises
        ------
        FileError
            If the file cannot be read, is no picture of PNG, JPEG, BMP, TIFF, PPM or WebP, has an
            alpha channel or more than 8 bits, or more than 50 million pixels.
        """
        return cls(_read_grey(Path(path)))

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of the size and the grey values."""
        height, width = self.grey.shape
        content = f"{width} {height} ".encode() + self.grey.tobytes()
        return hashlib.sha256(content).hexdigest()

    def __eq__(self, other: object) -> bool:
        """Return whether the other picture has the same grey values."""
        return isinstance(other, GreyPicture) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        height, width = self.grey.shape
        return f"GreyPicture({width} x {height} pixels, {self.digest[:12]})"


def _check_grey(values: Any) -> NDArray[np.uint8]:
    """Return grey values of 8 bits; raise InputError for other arrays."""
    array = np.asarray(values)
    if array.dtype != np.uint8 or array.ndim != 2 or not array.size:
        given = f"{array.dtype}, shape {array.shape}"
        raise InputError(f"picture: expected grey values of uint8, shape (h, w), got {given}")
    if array.size > MOST_PIXELS:
        raise InputError(f"picture: {array.size} pixels; at most {MOST_PIXELS}")
    return np.array(array)


def _read_grey(path: Path) -> NDArray[np.uint8]:
    """Return the grey values of a file."""
    from PIL import Image, UnidentifiedImageError  # only for files

    check_regular_file(path, "a picture")
    try:
        with _refuse_bombs(), Image.open(path, formats=FORMATS) as image:
            if image.width * image.height > MOST_PIXELS:
                size = f"{image.width} x {image.height}"
                raise FileError(f"{path}: {size} pixels; at most {MOST_PIXELS}")
            return _convert_to_grey(image, path)
    except UnidentifiedImageError:
        raise FileError(f"{path}: no picture of {', '.join(FORMATS)}") from None
    except (Image.DecompressionBombError, Image.DecompressionBombWarning):
        raise FileError(f"{path}: more than {MOST_PIXELS} pixels") from None
    except (OSError, SyntaxError, ValueError) as error:
        raise FileError(f"{path}: cannot be read: {error}") from None


@contextmanager
def _refuse_bombs() -> Iterator[None]:
    """Turn Pillow's warning of a huge picture into its error."""
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        yield


def _convert_to_grey(image: OpenedImage, path: Path) -> NDArray[np.uint8]:
    """Return the luminance of an opened picture."""
    if image.mode not in (*GREY_MODES, *COLOR_MODES) or "transparency" in image.info:
        known = "8 bits, without an alpha channel"
        raise FileError(f"{path}: a picture of mode {format_value(image.mode)}; expected {known}")
    colors = image if image.mode in GREY_MODES else image.convert("RGB")
    return np.asarray(colors.convert("L"))
