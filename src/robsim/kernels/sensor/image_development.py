"""Grey values of a sensor from the light on its pixels."""

from typing import Any, NamedTuple

import numpy as np

from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import part
from robsim.kernels.sensor.hashed_normals import fill_normal_row, find_image_key

WHITE = np.float32(255.0)
ZERO, ONE = np.float32(0.0), np.float32(1.0)


class SensorArrays(NamedTuple):
    """The response of a sensor.

    factor (h, w), float32, the grey value of a pixel without noise over its light; noise (2,),
    float32, the variance of the noise per grey value, and the variance in the dark; quantiles (n,),
    float32, of which two sum to a normal number, empty without noise; curve (m + 1,), float32, grey
    values after gamma at grey values 255 (i / m)^2, empty without gamma; palette (levels,), uint8.
    """

    factor: Any
    noise: Any
    quantiles: Any
    curve: Any
    palette: Any


@entry(
    "float32[:, ::1], SensorArrays(float32[:, ::1], float32[::1], float32[::1], float32[::1], "
    "uint8[::1]), uint64, uint64, uint64, out float32[:, ::1], out uint64[::1], out int32[::1], "
    "out uint8[:, ::1]"
)
def develop_image(light, sensor, seed, run, step, row, words, index, out):
    """Compute the grey values out (h, w) of the light (h, w) on the pixels of a sensor.

    Parameters
    ----------
    light : array of float32, shape (h, w)
        Grey values of an ideal camera.
    sensor : SensorArrays
        Response of the sensor.
    seed, run, step : int
        Key of the random numbers.
    row : array of float32, shape (2, w)
        Buffers of a row.
    words : array of uint64, shape (w,)
        Buffer of random words.
    index : array of int32, shape (w,)
        Buffer of places in the gamma curve.
    out : array of uint8, shape (h, w)
        Grey values, the result.
    """
    key, values, normal = find_image_key(seed, run, step), row[0], row[1]
    for y in range(light.shape[0]):
        given, factor = light[y], sensor.factor[y]
        for x in range(values.size):
            values[x] = given[x] * factor[x]
        if sensor.quantiles.size > 0:
            fill_normal_row(key, y, sensor.quantiles, words, normal)
            _add_noise(sensor.noise[0], sensor.noise[1], normal, values)
        for x in range(values.size):
            values[x] = min(max(values[x], ZERO), WHITE)
        if sensor.curve.size > 0:
            _apply_curve(sensor.curve, values, index)
        _quantise(sensor.palette, values, out[y])


@part
def _add_noise(per_grey, dark, normal, values):
    """Add noise to a row; its variance is a linear function of the value without noise."""
    for x in range(values.size):
        values[x] += np.sqrt(per_grey * max(values[x], ZERO) + dark) * normal[x]


@part
def _apply_curve(curve, values, index):
    """Apply a curve to a row, by linear interpolation in the root of the value.

    The root spreads dark values, at which a gamma above 1 is steep.
    """
    last = curve.size - 1
    scale = np.float32(last) * np.float32(last) / WHITE
    for x in range(values.size):
        place = np.sqrt(values[x] * scale)
        part_below = min(np.int32(place), np.int32(last - 1))
        index[x], values[x] = part_below, place - np.float32(part_below)
    for x in range(values.size):
        i = np.uint32(index[x])  # unsigned numbers cannot count from the end
        low, high = curve[i], curve[i + np.uint32(1)]
        values[x] = low + values[x] * (high - low)


@part
def _quantise(palette, values, out):
    """Round a row to the levels of a palette."""
    top = np.float32(palette.size - 1)
    if palette.size == 256:  # the palette contains its own indices
        for x in range(values.size):
            out[x] = np.uint8(np.int32(np.rint(values[x])))
        return
    for x in range(values.size):
        out[x] = palette[np.uint32(np.rint(values[x] * (top / WHITE)))]
