"""Coordinates of a robot at the poses of a region that are nearest to drawn poses.

Each step of the search reduces the errors of a region by Gauss and Newton's method, in order of
their priority: the errors of a lower priority are reduced by the motions that change no error of
a higher one (Y. Nakamura, H. Hanafusa and T. Yoshikawa, Task-priority based redundancy control of
robot manipulators, Int. J. Robotics Research 6(2), 1987). Each row has the same bits in every
batch: matrices are decomposed one by one, and sums have a fixed order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.starts.pose_regions import PoseRegion

STEPS = 20  # most steps of a search
LAST_STEPS = 8  # the last steps reduce the errors of the first priority only
DIFFERENCE = 1e-6  # metres and radians, step of difference quotients
LONGEST_STEP = 0.5  # metres and radians
STILL = 1e-10  # a search ends with a shorter step
LEAST_EFFECT = 1e-3  # singular values below it count as zero
LEAST_SLOPE = 1e-6  # smaller derivatives of half the squared error count as zero


@dataclass(frozen=True, eq=False)
class NearestPoseSearch:
    """Search for coordinates of a robot with poses near to drawn poses.

    Parameters
    ----------
    pose : callable
        Function from coordinates (n, nq) to poses (n, 4, 4) of the frame.
    region : PoseRegion
        Errors of poses.
    columns : ndarray of int
        Coordinates that the search may change.
    limits : ndarray of shape (nq, 2)
        Limits of all coordinates.
    """

    pose: Callable[[Array], Array]
    region: PoseRegion
    columns: NDArray[np.int64]
    limits: Array

    def run(self, q: Array, drawn: Array) -> Array:
        """Return coordinates (n, nq) near to drawn poses (n, 4, 4), from guesses q (n, nq)."""
        q, moving = q.copy(), np.arange(len(q))
        low, high = self.limits[self.columns].T
        for i in range(STEPS):
            errors, rates = self._linearise(q[moving], drawn[moving])
            count = 1 if i >= STEPS - LAST_STEPS else len(errors)
            here = q[np.ix_(moving, self.columns)]
            step = self._limited_step(here, errors[:count], rates[:count])
            there = np.clip(here + step, low, high)
            q[np.ix_(moving, self.columns)] = there
            moving = moving[np.abs(there - here).max(axis=1) > STILL]
            if not moving.size:
                break
        return make_read_only(q)

    def is_stationary(self, q: Array, drawn: Array) -> NDArray[np.bool_]:
        """Return whether no small motion from q (n, nq) reduces the first errors."""
        errors, rates = self._linearise(q, drawn)
        slopes = _multiply(np.swapaxes(rates[0], 1, 2), errors[0])
        return np.asarray(np.abs(slopes).max(axis=1) < LEAST_SLOPE)

    def lacks_motions(self, q: Array, drawn: Array) -> bool:
        """Return whether the errors of the first priority are dependent at all q (n, nq)."""
        _, (rates, *_) = self._linearise(q, drawn)
        sigma = np.linalg.svd(rates, compute_uv=False)
        return bool(((sigma > LEAST_EFFECT).sum(axis=1) < rates.shape[1]).all())

    def _linearise(self, q: Array, drawn: Array) -> tuple[list[Array], list[Array]]:
        """Return the errors (n, k) of each priority, and their rates (n, k, columns)."""
        count = 1 + 2 * len(self.columns)
        near = np.repeat(q[:, None], count, axis=1)
        for j, column in enumerate(self.columns.tolist()):
            near[:, 1 + 2 * j, column] += DIFFERENCE
            near[:, 2 + 2 * j, column] -= DIFFERENCE
        T = self.pose(near.reshape(-1, q.shape[1]))
        every = self.region.errors(T, np.repeat(drawn, count, axis=0))
        errors = [error.reshape(len(q), count, -1) for error in every]
        rates = [(e[:, 1::2] - e[:, 2::2]) / (2.0 * DIFFERENCE) for e in errors]
        return [e[:, 0] for e in errors], [np.swapaxes(rate, 1, 2) for rate in rates]

    def _limited_step(self, q: Array, errors: list[Array], rates: list[Array]) -> Array:
        """Return a step (n, columns) that does not push coordinates against their limits."""
        low, high = self.limits[self.columns].T
        step = _prioritised_step(errors, rates)
        held = ((q <= low) & (step < 0)) | ((q >= high) & (step > 0))
        some = np.flatnonzero(held.any(axis=1))
        if some.size:
            free = ~held[some][:, None]
            step[some] = _prioritised_step(
                [error[some] for error in errors], [rate[some] * free for rate in rates]
            )
        longest = np.abs(step).max(axis=1, keepdims=True)
        return np.asarray(step * np.minimum(1.0, LONGEST_STEP / np.maximum(longest, 1e-300)))


def _prioritised_step(errors: list[Array], rates: list[Array]) -> Array:
    """Return the step (n, columns) that reduces errors in order of their priority."""
    n, columns = len(errors[0]), rates[0].shape[2]
    step, free = np.zeros((n, columns)), np.tile(np.eye(columns), (n, 1, 1))
    for error, rate in zip(errors, rates, strict=True):
        rest = error + _multiply(rate, step)
        effect = sum(rate[:, :, j, None] * free[:, None, j] for j in range(columns))
        U, sigma, Vt = np.linalg.svd(effect, full_matrices=False)
        used = sigma > LEAST_EFFECT
        along = -_multiply(np.swapaxes(U, 1, 2), rest) * used / np.where(used, sigma, 1.0)
        directions = Vt * used[:, :, None]
        step += _multiply(np.swapaxes(directions, 1, 2), along)
        free -= sum(v[:, :, None] * v[:, None, :] for v in np.moveaxis(directions, 1, 0))
    return step


def _multiply(A: Array, x: Array) -> Array:
    """Return the products (n, k) of matrices A (n, k, m) and vectors x (n, m)."""
    product = np.zeros(A.shape[:2])
    for j in range(x.shape[1]):
        product += A[:, :, j] * x[:, j, None]
    return product
