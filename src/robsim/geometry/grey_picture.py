"""A grey picture, from a file or an array."""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import make_read_only
from robsim.base.errors import FileError, InputError, format_value
from robsim.base.file_content import read_bytes

if TYPE_CHECKING:
    from PIL.Image import Image as OpenedImage

MOST_PIXELS = 50_000_000
LARGEST_FILE = 200_000_000  # bytes
FORMATS = ("PNG", "JPEG", "BMP", "TIFF", "PPM", "WEBP")  # decoders that only decode
GREY_MODES, COLOR_MODES = ("1", "L"), ("RGB", "P", "CMYK", "YCbCr", "LAB", "HSV")


@dataclass(frozen=True, eq=False)
class GreyPicture:
    """Grey values of 8 bits.

    Parameters
    ----------
    grey : array_like of uint8, shape (h, w)
        Grey values, 0 black and 255 white.
    path : str, optional
        Absolute path of the file of the picture. It has no effect on equality.

    Raises
    ------
    InputError
        If the array does not have the type uint8 and two dimensions, or is empty or huge.

    Examples
    --------
    >>> GreyPicture(np.zeros((2, 3), dtype=np.uint8)).digest[:8]
    'bda3e979'
    """

    grey: NDArray[np.uint8]
    path: str = field(default="", compare=False)

    if TYPE_CHECKING:  # the type of the argument is wider than the type of the attribute

        def __init__(self, grey: ArrayLike, path: str = "") -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "grey", make_read_only(_check_grey(self.grey)))

    @classmethod
    def from_file(cls, path: str | os.PathLike[str]) -> GreyPicture:
        """Return the picture of a file, by the luminance of its colours.

        Only the first frame of a file of several is read. A colour picture becomes grey by
        Y = 0.299 R + 0.587 G + 0.114 B (ITU-R BT.601).

        Raises
        ------
        FileError
            If the file cannot be read, is no picture of PNG, JPEG, BMP, TIFF, PPM or WebP, has an
            alpha channel or more than 8 bits, or more than 50 million pixels.
        """
        data = read_bytes(path, "a picture", LARGEST_FILE)
        return cls(_decode_grey(data, str(path)), os.path.abspath(path))

    @classmethod
    def from_png(cls, data: bytes, source: str) -> GreyPicture:
        """Return the picture of the content of a PNG file.

        Parameters
        ----------
        data : bytes
            Content of the file.
        source : str
            Name of the file in errors.

        Raises
        ------
        InputError
            If `data` are not bytes.
        FileError
            If the content is not that of a PNG file.

        Examples
        --------
        >>> picture = GreyPicture(np.zeros((2, 3), dtype=np.uint8))
        >>> GreyPicture.from_png(picture.png, "copy") == picture
        True
        """
        if not isinstance(data, bytes):
            raise InputError(f"data: expected the bytes of a PNG file, got {format_value(data)}")
        return cls(_decode_grey(data, str(source), ("PNG",)))

    @cached_property
    def png(self) -> bytes:
        """The content of a PNG file of the picture, without a loss."""
        from PIL import Image

        content = BytesIO()
        Image.fromarray(self.grey).save(content, "PNG")
        return content.getvalue()

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of the picture as a binary PGM file (Netpbm's P5).

        It depends on the grey values only: a copy in another format without a loss has the same.
        """
        height, width = self.grey.shape
        content = f"P5\n{width} {height}\n255\n".encode() + self.grey.tobytes()
        return hashlib.sha256(content).hexdigest()

    @cached_property
    def mean_color(self) -> str:
        """The mean grey value as a colour of Matplotlib, "0" black to "1" white."""
        return f"{self.grey.mean() / 255:.3g}"

    def __eq__(self, other: object) -> bool:
        """Return whether the other picture has the same grey values."""
        return isinstance(other, GreyPicture) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        height, width = self.grey.shape
        return f"GreyPicture({width} x {height} pixels, {self.digest[:12]})"


PictureLike = str | os.PathLike[str] | GreyPicture | NDArray[np.uint8]  # as arguments take them


def _check_grey(values: Any) -> NDArray[np.uint8]:
    """Return grey values of 8 bits; raise InputError for other arrays."""
    array = np.asarray(values)
    if array.dtype != np.uint8 or array.ndim != 2 or not array.size:
        given = f"{array.dtype}, shape {array.shape}"
        raise InputError(f"picture: expected grey values of uint8, shape (h, w), got {given}")
    if array.size > MOST_PIXELS:
        raise InputError(f"picture: {array.size} pixels; at most {MOST_PIXELS}")
    is_owned = array.base is None and not array.flags.writeable  # of another GreyPicture
    return array if is_owned else np.array(array)


def _decode_grey(data: bytes, source: str, formats: tuple[str, ...] = FORMATS) -> NDArray[np.uint8]:
    """Return the grey values of the content of a file."""
    from PIL import Image, UnidentifiedImageError  # only for files

    try:
        with _refuse_bombs(), Image.open(BytesIO(data), formats=formats) as image:
            if image.width * image.height > MOST_PIXELS:  # before its pixels are decoded
                size = f"{image.width} x {image.height}"
                raise FileError(f"{source}: {size} pixels; at most {MOST_PIXELS}")
            return _convert_to_grey(image, source)
    except UnidentifiedImageError:
        raise FileError(f"{source}: no picture of {', '.join(formats)}") from None
    except (Image.DecompressionBombError, Image.DecompressionBombWarning):
        raise FileError(f"{source}: more than {MOST_PIXELS} pixels") from None
    except (OSError, SyntaxError, ValueError) as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"{source}: cannot be read: {error}") from None


@contextmanager
def _refuse_bombs() -> Iterator[None]:
    """Turn Pillow's warning of a huge picture into its error."""
    from PIL import Image

    with warnings.catch_warnings():
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        yield


def _convert_to_grey(image: OpenedImage, source: str) -> NDArray[np.uint8]:
    """Return the luminance of an opened picture."""
    known = "expected 8 bits, without an alpha channel"
    if image.mode not in (*GREY_MODES, *COLOR_MODES) or "transparency" in image.info:
        raise FileError(f"{source}: a picture of mode {format_value(image.mode)}; {known}")
    if _has_deep_colors(image):  # Pillow would drop the lower bits
        raise FileError(f"{source}: a picture of 16 bits; {known}")
    colors = image if image.mode in GREY_MODES else image.convert("RGB")
    return np.asarray(colors.convert("L"))


def _has_deep_colors(image: OpenedImage) -> bool:
    """Return whether the colours of a file have more than 8 bits."""
    for *_, arguments in getattr(image, "tile", ()):  # of the decoders, before they run
        mode, *others = arguments if isinstance(arguments, tuple) else (arguments,)
        greatest = others[0] if others and image.format == "PPM" else 255
        if ";16" in str(mode) or greatest > 255:
            return True
    return False
