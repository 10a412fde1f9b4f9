"""The sensor of a camera: grey values from light."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.kernels.sensor.image_development import develop_image
from robsim.kernels.sensor.separable_blur import blur_image
from robsim.rendering.sensor_tables import build_blur_weights, build_sensor_arrays
from robsim.vision.camera import Camera
from robsim.vision.optics import Optics


class Sensor:
    """The sensor of a camera behind its lens.

    It applies the parts of `Optics` that need no motion: the blur of the lens, vignetting, gain,
    noise, saturation, gamma and bits, in this order.

    Parameters
    ----------
    optics : Optics
        Errors of the pictures, with one number for each field.
    camera : Camera
        Camera with a size.

    Examples
    --------
    >>> camera = Camera([[2, 0, 1], [0, 2, 1], [0, 0, 1]], size=(3, 3))
    >>> light = np.full((3, 3), 60, dtype=np.float32)
    >>> Sensor(Optics(gain=2.0, vignetting=4.0), camera).develop(light)
    array([[ 53,  77,  53],
           [ 77, 120,  77],
           [ 53,  77,  53]], dtype=uint8)
    """

    def __init__(self, optics: Optics, camera: Camera) -> None:
        assert camera.size is not None
        width, height = camera.size
        self._arrays = build_sensor_arrays(optics, camera)
        self._weights = build_blur_weights(optics.defocus) if optics.defocus > 0 else None
        reach = 0 if self._weights is None else len(self._weights) - 1
        self._padded = np.empty(width + 2 * reach, dtype=np.float32)
        self._blurred = np.empty((height, width), dtype=np.float32)
        self._along_rows = np.empty((height, width), dtype=np.float32)
        row, words = np.empty((2, width), dtype=np.float32), np.empty(width, dtype=np.uint64)
        self._buffers = row, words, np.empty(width, dtype=np.int32)

    def develop(
        self, light: NDArray[np.float32], seed: int = 0, run: int = 0, step: int = 0
    ) -> NDArray[np.uint8]:
        """Return the grey values (h, w) of light (h, w), the picture of an ideal camera.

        The noise is a function of seed, run, step and the pixel.
        """
        if self._weights is not None:
            self._blurred[:] = light
            light = self._blurred
            blur_image(light, self._weights, self._padded, self._along_rows)
        image = np.empty(light.shape, dtype=np.uint8)
        key = np.uint64(seed), np.uint64(run), np.uint64(step)
        develop_image(light, self._arrays, *key, *self._buffers, image)
        return image
