"""The lowest cosine coefficients of a picture."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import GoalError
from robsim.declare import Integer, register
from robsim.features.images.linear_feature import LinearFeature
from robsim.features.images.picture_plane import PicturePlane, Pixels


@register("feature", "cosine_coefficients")
@dataclass(frozen=True, eq=False)
class CosineCoefficients(LinearFeature):
    """The lowest coefficients of the discrete cosine transform of a picture.

    With w x h pixels inside the border, the coefficient of the frequencies (p, q) is

        s_pq = a_p a_q / sqrt(w h) sum I(u, v) cos(pi (2u + 1) p / 2w) cos(pi (2v + 1) q / 2h)

    with a_0 = 1/sqrt(w or h) and a_p = sqrt(2/w or 2/h): the coefficient of an orthonormal basis
    over the root of the number of pixels, so that the sum of all squares is the mean of I^2. The
    coefficients are the lowest in the zigzag order of JPEG, (1, 0), (0, 1), (0, 2), (1, 1),
    (2, 0), ..., without the mean (0, 0), which the brightness of the light changes. L is the
    transform of the columns of the interaction matrix of the luminance (Marchand 2020, "Direct
    visual servoing in the frequency domain", IEEE RA-L 5(2)).

    Few coefficients are a low-pass filter: they widen the basin of the luminance, and reduce noise
    and fine texture. The basis needs no learning. It sees the border of the picture: texture that
    enters changes all coefficients, so that large motions mislead it as they mislead the luminance.

    Raises
    ------
    GoalError
        By `simulate`, if the picture at the goal is constant, or has too few pixels.

    Examples
    --------
    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> camera = Camera([[40, 0, 19.5], [0, 40, 14.5], [0, 0, 1]], size=(40, 30))
    >>> wave = np.cos(np.pi * (2 * np.arange(32) + 1) * 2 / 64)  # two half waves inside the border
    >>> picture = np.full((30, 40), 128, dtype=np.uint8)
    >>> picture[:, 4:36] = np.rint(128 + 100 * wave)
    >>> seen = Observation.of([[20, 15]], [1.0], camera, pictures=picture)
    >>> CosineCoefficients(coefficients=5).towards(seen).measure(seen).round(0) + 0.0
    array([[ 0.,  0.,  0.,  0., 71.]])
    """

    _: KW_ONLY
    coefficients: Annotated[int, Integer(1, 1000), "Number of coefficients, without the mean."] = 20

    def build_basis(self, plane: PicturePlane, image: Pixels, inverse_depth: Array) -> Array:
        """Return the basis (k, N) of the lowest frequencies."""
        height, width = (side - 2 * plane.border for side in plane.size)
        if self.coefficients >= height * width:
            raise GoalError(
                f"CosineCoefficients: {self.coefficients} coefficients of {width} x {height} pixels"
            )
        across, down = _build_cosines(width), _build_cosines(height)
        pairs = [
            (p, q) for p, q in _list_zigzag(height + width) if p < width and q < height and p + q
        ][: self.coefficients]
        rows = [np.multiply.outer(down[q], across[p]).ravel() for p, q in pairs]
        basis: Array = np.stack(rows) / np.sqrt(height * width)
        return basis


def _build_cosines(count: int) -> Array:
    """Return the orthonormal cosines (count, count) of each frequency."""
    places = np.multiply.outer(np.arange(count), 2 * np.arange(count) + 1)
    rows: Array = np.sqrt(2.0 / count) * np.cos(np.pi / (2 * count) * places)
    rows[0] = np.sqrt(1.0 / count)
    return rows


def _list_zigzag(count: int) -> list[tuple[int, int]]:
    """Return the pairs (p, q) of frequencies in the order of JPEG, with sums below a number."""
    pairs = []
    for total in range(count):
        diagonal = [(total - q, q) for q in range(total + 1)]
        pairs += diagonal if total % 2 == 1 else diagonal[::-1]
    return pairs
