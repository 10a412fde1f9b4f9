"""The recorded moments of runs in one array, with quantities that several measures need."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from robsim.base.arrays import Array, euclidean_length, move_runs_last
from robsim.engine.outcome import Outcome
from robsim.run.simulation_dataset import BLOCK
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False)
class RecordedRuns:
    """A run or a batch in its scene, with the M moments before each run's end, run by run.

    Arrays have the moment as last axis, without the NaN that follow a run's end. Poses and
    velocities are taken from the record where it has them, else computed.
    """

    run: xr.Dataset
    scene: Scene

    @property
    def runs(self) -> int:
        """The number of runs, B."""
        return int(self.run.sizes.get("run", 1))

    def each(self, name: str) -> Any:
        """Return a variable with the run as first axis; a single run is a batch of one."""
        variable = self.run[name]
        return variable.values if "run" in variable.dims else variable.values[None]

    def moments(self, name: str) -> Array:
        """Return (..., M) of a variable that has the dimension time."""
        values = self.each(name)
        rows = values.reshape(self.live.size, math.prod(values.shape[2:])).take(self._rows, axis=0)
        return np.ascontiguousarray(rows.T).reshape(*values.shape[2:], len(rows))

    @cached_property
    def q(self) -> Array:
        """The coordinates (nq, M)."""
        return self.moments("q")

    @cached_property
    def qd(self) -> Array:
        """The commanded velocities (nv, M)."""
        return self.moments("qd")

    @cached_property
    def pixels(self) -> Array:
        """The pixels (N, 2, M) of the marks."""
        return self.moments("pixels")

    @cached_property
    def pixels_goal(self) -> Array:
        """The pixels of the marks at the goal, (N, 2, B), or (N, 2, 1) where all runs have one."""
        goal = self.run["pixels_goal"]
        return self.at_once("pixels_goal") if "run" in goal.dims else goal.values[..., None]

    @property
    def goal_at_moments(self) -> Array:
        """Likewise of the run of each moment, (N, 2, M) or (N, 2, 1)."""
        goal = self.pixels_goal
        return goal if goal.shape[-1] == 1 else self.spread(goal)

    def at_once(self, name: str) -> Array:
        """Return (..., B) of a variable that has one value for each run."""
        return np.ascontiguousarray(np.moveaxis(self.each(name), 0, -1))

    @cached_property
    def live(self) -> NDArray[np.bool_]:
        """Whether each moment (B, moments) is before the end of its run."""
        q = self.each("q")
        alive = np.isfinite(q[..., 0])
        for i in range(1, q.shape[-1]):  # faster than all() along a short axis
            alive &= np.isfinite(q[..., i])
        return np.asarray(alive)

    @cached_property
    def _rows(self) -> NDArray[np.int64]:
        """The indices (M,) of the live moments among all B * moments."""
        return np.flatnonzero(self.live)

    @cached_property
    def owner(self) -> NDArray[np.int64]:
        """The run (M,) to which each moment belongs."""
        return np.repeat(np.arange(self.runs), self._counts)

    @cached_property
    def going(self) -> NDArray[np.bool_]:
        """Whether the next moment (M - 1,) belongs to the same run."""
        same: NDArray[np.bool_] = self.owner[1:] == self.owner[:-1]
        return same

    @cached_property
    def held(self) -> Array:
        """The time (M - 1,) in seconds until the next moment of the same run; 0 at its end."""
        time = self.run["time"].values[self._rows % self.live.shape[1]]
        return np.where(self.going, np.diff(time), 0.0)

    @cached_property
    def converged(self) -> NDArray[np.bool_]:
        """Whether each run (B,) converged."""
        arrived: NDArray[np.bool_] = self.each("outcome") == Outcome.CONVERGED
        return arrived

    @cached_property
    def _starts(self) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Which runs (B,) have moments, and the index of the first moment of each of these."""
        there = self._counts > 0
        return there, (np.cumsum(self._counts) - self._counts)[there]

    @cached_property
    def _counts(self) -> NDArray[np.int64]:
        """The number (B,) of moments of each run."""
        return np.asarray(self.live.sum(axis=1))

    def spread(self, values: Array) -> Array:
        """Return (..., M) of (..., B): for each moment the value of its run."""
        return np.repeat(values, self._counts, axis=-1)

    # Reductions work run by run, so that a run gives the same bits alone and in any batch.

    def first(self, values: Array) -> Array:
        """Return (B,) of (M,): the value at the first moment of each run; NaN without any."""
        there, starts = self._starts
        found = np.full(self.runs, np.nan)
        found[there] = values[starts]
        return found

    def worst(self, values: Array) -> Array:
        """Return the largest (B,) of values (M,) over each run; NaN and -inf are ignored.

        A run without any other value gives NaN.
        """
        there, starts = self._starts
        found = np.full(self.runs, np.nan)
        if starts.size:
            shown = np.where(np.isnan(values), -np.inf, values)
            found[there] = np.maximum.reduceat(shown, starts)
        found[found == -np.inf] = np.nan
        return found

    def total(self, values: Array) -> Array:
        """Return the sum (B,) of values (M - 1,) over each run; NaN is ignored."""
        there, starts = self._starts
        found = np.zeros(self.runs)
        if starts.size:
            shown = np.append(np.where(self.going, np.nan_to_num(values), 0.0), 0.0)
            found[there] = np.add.reduceat(shown, starts)
        return found

    # Poses and velocities of the frame that moves.

    @property
    def pair(self) -> tuple[str, str]:
        """The names of the first camera and of the target that it sees."""
        return str(self.run["mark_camera"].values[0]), str(self.run["mark_target"].values[0])

    @cached_property
    def mover(self) -> str:
        """The name of the camera or, if it stands still, of the target or the recorded frame."""
        if "frame_pose" in self.run:
            return str(self.run["frame_pose"].attrs["frame"])
        camera, target = self.pair
        carried = self.scene.tree.carries(camera) - self.scene.tree.carries(target)
        return camera if (carried > 0).any() else target

    @cached_property
    def _kept(self) -> str | None:
        """The prefix of the mover's recorded variables; None where they are not recorded."""
        if "frame_pose" in self.run:
            return "frame"
        return "camera" if self.mover == self.pair[0] else None

    @cached_property
    def way(self) -> Array:
        """The poses (3, 4, M) of the mover in the world."""
        if self._kept:
            return self.moments(f"{self._kept}_pose")[:3]
        return self.poses(self.mover, self.q)

    @cached_property
    def velocities(self) -> Array:
        """The joint velocities (nv, M), which are the commanded ones if joints do not lag."""
        return self.moments("qd_actual") if "qd_actual" in self.run else self.qd

    @cached_property
    def twists(self) -> Array:
        """The twists (6, M) of the mover, in its own axes or the world's: norms are the same."""
        if self._kept:
            return self.moments(f"{self._kept}_velocity")
        tree, twist = self.scene.tree, np.zeros((6, self.q.shape[1]))
        J = tree.jacobian(tree.bodies(self.q), self.mover)
        for j in range(self.scene.nv):
            twist += J[:, j] * self.velocities[j]
        return twist

    @cached_property
    def away(self) -> Array:
        """The distances (M,) in metres from the camera to the middle of the marks."""
        if not self.run.sizes["mark"]:
            return np.full(len(self.owner), np.nan)
        camera, _ = self.pair
        eye = self.way if camera == self.mover else self.poses(camera, self.q)
        return self.distance(eye[:, 3], self.q)

    def distance(self, eye: Array, q: Array) -> Array:
        """Return the distance (n,) in metres from points (3, n) to the marks at q (nq, n)."""
        return euclidean_length(self._middle(self.poses(self.pair[1], q)) - eye)

    def _middle(self, T: Array) -> Array:
        """Return the middle (3, n) of the marks of a target with pose T (3, 4, n)."""
        place = T[:3, 3]
        for j, along in enumerate(self.scene.object(self.pair[1]).marks.mean(axis=0)):
            place = place + along * T[:3, j]
        return place

    @cached_property
    def goal_distance(self) -> Array:
        """The distances (B,) in metres from the camera to the marks at the goal; NaN if unknown."""
        goal, q = self.at_once("goal_pose"), self.at_once("q_end")
        if self.run["goal_pose"].attrs["frame"] == self.pair[0]:
            return self.distance(goal[:3, 3], q)
        return euclidean_length(self._middle(goal) - self.poses(self.pair[0], q)[:, 3])

    def poses(self, frame: str, q: Array) -> Array:
        """Return poses (3, 4, n) of a frame in the world at q (nq, n)."""
        tree = self.scene.tree
        if tree.carries(frame).any():
            return tree.frame(tree.bodies(q), frame)
        still = tree.frame(tree.bodies(move_runs_last(self.scene.home, 1)), frame)
        return np.broadcast_to(still, (3, 4, q.shape[1]))


def split_runs(run: xr.Dataset) -> Iterator[xr.Dataset]:
    """Yield a few runs at a time, with about `BLOCK` moments in all."""
    if "run" not in run.dims:
        yield run
        return
    size = count_block_runs(run.sizes["time"])
    for i in range(0, run.sizes["run"], size):
        yield run.isel(run=slice(i, i + size))


def count_block_runs(moments: int) -> int:
    """Return how many runs of so many moments are measured at a time."""
    return max(1, BLOCK // moments)
