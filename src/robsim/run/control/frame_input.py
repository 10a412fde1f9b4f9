"""Whole pictures of cameras, as arguments of `Controller.step`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.errors import InputError, format_value, suggest_names
from robsim.features.images.taken_pictures import TakenPictures
from robsim.servo.camera_target import CameraTarget
from robsim.world.mounted_camera import get_picture_size

LUMA = (299, 587, 114)  # thousandths of red, green and blue (ITU-R BT.601)


class FrameBuffer:
    """The new pictures of the cameras of a controller, until its next decision.

    `sights` are the camera-target pairs with features of pictures.
    """

    def __init__(self, sights: Sequence[CameraTarget]) -> None:
        self.sights = tuple(sights)
        self._sizes = {each.eye.name: get_picture_size(each.eye) for each in sights}
        self._new: dict[str, TakenPictures] = {}

    def take(self, images: Any) -> tuple[str, ...]:
        """Store pictures by the names of cameras, and return the names of the cameras.

        Raise InputError for a picture of another size or type, or of a camera that is not used.
        """
        if images is None:
            return ()
        if not isinstance(images, Mapping):
            raise InputError(
                f"images: expected a dict of the pictures of cameras, got {format_value(images)}"
            )
        frames = {name: self._read(name, image) for name, image in images.items()}
        one = np.zeros(1, dtype=np.int64)
        self._new |= {name: TakenPictures(grey[None], one) for name, grey in frames.items()}
        return tuple(frames)

    def release(self) -> dict[str, TakenPictures]:
        """Return the new pictures, which are used once."""
        new, self._new = self._new, {}
        return new

    def _read(self, name: str, image: Any) -> NDArray[np.uint8]:
        """Return the grey values (h, w) of a picture."""
        if name not in self._sizes:
            raise InputError(
                f"images: no feature uses pictures of camera {format_value(name)}; "
                f"{suggest_names(str(name), list(self._sizes), 'cameras')}"
            )
        return read_frame(image, f"images['{name}']", self._sizes[name])


def read_frame(image: Any, what: str, size: tuple[int, int]) -> NDArray[np.uint8]:
    """Return the grey values (h, w) of a grey or a colour picture; raise InputError for others.

    Examples
    --------
    >>> read_frame(np.full((2, 3, 3), 7, dtype=np.uint8), "frame", (3, 2)).tolist()
    [[7, 7, 7], [7, 7, 7]]
    """
    width, height = size
    array = np.asarray(image)
    if array.dtype != np.uint8 or array.shape not in ((height, width), (height, width, 3)):
        raise InputError(
            f"{what}: expected uint8 of shape ({height}, {width}) or ({height}, {width}, 3) in the "
            f"order red, green, blue, got {array.dtype} of shape {array.shape}"
        )
    if array.ndim == 2:
        return array.copy()
    colors = array.astype(np.int64)
    luma = LUMA[0] * colors[..., 0] + LUMA[1] * colors[..., 1] + LUMA[2] * colors[..., 2]
    return np.asarray((luma + 500) // 1000).astype(np.uint8)
