"""The rows of a program with what a controller knows of the marks, and of a feature of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen, runs_last
from robsim.base.errors import InputError
from robsim.base.values import known, unchecked
from robsim.features.feature import Observation, without_guess
from robsim.kernels.control import commanding
from robsim.kernels.estimation.pose import fit, room_of
from robsim.kernels.features.pose_features import lost_stage
from robsim.kernels.machine.program import Blocks, Program
from robsim.vision.camera import Camera


class FeatureRows(NamedTuple):
    """The rows of a feature s (k,) and of its interaction matrix L (k, 6)."""

    k: int
    s: int
    L: int


@dataclass(frozen=True)
class Seen:
    """The rows of an observation of N marks, as `Observation` has them."""

    program: Program
    N: int
    pixels: int  # 2 for each mark
    points: int  # 2 for each mark, normalised
    depth: int
    camera: int  # in the order of `robsim.kernels.images.viewing`
    model: int  # 3 for each mark
    guess: int  # 12, the pose from which an estimate of T_c_o starts
    other: Seen | None = None  # the same marks, as the second camera of a pair sees them
    between: int = -1  # 12, the pose of the second camera in this one
    fitted: int | None = None  # 12, the pose T_c_o that fits the image, where it is known already
    sure: bool = True  # whether the guess cannot be behind the camera
    weights: int = -1  # of each mark in the estimate of the pose, where they do not count alike

    @cached_property
    def pose(self) -> int:
        """The rows of the pose T_c_o that fits the image; the stage that finds it is added once."""
        if self.fitted is not None:
            return self.fitted
        T = self.program.rows(12)
        room = self.program.rows(room_of(self.N))
        weights = self.weights if self.weights >= 0 else self.program.constant(np.ones(self.N))
        self.program.add(fit, self.N, self.model, self.points, self.guess, T, weights, room)
        if not self.sure:
            lost = self.program.rows()
            self.program.add(lost_stage, self.N, self.points, T, lost)
            self.program.rescue(lambda blocks, step: self._without_guess(blocks, T, lost), lost)
        return T

    def _without_guess(self, blocks: Blocks, T: int, lost: int) -> None:
        """Find the poses that no guess led to from the image alone."""
        if blocks.get(lost, 1).any():
            model, points = blocks.get(self.model, self.N, 3), blocks.get(self.points, self.N, 2)
            blocks.put(T, without_guess(blocks.get(T, 3, 4), model, points))
            blocks.put(lost, np.zeros((1, blocks.runs)))

    def goal(self, values: Array | None, count: int) -> int:
        """Return the rows of so many numbers (n, B) at the goal, or -1 where none are known.

        InputError where the goal had another number of marks.
        """
        if values is not None and len(values) != count:
            raise InputError(f"{self.N} marks are seen here, and another number was at the goal")
        return -1 if values is None else self.program.each(values)

    def pose_goal(self, T: Array) -> int:
        """Return the rows of a pose (4, 4) at the goal, or of one (B, 4, 4) for each run."""
        return self.program.each(runs_last(T[..., :3, :], 2).reshape(12, -1))

    def room(self, k: int) -> FeatureRows:
        """Return new rows for a feature of k numbers."""
        return FeatureRows(k, self.program.rows(k), self.program.rows(6 * k))

    def observation(self, blocks: Blocks, cameras: Sequence[Camera]) -> Observation:
        """Return what is seen in blocks, by a camera or a pair of them."""
        camera, *others = cameras
        get, N = blocks.get, self.N
        model = get(self.model, N, 3)
        seen = known(
            Observation,
            pixels_last=frozen(get(self.pixels, N, 2)),
            points_last=frozen(get(self.points, N, 2)),
            depth_last=frozen(get(self.depth, N)),
            camera=camera.of_runs(blocks.rows),
            model=frozen(model if (model != model[..., :1]).any() else model[..., 0].copy()),
            guess_last=frozen(get(self.guess, 3, 4)),
            runs=frozen(blocks.rows.view()),
            weights_last=None if self.weights < 0 else frozen(get(self.weights, N)),
        )
        if self.other is None:
            return seen
        between = frozen(get(self.between, 3, 4))
        other = self.other.observation(blocks, others)
        return unchecked(seen, other=other, between_last=between)

    def some(self, marks: NDArray[np.int64]) -> Seen:
        """Return the rows of some of the marks, with the stage that copies them."""
        return replace(
            self,
            N=len(marks),
            pixels=self._copied(self.pixels, marks, 2),
            points=self._copied(self.points, marks, 2),
            depth=self._copied(self.depth, marks, 1),
            model=self._copied(self.model, marks, 3),
            weights=-1 if self.weights < 0 else self._copied(self.weights, marks, 1),
            other=None if self.other is None else self.other.some(marks),
        )

    def _copied(self, first: int, marks: NDArray[np.int64], size: int) -> int:
        rows = self.program.rows(size * len(marks))
        for i, mark in enumerate(marks):
            self.program.add(commanding.copied, size, first + size * mark, rows + size * i)
        return rows
