"""The covariance of a least-squares estimate with nonlinear residuals."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robsim.base.arrays import Array

STEP, STEPS = 1.25, 6  # step in standard deviations, and number of steps to either side
ROUNDS = 3  # chord steps for the other coordinates
_AXIS = STEP * np.arange(-STEPS, STEPS + 1)
GRID = np.stack(np.meshgrid(_AXIS, _AXIS), axis=-1).reshape(-1, 2)


def second_moment(residuals: Callable[[Array], Array], back: Array) -> Array:
    """Return E[z z'] (B, k, k) for the density exp(-|r(z)|^2 / 2) of z, which is nearly N(0, I).

    The estimate is z = 0. `residuals` returns the residuals r (B, n, m), in standard deviations, at
    n points z (B, n, k). `back` (B, k, m) is the linear map from residuals to the estimate, dz =
    back r.

    The last two coordinates are integrated over a grid. At every node of the grid, chord steps move
    the other coordinates to the minimum of |r| (a profile likelihood), and their variance about the
    minimum is taken as one. Nodes with residuals that are not finite have weight zero.

    >>> second_moment(lambda z: np.array([z[0]]), -np.eye(3)[None]).round(3)[0].diagonal()
    array([1., 1., 1.])
    """
    z = np.zeros((len(back), len(GRID), back.shape[1]))
    z[..., -2:] = GRID
    others = np.swapaxes(back[:, :-2], 1, 2)
    for _ in range(ROUNDS):
        z[..., :-2] += residuals(z) @ others
    squares = np.square(residuals(z)).sum(-1)
    squares = np.where(np.isfinite(squares), squares, np.inf)
    weights = np.exp((squares.min(1, keepdims=True) - squares) / 2)
    weights /= weights.sum(1, keepdims=True)
    z = np.where(weights[..., None] > 0, z, 0.0)
    moment = np.swapaxes(z, 1, 2) @ (weights[..., None] * z)
    moment[:, range(back.shape[1] - 2), range(back.shape[1] - 2)] += 1.0
    return np.asarray(moment)
