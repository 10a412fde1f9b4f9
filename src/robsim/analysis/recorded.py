"""The recorded moments of runs, one after another, with what their measures share."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, length, runs_last
from robsim.run.outcome import Outcome
from robsim.run.result import BLOCK
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Recorded:
    """A run or a batch in its scene. M moments are those until each run's end, run by run.

    Their arrays have the moment last. What ends early costs little: nothing is computed of the NaN
    that follow an end. Poses and velocities come from the record as far as it has them.
    """

    run: xr.Dataset
    scene: Scene

    @property
    def runs(self) -> int:
        """How many."""
        return int(self.run.sizes.get("run", 1))

    def each(self, name: str) -> Any:
        """A variable with the run first; a single run is a batch of one."""
        variable = self.run[name]
        return variable.values if "run" in variable.dims else variable.values[None]

    def moments(self, name: str) -> Array:
        """(..., M) of a variable with the dimension time."""
        values = self.each(name)
        rows = values.reshape(self.live.size, math.prod(values.shape[2:])).take(self._rows, axis=0)
        return np.ascontiguousarray(rows.T).reshape(*values.shape[2:], len(rows))

    @cached_property
    def q(self) -> Array:
        """(nq, M)."""
        return self.moments("q")

    @cached_property
    def qd(self) -> Array:
        """(nv, M) as commanded."""
        return self.moments("qd")

    @cached_property
    def pixels(self) -> Array:
        """(N, 2, M) of the marks."""
        return self.moments("pixels")

    def at_once(self, name: str) -> Array:
        """(..., B) of a variable that has one value for each run."""
        return np.ascontiguousarray(np.moveaxis(self.each(name), 0, -1))

    @cached_property
    def live(self) -> NDArray[np.bool_]:
        """(B, moments): until the end of each run."""
        q = self.each("q")
        alive = np.isfinite(q[..., 0])
        for i in range(1, q.shape[-1]):  # faster than all() along a short axis
            alive &= np.isfinite(q[..., i])
        return np.asarray(alive)

    @cached_property
    def _rows(self) -> NDArray[np.int64]:
        """(M,) numbers of the moments among all (B * moments) that there is room for."""
        return np.flatnonzero(self.live)

    @cached_property
    def owner(self) -> NDArray[np.int64]:
        """(M,) the run of each moment."""
        return np.repeat(np.arange(self.runs), self._counts)

    @cached_property
    def going(self) -> NDArray[np.bool_]:
        """(M - 1,): whether the next moment is of the same run."""
        same: NDArray[np.bool_] = self.owner[1:] == self.owner[:-1]
        return same

    @cached_property
    def held(self) -> Array:
        """(M - 1,) seconds until the next moment of the same run; 0 where there is none."""
        time = self.run["time"].values[self._rows % self.live.shape[1]]
        return np.where(self.going, np.diff(time), 0.0)

    @cached_property
    def converged(self) -> NDArray[np.bool_]:
        """(B,)."""
        arrived: NDArray[np.bool_] = self.each("outcome") == Outcome.CONVERGED
        return arrived

    @cached_property
    def _starts(self) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Which runs have moments, and the first moment of each of these."""
        there = self._counts > 0
        return there, (np.cumsum(self._counts) - self._counts)[there]

    @cached_property
    def _counts(self) -> NDArray[np.int64]:
        """(B,) how many moments each run has."""
        return np.asarray(self.live.sum(axis=1))

    def spread(self, values: Array) -> Array:
        """(..., M) of (..., B): the number of its run for each moment."""
        return np.repeat(values, self._counts, axis=-1)

    # Reductions go run by run, so that a run has the same bits alone and in any batch.

    def first(self, values: Array) -> Array:
        """(B,) of (M,): at the first moment of each run; NaN without any."""
        there, starts = self._starts
        found = np.full(self.runs, np.nan)
        found[there] = values[starts]
        return found

    def worst(self, values: Array) -> Array:
        """(B,) largest of (M,), in which NaN and -inf count nothing; NaN if there is no more."""
        there, starts = self._starts
        found = np.full(self.runs, np.nan)
        if starts.size:
            shown = np.where(np.isnan(values), -np.inf, values)
            found[there] = np.maximum.reduceat(shown, starts)
        found[found == -np.inf] = np.nan
        return found

    def total(self, values: Array) -> Array:
        """(B,) sums of (M - 1,), a number for each moment until the next; NaN counts nothing."""
        there, starts = self._starts
        found = np.zeros(self.runs)
        if starts.size:
            shown = np.append(np.where(self.going, np.nan_to_num(values), 0.0), 0.0)
            found[there] = np.add.reduceat(shown, starts)
        return found

    # Poses and velocities of the frame that moves.

    @property
    def pair(self) -> tuple[str, str]:
        """Names of the first camera and of the target that it sees."""
        return str(self.run["mark_camera"].values[0]), str(self.run["mark_target"].values[0])

    @cached_property
    def mover(self) -> str:
        """The camera; or the target, where the camera stands still; else what is moved."""
        if "frame_pose" in self.run:
            return str(self.run["frame_pose"].attrs["frame"])
        camera, target = self.pair
        carried = self.scene.tree.carries(camera) - self.scene.tree.carries(target)
        return camera if (carried > 0).any() else target

    @cached_property
    def _kept(self) -> str | None:
        """How the variables of the mover are called; None where it is not what is recorded."""
        if "frame_pose" in self.run:
            return "frame"
        return "camera" if self.mover == self.pair[0] else None

    @cached_property
    def way(self) -> Array:
        """(3, 4, M) poses of the mover in the world."""
        if self._kept:
            return self.moments(f"{self._kept}_pose")[:3]
        return self.poses(self.mover, self.q)

    @cached_property
    def velocities(self) -> Array:
        """(nv, M) of the joints: as commanded, where they follow at once."""
        return self.moments("qd_actual") if "qd_actual" in self.run else self.qd

    @cached_property
    def twists(self) -> Array:
        """(6, M) of the mover; in its own axes or the world's, which have the same lengths."""
        if self._kept:
            return self.moments(f"{self._kept}_velocity")
        tree, twist = self.scene.tree, np.zeros((6, self.q.shape[1]))
        J = tree.jacobian(tree.bodies(self.q), self.mover)
        for j in range(self.scene.nv):
            twist += J[:, j] * self.velocities[j]
        return twist

    @cached_property
    def away(self) -> Array:
        """(M,) metres from the camera to the middle of the marks."""
        if not self.run.sizes["mark"]:
            return np.full(len(self.owner), np.nan)
        camera, _ = self.pair
        eye = self.way if camera == self.mover else self.poses(camera, self.q)
        return self.distance(eye[:, 3], self.q)

    def distance(self, eye: Array, q: Array) -> Array:
        """(n,) metres from places (3, n) to the middle of the target's marks at q (nq, n)."""
        return length(self._middle(self.poses(self.pair[1], q)) - eye)

    def _middle(self, T: Array) -> Array:
        """(3, n) middle of the marks of a target that stands at T (3, 4, n)."""
        place = T[:3, 3]
        for j, along in enumerate(self.scene.object(self.pair[1]).marks.mean(axis=0)):
            place = place + along * T[:3, j]
        return place

    @cached_property
    def goal_distance(self) -> Array:
        """(B,) metres from the camera to the middle of the marks at the goal; NaN if not known."""
        goal, q = self.at_once("goal_pose"), self.at_once("q_end")
        if self.run["goal_pose"].attrs["frame"] == self.pair[0]:
            return self.distance(goal[:3, 3], q)
        return length(self._middle(goal) - self.poses(self.pair[0], q)[:, 3])

    def poses(self, frame: str, q: Array) -> Array:
        """(3, 4, n) of a frame in the world at q (nq, n); of one that nothing moves, once."""
        tree = self.scene.tree
        if tree.carries(frame).any():
            return tree.frame(tree.bodies(q), frame)
        still = tree.frame(tree.bodies(runs_last(self.scene.home, 1)), frame)
        return np.broadcast_to(still, (3, 4, q.shape[1]))


def blocks(run: xr.Dataset) -> Iterator[xr.Dataset]:
    """Some runs at a time, as many as have some ten thousand moments."""
    if "run" not in run.dims:
        yield run
        return
    size = runs_in_a_block(run.sizes["time"])
    for i in range(0, run.sizes["run"], size):
        yield run.isel(run=slice(i, i + size))


def runs_in_a_block(moments: int) -> int:
    """How many runs of so many moments are measured at a time."""
    return max(1, BLOCK // moments)
