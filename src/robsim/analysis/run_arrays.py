"""The recorded instants of runs, concatenated in arrays, and quantities of several measures."""

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
from robsim.run.frame_motion import BLOCK
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False)
class RecordedRuns:
    """A run or a batch in its scene, with the instants of all runs concatenated.

    M is the number of instants before the ends of the runs. Arrays have the instant as last axis.
    Poses and velocities are read from the run if it stores them, and computed otherwise.
    """

    run: xr.Dataset
    scene: Scene

    @property
    def runs(self) -> int:
        """The number of runs, B."""
        return int(self.run.sizes.get("run", 1))

    def variable(self, name: str) -> Any:
        """Return a variable with the run as first axis; a single run is a batch of one."""
        variable = self.run[name]
        return variable.values if "run" in variable.dims else variable.values[None]

    def instants(self, name: str) -> Array:
        """Return (..., M) of a variable with the dimension time."""
        values = self.variable(name)
        rows = values.reshape(self.live.size, math.prod(values.shape[2:])).take(self._rows, axis=0)
        return np.ascontiguousarray(rows.T).reshape(*values.shape[2:], len(rows))

    @cached_property
    def q(self) -> Array:
        """The coordinates (nq, M)."""
        return self.instants("q")

    @cached_property
    def qd(self) -> Array:
        """The commanded velocities (nv, M)."""
        return self.instants("qd")

    @cached_property
    def pixels(self) -> Array:
        """The pixels (N, 2, M) of the marks."""
        return self.instants("pixels")

    @cached_property
    def pixels_goal(self) -> Array:
        """The pixels of the marks at the goal, (N, 2, B), or (N, 2, 1) for a common goal."""
        goal = self.run["pixels_goal"]
        return self.per_run("pixels_goal") if "run" in goal.dims else goal.values[..., None]

    @property
    def goal_at_instants(self) -> Array:
        """The pixels of the marks at the goal of each instant's run, (N, 2, M) or (N, 2, 1)."""
        goal = self.pixels_goal
        return goal if goal.shape[-1] == 1 else self.repeat(goal)

    def per_run(self, name: str) -> Array:
        """Return (..., B) of a variable with one value for each run."""
        return np.ascontiguousarray(np.moveaxis(self.variable(name), 0, -1))

    @cached_property
    def live(self) -> NDArray[np.bool_]:
        """Whether each instant (B, instants) is before the end of its run."""
        q = self.variable("q")
        alive = np.isfinite(q[..., 0])
        for i in range(1, q.shape[-1]):  # faster than all() along a short axis
            alive &= np.isfinite(q[..., i])
        return np.asarray(alive)

    @cached_property
    def _rows(self) -> NDArray[np.int64]:
        """The indices (M,) of the live instants among all B * instants."""
        return np.flatnonzero(self.live)

    @cached_property
    def run_index(self) -> NDArray[np.int64]:
        """The run (M,) of each instant."""
        return np.repeat(np.arange(self.runs), self._counts)

    @cached_property
    def has_next(self) -> NDArray[np.bool_]:
        """Whether the next instant (M - 1,) belongs to the same run."""
        same: NDArray[np.bool_] = self.run_index[1:] == self.run_index[:-1]
        return same

    @cached_property
    def hold_times(self) -> Array:
        """The time (M - 1,) in seconds until the next instant of the same run; 0 at a run's end."""
        time = self.run["time"].values[self._rows % self.live.shape[1]]
        return np.where(self.has_next, np.diff(time), 0.0)

    @cached_property
    def converged(self) -> NDArray[np.bool_]:
        """Whether each run (B,) converged."""
        has_converged: NDArray[np.bool_] = self.variable("outcome") == Outcome.CONVERGED
        return has_converged

    @cached_property
    def _starts(self) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Whether each run (B,) has instants, and the first instant of each run that has some."""
        has_instants = self._counts > 0
        return has_instants, (np.cumsum(self._counts) - self._counts)[has_instants]

    @cached_property
    def _counts(self) -> NDArray[np.int64]:
        """The number (B,) of instants of each run."""
        return np.asarray(self.live.sum(axis=1))

    def repeat(self, values: Array) -> Array:
        """Return values (..., B) repeated for each instant of their run, (..., M)."""
        return np.repeat(values, self._counts, axis=-1)

    # Reductions work run by run, so that a run has the same bits alone and in any batch.

    def first(self, values: Array) -> Array:
        """Return the value (B,) at the first instant of each run; NaN without instants."""
        has_instants, starts = self._starts
        result = np.full(self.runs, np.nan)
        result[has_instants] = values[starts]
        return result

    def maximum_per_run(self, values: Array) -> Array:
        """Return the maximum (B,) of values (M,) over each run, without NaN and -inf.

        A run without other values gives NaN.
        """
        has_instants, starts = self._starts
        result = np.full(self.runs, np.nan)
        if starts.size:
            finite = np.where(np.isnan(values), -np.inf, values)
            result[has_instants] = np.maximum.reduceat(finite, starts)
        result[result == -np.inf] = np.nan
        return result

    def sum_per_run(self, values: Array) -> Array:
        """Return the sum (B,) of values (M - 1,) over each run; NaN is ignored."""
        has_instants, starts = self._starts
        result = np.zeros(self.runs)
        if starts.size:
            finite = np.append(np.where(self.has_next, np.nan_to_num(values), 0.0), 0.0)
            result[has_instants] = np.add.reduceat(finite, starts)
        return result

    # Poses and velocities of the moving frame.

    @property
    def pair(self) -> tuple[str, str]:
        """The names of the first camera and of its target."""
        return str(self.run["mark_camera"].values[0]), str(self.run["mark_target"].values[0])

    @cached_property
    def mover(self) -> str:
        """The name of the camera or, if it stands still, of the target or the recorded frame."""
        if "frame_pose" in self.run:
            return str(self.run["frame_pose"].attrs["frame"])
        camera, target = self.pair
        moved_joints = self.scene.tree.flag_velocities(camera) - self.scene.tree.flag_velocities(
            target
        )
        return camera if (moved_joints > 0).any() else target

    @cached_property
    def _mover_prefix(self) -> str | None:
        """The prefix of the mover's recorded variables; None if they are not recorded."""
        if "frame_pose" in self.run:
            return "frame"
        return "camera" if self.mover == self.pair[0] else None

    @cached_property
    def mover_poses(self) -> Array:
        """The poses (3, 4, M) of the mover in the world."""
        if self._mover_prefix:
            return self.instants(f"{self._mover_prefix}_pose")[:3]
        return self.poses(self.mover, self.q)

    @cached_property
    def velocities(self) -> Array:
        """The joint velocities (nv, M); the commanded velocities if joints do not lag."""
        return self.instants("qd_actual") if "qd_actual" in self.run else self.qd

    @cached_property
    def twists(self) -> Array:
        """The twists (6, M) of the mover, in its own axes or world axes; the norms are the same."""
        if self._mover_prefix:
            return self.instants(f"{self._mover_prefix}_velocity")
        tree, twist = self.scene.tree, np.zeros((6, self.q.shape[1]))
        J = tree.jacobian(tree.bodies(self.q), self.mover)
        for j in range(self.scene.nv):
            twist += J[:, j] * self.velocities[j]
        return twist

    @cached_property
    def camera_distances(self) -> Array:
        """The distances (M,) in metres from the camera to the middle of the marks."""
        if not self.run.sizes["mark"]:
            return np.full(len(self.run_index), np.nan)
        camera, _ = self.pair
        eye = self.mover_poses if camera == self.mover else self.poses(camera, self.q)
        return self.distance(eye[:, 3], self.q)

    def distance(self, eye: Array, q: Array) -> Array:
        """Return distances (n,) in metres from points (3, n) to the middle of the marks at q."""
        return euclidean_length(self._middle(self.poses(self.pair[1], q)) - eye)

    def _middle(self, T: Array) -> Array:
        """Return the middle (3, n) of the marks of a target with pose T (3, 4, n)."""
        middle = T[:3, 3]
        for j, offset in enumerate(self.scene.object(self.pair[1]).marks.mean(axis=0)):
            middle = middle + offset * T[:3, j]
        return middle

    @cached_property
    def goal_distance(self) -> Array:
        """The distances (B,) in metres at the goal from the camera to the marks; NaN if unknown."""
        goal, q = self.per_run("goal_pose"), self.per_run("q_end")
        if self.run["goal_pose"].attrs["frame"] == self.pair[0]:
            return self.distance(goal[:3, 3], q)
        return euclidean_length(self._middle(goal) - self.poses(self.pair[0], q)[:, 3])

    def poses(self, frame: str, q: Array) -> Array:
        """Return poses (3, 4, n) of a frame in the world at q (nq, n)."""
        tree = self.scene.tree
        if tree.flag_velocities(frame).any():
            return tree.frame(tree.bodies(q), frame)
        pose = tree.frame(tree.bodies(move_runs_last(self.scene.home, 1)), frame)
        return np.broadcast_to(pose, (3, 4, q.shape[1]))


def split_runs(run: xr.Dataset) -> Iterator[xr.Dataset]:
    """Yield a few runs at a time, with about `BLOCK` instants in total."""
    if "run" not in run.dims:
        yield run
        return
    size = count_block_runs(run.sizes["time"])
    for i in range(0, run.sizes["run"], size):
        yield run.isel(run=slice(i, i + size))


def count_block_runs(instants: int) -> int:
    """Return the number of runs of the given length that are measured at a time."""
    return max(1, BLOCK // instants)
