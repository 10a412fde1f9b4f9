"""Pictures of a camera in motion, with the errors of its optics."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.rendering.renderer import Renderer
from robsim.rendering.sensor import Sensor
from robsim.vision.camera import Camera
from robsim.vision.optics import Optics

EXPOSURE_TIMES = 8  # of each row, in the middle of equal parts of the exposure
BAND_ROWS = 8  # rows of a rolling shutter with the same times
EXPOSED_BAND_ROWS = 16  # the same for a shutter with an exposure


class Development:
    """Draws the pictures of a camera with errors while bodies and camera move.

    The exposure is a mean of the light at 8 times. A rolling shutter is divided into bands of 8
    rows, or of 16 rows if there is an exposure as well. All rows of a band are seen at the times of
    its middle, so the place of a row is wrong by at most the motion during half a band.

    Parameters
    ----------
    renderer : Renderer
        Renderer of the light on this camera.
    optics : Optics
        Errors of the pictures, with one number for each field.
    camera : Camera
        Camera with a size.

    Attributes
    ----------
    offsets : ndarray of shape (K,)
        Times in seconds before the time of the image at which poses are needed, band by band.
        Without exposure and readout they are [0].
    duration : float
        Time in seconds from the first light of an image to its last.

    Examples
    --------
    >>> camera = Camera([[2, 0, 1], [0, 2, 1], [0, 0, 1]], size=(3, 16))
    >>> optics = Optics(readout=0.016)
    >>> development = Development(Renderer(camera, []), optics, camera)
    >>> development.offsets
    array([0.0115, 0.0035])
    >>> development.draw(np.empty((2, 0, 4, 4)), [[0, 0, 1, 1]] * 2, seed=0, run=0, step=0)[0]
    array([128, 128, 128], dtype=uint8)
    """

    offsets: Array
    duration: float

    def __init__(self, renderer: Renderer, optics: Optics, camera: Camera) -> None:
        assert camera.size is not None
        self._renderer, self._sensor = renderer, Sensor(optics, camera)
        self._bands = _divide_rows(camera.size[1], optics)
        parts = (np.arange(EXPOSURE_TIMES) + 0.5) / EXPOSURE_TIMES
        within = optics.exposure * parts if optics.exposure > 0 else np.zeros(1)
        ends = [_find_band_time(band, camera.size[1], optics.readout) for band in self._bands]
        self.offsets = make_read_only(np.add.outer(ends, within).ravel())
        self.duration = optics.duration

    def draw(self, T_c_b: Array, light: Array, seed: int, run: int, step: int) -> NDArray[np.uint8]:
        """Return the grey values (h, w) of bodies at poses for each of the offsets.

        Parameters
        ----------
        T_c_b : ndarray of shape (K, bodies, 4, 4)
            Poses of the bodies in camera axes.
        light : ndarray of shape (K, 4)
            Unit direction of the light in camera axes, and the share of light from everywhere.
        seed, run, step : int
            Key of the noise.
        """
        return self._sensor.develop(self._expose(T_c_b, light), seed, run, step)

    def _expose(self, T_c_b: Array, light: Array) -> NDArray[np.float32]:
        """Return the light on the sensor."""
        count = len(self.offsets) // len(self._bands)
        if len(self._bands) == 1:
            pictures = (self._renderer.draw(T_c_b[k], light[k]) for k in range(count))
            return _average(list(pictures))
        bands = []
        for b, (top, end) in enumerate(self._bands):
            times = range(b * count, (b + 1) * count)
            draw = self._renderer.draw_rows
            bands.append(_average([draw(T_c_b[k], light[k], top, end) for k in times]))
        return np.concatenate(bands)


def _divide_rows(height: int, optics: Optics) -> list[tuple[int, int]]:
    """Return the first row and the end of each band of rows that are seen at the same times."""
    if optics.readout == 0:
        return [(0, height)]
    rows = EXPOSED_BAND_ROWS if optics.exposure > 0 else BAND_ROWS
    return [(top, min(top + rows, height)) for top in range(0, height, rows)]


def _find_band_time(band: tuple[int, int], height: int, readout: float) -> float:
    """Return the time from the end of the exposure of the middle of a band to the image."""
    middle = 0.5 * (band[0] + band[1] - 1)
    return readout * (height - 1 - middle) / height


def _average(pictures: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    """Return the mean of pictures."""
    if len(pictures) == 1:
        return pictures[0]
    total = pictures[0].copy()
    for each in pictures[1:]:
        total += each
    return total / np.float32(len(pictures))
