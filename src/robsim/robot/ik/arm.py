"""Problem of inverse kinematics: a link, and the joints that move it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.kernels.formulas import random
from robsim.robot.assembly import as_int64
from robsim.robot.frame_evaluator import FrameEvaluator
from robsim.robot.tree import Tree

# metres or radians: larger numbers could overflow; in files they mean that there is no limit
LARGEST_POSITION = 1e9
START_SPREAD = {"rad": math.pi, "m": 1.0}  # largest distance from home, for joints without limits


class CoordinateBounds(NamedTuple):
    """Limits of coordinates."""

    row: NDArray[np.int64]  # coordinate of each velocity that carries the link, or -1
    low: Array  # (nq,), infinite without a limit
    high: Array
    turns: NDArray[np.bool_]  # (nq,) whether a whole turn gives the same pose


@dataclass(frozen=True, eq=False)
class IKArm:
    """Problem of inverse kinematics for a link of a tree.

    Derived values are computed once, and the robot stores one problem for each link.
    """

    tree: Tree
    link: str
    limits: Array  # (nq, 2), infinite without limits
    home: Array
    units: Sequence[str]  # units of the coordinates
    velocities: Sequence[str]

    @cached_property
    def columns(self) -> NDArray[np.int64]:
        """Indices of the velocities that move the link."""
        return as_int64(np.flatnonzero(self.tree.flag_velocities(self.link)))

    @cached_property
    def free(self) -> IKArm:
        """Problem without joint limits."""
        unlimited = np.full_like(self.limits, np.inf) * [-1.0, 1.0]
        return IKArm(self.tree, self.link, unlimited, self.home, self.units, self.velocities)

    @cached_property
    def bounds(self) -> CoordinateBounds:
        """Limits; a joint without limits is kept within half a turn of zero."""
        row = self.tree.alone(self.columns)
        turns = np.zeros(len(self.limits), dtype=np.bool_)
        turning = np.array([kind.turns for kind in self.tree.kinds(self.columns)], dtype=np.bool_)
        turns[row[turning & (row >= 0)]] = True
        turns[[tie.source for tie in self.tree.joints.ties if tie.source < len(turns)]] = False
        endless = turns & np.isinf(self.limits).all(axis=1)
        low, high = self.limits.T.copy()
        low[endless], high[endless] = -math.pi, math.pi
        return CoordinateBounds(
            row, make_read_only(low), make_read_only(high), make_read_only(turns)
        )

    def starts(self, count: int, seed: int) -> tuple[Array, Array]:
        """Return random coordinates (nq, k) of further searches, and the poses (k, 12) of the link.

        The coordinates are uniform within the limits. They depend only on the seed and on their
        index, so each run has the same bits in every batch.
        """
        key, starts = self.cache.get("starts", (None, None))
        if key != (count, seed):
            starts = self._sample_starts(count, seed)
            self.cache["starts"] = (count, seed), starts  # only the latest starts are stored
        return starts  # type: ignore[no-any-return]

    def _sample_starts(self, count: int, seed: int) -> tuple[Array, Array]:
        """Return the coordinates and poses of `starts`."""
        bounds = self.bounds
        spread = np.array([START_SPREAD.get(unit, 0.0) for unit in self.units])
        low = np.where(bounds.low < -LARGEST_POSITION, self.home - spread, bounds.low)
        high = np.where(bounds.high > LARGEST_POSITION, self.home + spread, bounds.high)
        share = np.empty((len(low), count))
        random.fill_uniform_numbers(np.uint64(seed), np.arange(count, dtype=np.uint64), 0, 0, share)
        q = np.repeat(self.home[:, None], count, axis=1)
        rows = bounds.row[bounds.row >= 0]
        q[rows] = (low[:, None] + share * (high - low)[:, None])[rows]
        poses = np.empty((count, 4, 4))
        FrameEvaluator(self.tree, [self.link]).poses(np.ascontiguousarray(q.T), poses)
        return make_read_only(q), make_read_only(poses.reshape(count, 16)[:, :12].copy())

    @cached_property
    def cache(self) -> dict[Any, Any]:  # Any: each solver stores its own type
        """Cache of the solvers, by their keys."""
        return {}
