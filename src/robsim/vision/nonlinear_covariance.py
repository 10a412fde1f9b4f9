"""The covariance of a least-squares estimate with nonlinear residuals."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array

STEP, STEPS = 1.25, 6  # step in standard deviations, and number of steps to either side
ROUNDS = 3  # chord steps for the other coordinates
GRIDS = 12  # most grids, each finer than the one before
FEWEST_NODES = 6.0  # effective number of nodes below which a grid is too coarse; 8 for N(0, I)
FINER = 0.6  # step of a finer grid relative to the step for a normal distribution
_AXIS = STEP * np.arange(-STEPS, STEPS + 1)
Rows = NDArray[np.intp]
GRID = np.stack(np.meshgrid(_AXIS, _AXIS), axis=-1).reshape(-1, 2)


def second_moment(residuals: Callable[[Rows, Array], Array], back: Array) -> Array:
    """Return E[z z'] (B, k, k) for the density exp(-|r(z)|^2 / 2) of z, which is nearly N(0, I).

    The estimate is z = 0. `residuals` returns the residuals r (R, n, m), in standard deviations, at
    n points z (R, n, k) of some of the estimates, by their numbers (R,). `back` (B, k, m) is the
    linear map from residuals to the estimate, dz = back r.

    The last two coordinates are integrated over a grid. At every node of the grid, chord steps move
    the other coordinates to the minimum of |r| (a profile likelihood), and their variance about the
    minimum is taken as one. Nodes with residuals that are not finite have weight zero.

    A likelihood that is narrower than the step of the grid leaves few nodes, and the moment of one
    or two nodes is singular. A finer grid along the axes of the nodes then replaces the grid. The
    moment is positive definite.

    >>> second_moment(lambda rows, z: np.array([z[0]]), -np.eye(3)[None]).round(3)[0].diagonal()
    array([1., 1., 1.])
    """
    B, k, _ = back.shape
    moment, rows = np.empty((B, k, k)), np.arange(B)
    middle, axes = np.zeros((B, 2)), np.tile(np.eye(2), (B, 1, 1))
    for _ in range(GRIDS):
        z, weights = _integrate(partial(residuals, rows), back[rows], middle, axes)
        moment[rows] = np.swapaxes(z, 1, 2) @ (weights[..., None] * z)
        coarse = FEWEST_NODES * np.square(weights).sum(1) > 1.0
        if not coarse.any():
            break
        rows, axes = rows[coarse], axes[coarse]
        middle, axes, variance = _refine_grid(z[coarse], weights[coarse], axes)
        moment[rows, -2:, -2:] += variance  # remains if the last grid is too coarse
    moment[:, range(k - 2), range(k - 2)] += 1.0
    return moment


def _integrate(
    residuals: Callable[[Array], Array], back: Array, middle: Array, axes: Array
) -> tuple[Array, Array]:
    """Return the nodes z (B, n, k) of grids, and their weights (B, n), of sum 1.

    The grid of the last two coordinates is middle (B, 2) + axes (B, 2, 2) GRID.
    """
    z = np.zeros((len(back), len(GRID), back.shape[1]))
    z[..., -2:] = middle[:, None] + GRID @ np.swapaxes(axes, 1, 2)
    others = np.swapaxes(back[:, :-2], 1, 2)
    for _ in range(ROUNDS):
        z[..., :-2] += residuals(z) @ others
    squares = np.square(residuals(z)).sum(-1)
    squares = np.where(np.isfinite(squares), squares, np.inf)
    weights = np.exp((squares.min(1, keepdims=True) - squares) / 2)
    weights /= weights.sum(1, keepdims=True)
    return np.where(weights[..., None] > 0, z, 0.0), weights


def _refine_grid(z: Array, weights: Array, axes: Array) -> tuple[Array, Array, Array]:
    """Return the middle (B, 2) and axes (B, 2, 2) of finer grids, and the variance of half a step.

    The axes follow the variance of the nodes and of half a step.
    """
    middle = (weights[..., None] * z[..., -2:]).sum(1)
    away = z[..., -2:] - middle[:, None]
    half_step = 0.25 * STEP**2 * axes @ np.swapaxes(axes, 1, 2)
    variance = np.swapaxes(away, 1, 2) @ (weights[..., None] * away) + half_step
    values, vectors = np.linalg.eigh(variance)
    return middle, FINER * vectors * np.sqrt(values)[:, None], half_step
