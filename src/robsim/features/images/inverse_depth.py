"""The inverse depth of a plane in a picture."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array

FLAT = 1e-9  # determinant below which marks lie on one line of the image


def fit_inverse_depth(points: Array, depth: Array) -> Array:
    """Return the coefficients (3, B) of the inverse depth of a plane through marks.

    The inverse depth of a plane is linear in the normalised point,

        1/Z = a x + b y + c.

    The coefficients (a, b, c) are the least-squares fit to the marks; marks on one line, or less
    than three marks, give the plane parallel to the image at their mean inverse depth.

    Parameters
    ----------
    points : ndarray of shape (N, 2, B)
        Normalised points of the marks.
    depth : ndarray of shape (N, B)
        Depths of the marks in metres.

    Returns
    -------
    ndarray of shape (3, B)
        The coefficients in 1/m.

    Examples
    --------
    >>> points = np.array([[0.0, 0.0], [0.1, 0.0], [0.0, 0.1], [0.1, 0.1]])[..., None]
    >>> fit_inverse_depth(points, np.array([[1.0], [1.0], [0.5], [0.5]])).ravel().round(9)
    array([ 0., 10.,  1.])
    """
    with np.errstate(all="ignore"):  # a mark may be in the plane of the camera
        return _fit_plane(points, 1.0 / depth)


def _fit_plane(points: Array, near: Array) -> Array:
    """Return the coefficients (3, B) of the inverse depths (N, B) of marks."""
    mean, centre = _average(near), [_average(points[:, i]) for i in (0, 1)]
    x, y = (points[:, i] - centre[i] for i in (0, 1))
    z = near - mean
    xx, xy, yy, xz, yz = (
        _average(one * two) for one, two in ((x, x), (x, y), (y, y), (x, z), (y, z))
    )
    determinant = xx * yy - xy * xy
    flat = ~(determinant > FLAT * (xx + yy) ** 2)
    divisor = np.where(flat, 1.0, determinant)
    a = np.where(flat, 0.0, (yy * xz - xy * yz) / divisor)
    b = np.where(flat, 0.0, (xx * yz - xy * xz) / divisor)
    return np.stack([a, b, mean - a * centre[0] - b * centre[1]])


def _average(values: Array) -> Array:
    """Return the means (B,) of values (N, B), summed one by one for equal bits in any batch."""
    total = np.zeros(values.shape[1])
    for each in values:
        total = total + each
    return total / len(values)
