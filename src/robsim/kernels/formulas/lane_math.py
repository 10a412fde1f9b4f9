"""Elementary functions on lanes. The bits of a lane do not depend on its neighbours.

The logarithm scales its argument by powers of two to m, from sqrt(1/2) to sqrt(2), and evaluates
the polynomial of fdlibm (Sun Microsystems 1993) in (m - 1)/(m + 1). Sine and cosine reduce the
argument by multiples of pi/2 in three parts (Cody and Waite 1980) and evaluate the polynomials of
degree 13 and 14 of fdlibm. The arc tangent of y/x reduces the ratio of the smaller and the larger
number by the known angles 0, atan(1/2) and pi/4 and evaluates the polynomial of degree 23 of
fdlibm. Logarithm, sine and cosine are correct to one unit in the last place, the arc tangent to
two. For large angles the reduction would lose digits, so the library computes them, number by
number.
"""

import math

from robsim.kernels.machine.intrinsics import fragment
from robsim.kernels.machine.kernel import kernel, part
from robsim.kernels.machine.lanes import (
    WIDTH,
    absolute,
    any_lane,
    copy_sign,
    floor,
    get_lane,
    replace_lane,
    where,
)

LARGE = 1e5  # radians: for larger arguments k * PI_2[0] is not exact
LN_2, ROOT_2 = (6.93147180369123816490e-01, 1.90821492927058770002e-10), math.sqrt(2.0)
PI_4 = 7.85398163397448278999e-01, 3.06161699786838301793e-17
ATAN_HALF = 4.63647609000806093515e-01, 2.26987774529616870924e-17
PI_2 = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)


@part
def _sine(y, z):
    """Return sin(y) for |y| <= pi/4 and z = y^2."""
    tail = 2.75573137070700676789e-6 + z * (
        -2.50507602534068634195e-8 + z * 1.58969099521155010221e-10
    )
    return y + y * z * (
        -1.66666666666666324348e-1
        + z * (8.33333333332248946124e-3 + z * (-1.98412698298579493134e-4 + z * tail))
    )


@part
def _cosine(z):
    """Return cos(y) for |y| <= pi/4 and z = y^2."""
    tail = -2.75573143513906633035e-7 + z * (
        2.08757232129817482790e-9 - z * 1.13596475577881948265e-11
    )
    return (1.0 - 0.5 * z) + z * z * (
        4.16666666666666019037e-2
        + z * (-1.38888888888741095749e-3 + z * (2.48015872894767294178e-5 + z * tail))
    )


@part
def _library_cos_sin(x, c, s):
    """Return c and s with the lanes of large arguments replaced by the library's results."""
    for i in range(WIDTH):
        if abs(get_lane(x, i)) > LARGE:
            c = replace_lane(c, i, math.cos(get_lane(x, i)))
            s = replace_lane(s, i, math.sin(get_lane(x, i)))
    return c, s


@part
def near_cos_sin(x):
    """Return cos(x) and sin(x) of lanes, in radians. No lane may be `is_large_angle`."""
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
    """Return the mask of lanes with large angles, which the library computes."""
    return absolute(x) > LARGE


@kernel
def cos_sin(x):
    """Return cos(x) and sin(x) of lanes, in radians."""
    c, s = near_cos_sin(x)
    if any_lane(is_large_angle(x)):
        return _library_cos_sin(x, c, s)
    return c, s


@part
def _arc_tangent_tail(z):
    """Return (t - atan(t)) / t for |t| <= 7/16 and z = t^2."""
    w = z * z
    odd = 4.97687799461593236017e-2 + w * 1.62858201153657823623e-2
    odd = 9.09088713343650656196e-2 + w * (6.66107313738753120669e-2 + w * odd)
    odd = 3.33333333333329318027e-1 + w * (1.42857142725034663711e-1 + w * odd)
    even = -5.83357013379057348645e-2 - w * 3.65315727442169155270e-2
    even = -1.11111104054623557880e-1 + w * (-7.69187620504482999495e-2 + w * even)
    return z * odd + w * (-1.99999999998764832476e-1 + w * even)


@part
def _arc_tangent_of_ratio(y, x):
    """Return atan(y / x) for 0 <= y <= x, and 0 for y = x = 0."""
    is_middle, is_large = y > 0.4375 * x, y > 0.6875 * x
    over = where(is_large, y - x, where(is_middle, 2.0 * y - x, y))
    under = where(is_large, y + x, where(is_middle, 2.0 * x + y, x))
    t = over / where(under == 0.0, 1.0, under)
    angle = where(is_large, PI_4[0], where(is_middle, ATAN_HALF[0], 0.0))
    rest = where(is_large, PI_4[1], where(is_middle, ATAN_HALF[1], 0.0))
    return angle - ((t * _arc_tangent_tail(t * t) - rest) - t)


@fragment
def arc_tangent(y, x):
    """Return the angle of (x, y) on lanes or of two numbers, from -pi to pi, as atan2(y, x).

    It is 0 for x = y = 0, and NaN if both are infinite.
    """
    up, right = absolute(y), absolute(x)
    is_steep, is_left = up > right, x < 0.0
    angle = _arc_tangent_of_ratio(where(is_steep, right, up), where(is_steep, up, right))
    turned = where(is_steep, 2.0 * PI_4[0], where(is_left, 4.0 * PI_4[0], 0.0))
    rest = where(is_steep, 2.0 * PI_4[1], where(is_left, 4.0 * PI_4[1], 0.0))
    signed = where(is_left, -angle, angle)
    return copy_sign(turned + (where(is_steep, -signed, signed) + rest), y)


@part
def _scale_up(m, k, factor, power):
    """Multiply lanes by factor = 2^power if this keeps them below sqrt(2), and subtract from k."""
    scaled = m * factor
    small = scaled < ROOT_2
    return where(small, scaled, m), where(small, k - power, k)


@kernel
def log_of_fraction(x):
    """Return the natural logarithm of lanes between 2^-63 and 1."""
    m, k = _scale_up(x, 0.0 * x, 2.0**32, 32.0)
    m, k = _scale_up(m, k, 2.0**16, 16.0)
    m, k = _scale_up(m, k, 2.0**8, 8.0)
    m, k = _scale_up(m, k, 2.0**4, 4.0)
    m, k = _scale_up(m, k, 2.0**2, 2.0)
    m, k = _scale_up(m, k, 2.0, 1.0)  # x = m 2^k
    f = m - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    even = 3.999999999940941908e-1 + w * (2.222219843214978396e-1 + w * 1.531383769920937332e-1)
    odd = 2.857142874366239149e-1 + w * (1.818357216161805012e-1 + w * 1.479819860511658591e-1)
    rest = w * even + z * (6.666666666666735130e-1 + w * odd)
    half = 0.5 * f * f
    return k * LN_2[0] - ((half - (s * (half + rest) + k * LN_2[1])) - f)
