"""The models of a lens: names and number of their coefficients, valid radius, derivatives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.kernels.formulas.perspective import BROWN, FISHEYE

Rates = list[tuple[Array, Array]]  # derivatives of both coordinates by the coefficients
TINY = 1e-30  # smaller coefficients of a polynomial count as zero


@dataclass(frozen=True)
class LensModel:
    """A model of the distortion of a lens.

    `aliases` are its names in other programs, in lower case.

    `find_radius` returns the valid radius, and `find_rates` the derivatives of distorted points, of
    eight coefficients: coefficients that a model does not have are zero.
    """

    name: str
    kind: int  # of lens in the kernels
    names: tuple[str, ...]  # coefficients in the order of `Camera.distortion`
    counts: tuple[int, ...]  # valid numbers of coefficients
    phrase: str  # these numbers in words
    aliases: tuple[str, ...]
    find_radius: Callable[[Array], float]
    find_rates: Callable[[Array, Array], Rates]


def find_brown_radius(lens: Array) -> float:
    """Return the largest normalised radius with monotonic distortion, for eight coefficients.

    The radius is the smallest positive root of d/dr (r N(r^2) / D(r^2)) and of D, with the
    numerator N and the denominator D of the radial distortion. It is infinite without a root.

    >>> round(find_brown_radius(np.array([-0.3, 0, 0, 0, 0, 0, 0, 0])), 4)
    1.0541
    """
    k1, k2, _, _, k3, k4, k5, k6 = lens
    over, under = Polynomial([1, k1, k2, k3]), Polynomial([1, k4, k5, k6])
    t = Polynomial([0, 1])  # r squared
    slope = over * under + 2 * t * (over.deriv() * under - over * under.deriv())
    roots = np.concatenate([slope.trim(TINY).roots(), under.trim(TINY).roots()])
    return float(np.sqrt(_find_least_positive(roots)))


def find_fisheye_radius(lens: Array) -> float:
    """Return the largest normalised radius of monotonic images by a fisheye lens.

    The angle theta of this radius tan(theta) is the smallest positive root of the derivative of
    theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8). The radius is infinite without a
    root below 90 degrees.

    >>> round(find_fisheye_radius(np.array([-0.2, 0, 0, 0])), 4)
    3.4802
    """
    slope = Polynomial([1, *(np.array([3, 5, 7, 9]) * lens[:4])])
    theta = np.sqrt(_find_least_positive(slope.trim(TINY).roots()))
    return float(np.tan(theta)) if theta < np.pi / 2 else np.inf


def _find_least_positive(roots: NDArray[Any]) -> float:
    """Return the smallest real and positive root, or infinity."""
    real = roots[(np.abs(roots.imag) < 1e-12) & (roots.real > 0)].real
    return float(real.min()) if real.size else np.inf


def find_brown_rates(x: Array, lens: Array) -> Rates:
    """Return the derivatives of distorted points by k1 k2 p1 p2 k3 k4 k5 k6, at points x."""
    k1, k2, _, _, k3, k4, k5, k6 = lens
    x, y = x[..., 0], x[..., 1]
    r2 = x * x + y * y
    under = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
    f = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / under
    radial = [r2**n / under for n in (1, 2, 3)]
    k1_2, k3_ = radial[:2], radial[2:]
    k4_6 = [-f * each for each in radial]
    tangential = [(2 * x * y, r2 + 2 * y * y), (r2 + 2 * x * x, 2 * x * y)]
    along = [(x * each, y * each) for each in (*k1_2, *k3_, *k4_6)]
    return [*along[:2], *tangential, *along[2:]]


def find_fisheye_rates(x: Array, lens: Array) -> Rates:
    """Return the derivatives of images by k1 k2 k3 k4 of a fisheye lens, at points x."""
    x, y = x[..., 0], x[..., 1]
    r = np.hypot(x, y)
    theta = np.arctan(r)
    over = np.divide(theta, r, out=np.ones_like(r), where=r > 0.0)  # theta / r
    return [(x * each, y * each) for each in (over * theta ** (2 * n) for n in (1, 2, 3, 4))]


LENS_MODELS = {
    model.name: model
    for model in (
        LensModel(
            "perspective",
            BROWN,
            ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
            (0, 4, 5, 8),
            "0, 4 (k1 k2 p1 p2), 5 (.. k3) or 8 (.. k4 k5 k6) numbers",
            ("plumb_bob", "rational_polynomial", "radtan", "brown_conrady"),
            find_brown_radius,
            find_brown_rates,
        ),
        LensModel(
            "fisheye",
            FISHEYE,
            ("k1", "k2", "k3", "k4"),
            (0, 4),
            "0 or 4 numbers (k1 k2 k3 k4) of a fisheye lens",
            ("equidistant", "kannala_brandt", "kannala_brandt4", "opencv_fisheye"),
            find_fisheye_radius,
            find_fisheye_rates,
        ),
    )
}


def find_lens_model(word: str) -> str | None:
    """Return the name of a model from its name in any program, or None.

    >>> find_lens_model("Equidistant")
    'fisheye'
    """
    plain = word.strip().lower()
    names = (name for name, model in LENS_MODELS.items() if plain in (name, *model.aliases))
    return next(names, None)
