"""Weighted moments of the grey values of a picture."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass, field
from math import fsum, sqrt
from typing import Annotated, Self

import numpy as np

from robsim.base.arrays import Array, make_read_only
from robsim.base.value import replace_unchecked
from robsim.declare import Integer, Word, register
from robsim.features.feature import Observation
from robsim.features.images.goal_pictures_of_runs import get_inverse_depth
from robsim.features.images.linear_feature import LinearFeature
from robsim.features.images.picture_plane import PicturePlane, Pixels
from robsim.features.moments import measure_head
from robsim.kernels.features import moment_features as features
from robsim.kernels.formulas.image_moments import ORDER_3, moment_powers
from robsim.kernels.image_features.photometric_moments import centre_moments

FORMS = ("plain", "decoupled")


@register("feature", "photometric_moments")
@dataclass(frozen=True, eq=False)
class PhotometricMoments(LinearFeature):
    """Weighted moments of the grey values of a picture.

    The moments of the picture I, with a window w that vanishes at the border, are

        m_ij = 1/N sum over the pixels of w x^i y^j I,    w = (1 - X^2) (1 - Y^2),

    with X and Y from -1 to 1 inside the border. They are linear in the grey values, and the window
    keeps out texture that enters at the border, so that their L holds also for large motions
    (Bakthavatchalam, Tahri and Chaumette 2018, "A direct dense visual servoing approach using
    photometric moments", IEEE T-RO 34(5), with another window).

    ``form="plain"`` takes the combinations of moments with i + j <= `order` whose weights of the
    pixels are orthonormal, times the root of 1/N, so that all have the same noise: w P_i(X) P_j(Y)
    with polynomials P_i of degree i. It suits a picture that fills the view.
    ``form="decoupled"`` takes the six numbers of `DecoupledMoments`, (xn, yn, an, Px, Py, alpha),
    of the moments up to the third order. They move the camera nearly straight, but need a bright
    object before a dark ground, and a `tolerance` of about 1e-5: the size of a picture that fills
    the view hardly depends on its distance, and a centre of gravity in the middle hardly moves.

    Plain moments have the largest basin with ``interaction="mean"``, and a small one with L of the
    goal; decoupled ones are nearly linear, and do well with both. A body before the object, and
    light that changes, shift all of them.

    Raises
    ------
    GoalError
        By `simulate`, if the picture at the goal is constant.

    Examples
    --------
    >>> from robsim.features.feature import Observation
    >>> from robsim.vision.camera import Camera
    >>> camera = Camera([[40, 0, 19.5], [0, 40, 14.5], [0, 0, 1]], size=(40, 30))
    >>> y, x = np.mgrid[:30, :40]
    >>> blob = np.rint(250 * np.exp(-((x - 21.5) ** 2 + (y - 14.5) ** 2) / 18)).astype(np.uint8)
    >>> corners = [[10, 10], [30, 10], [30, 20], [10, 20]]
    >>> seen = Observation.of(corners, np.full(4, 2.0), camera, pictures=blob)
    >>> s = PhotometricMoments(form="decoupled").towards(seen).measure(seen)
    >>> s[0, :3].round(2) + 0.0  # at (2 px / 40 px) 2 m, nearly: the window moves the centre
    array([0.09, 0.  , 2.  ])
    """

    _: KW_ONLY
    form: Annotated[
        str,
        Word(FORMS, "form"),
        "Orthonormal moments, or six numbers that each describe one motion of a bright object.",
    ] = "plain"
    order: Annotated[int, Integer(2, 12), "Largest order of the plain moments."] = 4
    # (7, B): size, depth, angle and head at the goal, for "decoupled"
    size_goal: Array | None = field(default=None, init=False, repr=False)

    @property
    def unit(self) -> str:
        """Unit of s."""
        return "grey" if self.form == "plain" else "m, 1, rad"

    def build_basis(self, plane: PicturePlane, image: Pixels, inverse_depth: Array) -> Array:
        """Return the weights (k, N) of the moments."""
        height, width = (side - 2 * plane.border for side in plane.size)
        if self.form == "plain":
            down, across = (_build_polynomials(side, self.order) for side in (height, width))
            pairs = [(n - j, j) for n in range(self.order + 1) for j in range(n + 1)]
            rows = [np.multiply.outer(down[j], across[i]).ravel() for i, j in pairs]
            basis: Array = np.stack(rows) / np.sqrt(height * width)
            return basis
        x, y = plane.points.astype(float)
        down, across = (_build_window(side) for side in (height, width))
        window = np.multiply.outer(down, across).ravel() / (height * width)
        powers = [moment_powers(k) for k in range(ORDER_3)]
        return np.stack([window * x**i * y**j for i, j in powers])

    def towards(self, goal: Observation) -> Self:
        """Return the feature with the picture, size, depth and orientation at the goal."""
        at_goal = super().towards(goal)
        if self.form == "plain":
            return at_goal
        centre, mu, _ = at_goal._centre(goal)
        s = np.empty((4, mu.shape[1]))
        features.basic_moments(False, centre, mu, s)
        near = get_inverse_depth(goal).T
        Z = 1.0 / (near[0] * centre[0] + near[1] * centre[1] + near[2])
        shown = make_read_only(np.stack([s[0], Z, s[3], *measure_head(mu, s[3])]))
        return replace_unchecked(at_goal, size_goal=shown)

    def measure(self, seen: Observation) -> Array:
        """Return the moments (B, 10), or their six numbers (B, 6)."""
        if self.form == "plain":
            return super().measure(seen)
        centre, mu, _ = self._centre(seen)
        return np.ascontiguousarray(self._decouple(seen, centre, mu).T)

    def interaction(self, seen: Observation) -> Array:
        """Return the interaction matrix (B, 10, 6) or (B, 6, 6)."""
        if self.form == "plain":
            return super().interaction(seen)
        centre, mu, R = self._centre(seen)
        s, L = self._decouple(seen, centre, mu), np.empty((6, 6, mu.shape[1]))
        features.decoupled_moment_rates(False, centre, mu, R, s, L)
        return np.ascontiguousarray(np.moveaxis(L, -1, 0))

    def _centre(self, seen: Observation) -> tuple[Array, Array, Array]:
        """Return centres (2, B), centred moments (10, B) and their rates (10, 6, B)."""
        m, Lm = super().measure(seen), super().interaction(seen)
        B = len(m)
        centre, mu, R = np.empty((2, B)), np.empty((ORDER_3, B)), np.empty((ORDER_3, 6, B))
        centre_moments(m, Lm, centre, mu, R)
        return centre, mu, R

    def _decouple(self, seen: Observation, centre: Array, mu: Array) -> Array:
        """Return the six numbers (6, B), with the angle near its value at the goal."""
        B, goal = mu.shape[1], self.size_goal
        shown = np.ones((3, B)) if goal is None else _select_columns(goal, seen, B)
        s = np.empty((6, B))
        features.decoupled_moments(False, shown[0], shown[1], centre, mu, s)
        if goal is not None:
            features.within_quarter_turn(shown[2], s[5])
            if shown[3:].any():
                features.resolve_half_turn(shown[2], shown[3:], mu, s[5])
        return s


def _select_columns(goal: Array, seen: Observation, count: int) -> Array:
    """Return the columns (7, B) of the goals of the observed runs."""
    if goal.shape[1] == 1:
        return np.ascontiguousarray(np.broadcast_to(goal, (len(goal), count)))
    return np.ascontiguousarray(goal if seen.runs is None else goal[:, seen.runs])


def _build_window(count: int) -> Array:
    """Return the window 1 - X^2 at the centres of pixels that divide -1 to 1."""
    return 1.0 - _find_places(count) ** 2


def _find_places(count: int) -> Array:
    """Return the centres X of pixels that divide -1 to 1."""
    places: Array = (2.0 * np.arange(count) + 1.0) / count - 1.0
    return places


def _build_polynomials(count: int, order: int) -> Array:
    """Return the window times polynomials (order + 1, count), orthonormal at the pixels.

    Sums are exact before they are rounded, so that the bits are the same on every machine.
    """
    X, rows = _find_places(count), [_build_window(count)]
    for _ in range(order):
        rows.append(X * rows[-1])
        for k in range(len(rows)):
            for other in rows[:k]:
                rows[k] = rows[k] - fsum(rows[k] * other) * other
            rows[k] = rows[k] / sqrt(fsum(rows[k] * rows[k]))
    return np.stack(rows)
