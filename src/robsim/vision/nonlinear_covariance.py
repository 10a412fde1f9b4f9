"""The spread of an estimate by least squares whose residuals are not linear."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from robsim.base.arrays import Array

STEP, STEPS = 1.25, 6  # standard deviations, and how many of them to either side
ROUNDS = 3  # of the search for the best of the other coordinates
_AXIS = STEP * np.arange(-STEPS, STEPS + 1)
GRID = np.stack(np.meshgrid(_AXIS, _AXIS), axis=-1).reshape(-1, 2)


def second_moment(residuals: Callable[[Array], Array], back: Array) -> Array:
    """Return E[z z'] (B, k, k) where z has the density exp(-|r(z)|^2 / 2), and nearly N(0, I).

    `residuals` gives r (B, n, m), in standard deviations, at z (B, n, k), the estimate being z = 0;
    `back` (B, k, m) is the linear map by which the estimate follows the residuals, dz = back r.
    The last two coordinates are summed over a grid, which for a density as smooth as this is as
    good as an integral; at every node the others are brought to their best by chord steps, with a
    variance of one about it (a profile likelihood). What is not finite has no weight.

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
