"""The equidistant fisheye lens of Kannala and Brandt 2006, as in OpenCV's module `fisheye`.

A ray at the angle theta to the optical axis has its image at the distance

    d(theta) = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)

from the principal point, at a focal length of 1, in the direction of the ray. `lens` holds (k1, k2,
k3, k4) first. The angle of a normalised point (x, y) is theta = atan(r) with r^2 = x^2 + y^2.
"""

import math

from robsim.kernels.machine.kernel import part

LEAST_SQUARE = 1e-40  # of a radius; below it the image of the lens is the point itself


@part
def fisheye_distance(theta, lens):
    """Return the distance d of the image from the principal point."""
    t = theta * theta
    return theta * (1.0 + t * (lens[0] + t * (lens[1] + t * (lens[2] + t * lens[3]))))


@part
def fisheye_slope(theta, lens):
    """Return the derivative of the distance by theta."""
    t, k1, k2, k3, k4 = theta * theta, lens[0], lens[1], lens[2], lens[3]
    return 1.0 + t * (3.0 * k1 + t * (5.0 * k2 + t * (7.0 * k3 + t * 9.0 * k4)))


@part
def distort_fisheye(x, y, lens):
    """Return the image of the normalised point (x, y), which is the point if r^2 overflows."""
    r = math.sqrt(x * x + y * y)
    scale = fisheye_distance(math.atan(r), lens) / r if 0.0 < r < math.inf else 1.0
    return x * scale, y * scale


@part
def distort_fisheye_jacobian(x, y, lens):
    """Return (dx'/dx, dx'/dy, dy'/dy) of `distort_fisheye`; dy'/dx equals dx'/dy."""
    r2 = x * x + y * y
    if r2 < LEAST_SQUARE:
        return 1.0, 0.0, 1.0
    theta, r = math.atan(math.sqrt(r2)), math.sqrt(r2)
    scale = fisheye_distance(theta, lens) / r
    change = (fisheye_slope(theta, lens) / (1.0 + r2) - scale) / r2
    return scale + x * x * change, x * y * change, scale + y * y * change


@part
def undistort_fisheye(u, v, lens, radius):
    """Return the point within a radius that `distort_fisheye` maps to (u, v), or NaN.

    The distance grows up to this radius. Newton's method finds theta; a step that leaves the bounds
    of the solution is replaced by a bisection.
    """
    distance, low, high = math.hypot(u, v), 0.0, math.atan(radius)
    if not distance <= fisheye_distance(high, lens):
        return math.nan, math.nan
    theta = min(distance, high)
    for _ in range(100):
        excess = fisheye_distance(theta, lens) - distance
        if excess > 0.0:
            high = theta
        else:
            low = theta
        last, theta = theta, theta - excess / fisheye_slope(theta, lens)
        if not (low <= theta <= high):
            theta = 0.5 * (low + high)
        if abs(theta - last) <= 2e-16 * theta:
            break
    scale = math.tan(theta) / distance if distance > 0.0 else 1.0
    return u * scale, v * scale
