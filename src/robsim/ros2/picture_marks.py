"""Marks that the detectors of an experiment find in the pictures of a camera driver."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.engine.mark_detection import DetectedPair, find_marks
from robsim.run.control.standalone_controller import Controller
from robsim.servo.camera_target import PairKey
from robsim.world.imperfections.image_effect import MarkGroup

GREY_WEIGHTS = np.array([0.299, 0.587, 0.114])  # of red, green and blue, ITU-R BT.601
CHANNELS = {"mono8": 1, "8UC1": 1, "rgb8": 3, "bgr8": 3, "rgba8": 4, "bgra8": 4}


class PictureMarks:
    """The detectors of a controller, with the pixels at which each mark was found last.

    Before the first picture, marks are expected where the scene has them.

    Parameters
    ----------
    controller : Controller
        Controller with the detectors.
    """

    def __init__(self, controller: Controller) -> None:
        self.pairs = _list_pairs(controller)
        self._last: dict[PairKey, Array] = {}
        self._numbers = dict.fromkeys((pair.camera for pair in self.pairs), 0)

    @property
    def cameras(self) -> tuple[str, ...]:
        """The names of the cameras with detectors, each once."""
        return tuple(self._numbers)

    def find(self, camera: str, grey: NDArray[np.uint8], q: Array) -> Mapping[PairKey, Array]:
        """Return the pixels (N, 2) of each target in a picture (h, w), NaN for missing marks.

        q (nq,) are the coordinates at which marks are expected in the first picture.
        """
        found = {}
        for pair in (each for each in self.pairs if each.camera == camera):
            key = pair.sight.key
            last = self._last[key] if key in self._last else _predict_pixels(pair, q)
            runs, number = np.zeros(1, dtype=np.int64), self._numbers[camera]
            pixels = find_marks(pair, grey[None], last[None], number, runs)[0]
            self._last[key] = np.where(np.isnan(pixels), last, pixels)
            found[key] = pixels
        self._numbers[camera] += 1
        return found


def read_picture(message: Any) -> NDArray[np.uint8]:
    """Return the grey values (h, w) of a sensor_msgs/Image with 8 bits per channel.

    Raises
    ------
    InputError
        If the encoding is not supported, or the data are incomplete.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> picture = SimpleNamespace(height=1, width=2, encoding="mono8", step=3, data=b"abc")
    >>> read_picture(picture).tolist()
    [[97, 98]]
    """
    channels = CHANNELS.get(message.encoding)
    if channels is None:
        known = ", ".join(CHANNELS)
        raise InputError(f"image: no encoding '{message.encoding}'; encodings: {known}")
    h, w, step = int(message.height), int(message.width), int(message.step)
    data = np.frombuffer(message.data, dtype=np.uint8)
    if data.size < h * step or step < w * channels:
        raise InputError(f"image: {data.size} bytes are too few for {h} rows of {step} bytes")
    rows = data[: h * step].reshape(h, step)[:, : w * channels]
    if channels == 1:
        return rows
    colours = rows.reshape(h, w, channels)[..., :3]
    red_first = colours if message.encoding.startswith("rgb") else colours[..., ::-1]
    grey: NDArray[np.uint8] = np.rint(red_first @ GREY_WEIGHTS).astype(np.uint8)
    return grey


def _list_pairs(controller: Controller) -> list[DetectedPair]:
    """Return the pairs of camera and target with a detector."""
    bound, pairs = controller.bound_task, []
    for sight in (each for each in controller.sights if each.key in bound.detectors):
        group = MarkGroup(*sight.key, 0, len(sight.target.marks))
        believed = bound.believed_sights.get(sight.key, sight)
        detector = bound.detectors[sight.key]
        pairs.append(DetectedPair(sight.eye.name, sight, believed, group, detector))
    return pairs


def _predict_pixels(pair: DetectedPair, q: Array) -> Array:
    """Return the pixels (N, 2) at which the marks of a pair are at coordinates q (nq,)."""
    pixels: Array = np.rint(pair.believed.project(q[:, None]).pixels[..., 0])
    return pixels
