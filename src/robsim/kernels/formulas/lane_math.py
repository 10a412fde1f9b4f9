"""Elementary functions on lanes, with the same bits in every lane, beside any others.

Sine and cosine: the argument is reduced by multiples of pi/2 in three parts (Cody and Waite 1980),
then the polynomials of degree 13 and 14 that fdlibm prints (Sun Microsystems 1993); correct to one
unit in the last place. An argument so large that the reduction would lose digits is left to the
library, number by number.
"""

import math

from robsim.kernels.machine.jit import kernel, part
from robsim.kernels.machine.lanes import (
    WIDTH,
    absolute,
    any_lane,
    floor,
    get_lane,
    replace_lane,
    where,
)

LARGE = 1e5  # radians: beyond, k * PI_2[0] is not exact any more
PI_2 = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)


@part
def _sine(y, z):
    tail = 2.75573137070700676789e-6 + z * (
        -2.50507602534068634195e-8 + z * 1.58969099521155010221e-10
    )
    return y + y * z * (
        -1.66666666666666324348e-1
        + z * (8.33333333332248946124e-3 + z * (-1.98412698298579493134e-4 + z * tail))
    )


@part
def _cosine(z):
    tail = -2.75573143513906633035e-7 + z * (
        2.08757232129817482790e-9 - z * 1.13596475577881948265e-11
    )
    return (1.0 - 0.5 * z) + z * z * (
        4.16666666666666019037e-2
        + z * (-1.38888888888741095749e-3 + z * (2.48015872894767294178e-5 + z * tail))
    )


@part
def _library_cos_sin(x, c, s):
    """Return cosine and sine with those of large arguments computed number by number."""
    for i in range(WIDTH):
        if abs(get_lane(x, i)) > LARGE:
            c = replace_lane(c, i, math.cos(get_lane(x, i)))
            s = replace_lane(s, i, math.sin(get_lane(x, i)))
    return c, s


@part
def near_cos_sin(x):
    """Return cos(x) and sin(x) of lanes that are not `is_large_angle`, in radians, without a call."""
    k = floor(x * (2.0 / math.pi) + 0.5)
    y = ((x - k * PI_2[0]) - k * PI_2[1]) - k * PI_2[2]
    z = y * y
    s, c = _sine(y, z), _cosine(z)
    quadrant = k - 4.0 * floor(k * 0.25)
    odd = (quadrant == 1.0) | (quadrant == 3.0)
    sine, cosine = where(odd, c, s), where(odd, s, c)
    below, left = quadrant > 1.5, (quadrant == 1.0) | (quadrant == 2.0)
    return where(left, -cosine, cosine), where(below, -sine, sine)


@part
def is_large_angle(x):
    """Return in which lanes an angle is left to the library."""
    return absolute(x) > LARGE


@kernel
def cos_sin(x):
    """Return cos(x) and sin(x) of lanes, in radians."""
    c, s = near_cos_sin(x)
    if any_lane(is_large_angle(x)):
        return _library_cos_sin(x, c, s)
    return c, s
