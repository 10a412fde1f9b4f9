"""The rows of a program with what a controller knows of the marks, and of a feature of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.base.errors import InputError
from robsim.base.value import construct_unchecked, replace_unchecked
from robsim.features.feature import Observation, refit_lost_poses
from robsim.kernels.control import control_law
from robsim.kernels.estimation.pose_fit import count_pose_fit_rows, fit_pose_stage
from robsim.kernels.features.pose_features import flag_lost_pose
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks, Program
from robsim.kernels.machine.stages import CompiledStage
from robsim.vision.camera import Camera


class FeatureRows(NamedTuple):
    """The rows of a feature s (k,) and of its interaction matrix L (k, 6)."""

    s: BlockRows
    L: BlockRows


@dataclass(frozen=True)
class ObservationRows:
    """The rows of an observation of N marks, as `Observation` has them."""

    program: Program
    N: int
    pixels: BlockRows  # (N, 2)
    points: BlockRows  # (N, 2), normalised
    depth: BlockRows  # (N,)
    camera: BlockRows  # in the order of `robsim.kernels.images.projection`
    model: BlockRows  # (N, 3)
    guess: BlockRows  # (3, 4), the pose from which an estimate of T_c_o starts
    other: ObservationRows | None = None  # the same marks, as the second camera of a pair sees them
    between: BlockRows | None = None  # (3, 4), the pose of the second camera in this one
    fitted: BlockRows | None = None  # (3, 4), the pose T_c_o that fits the image, where it is known
    sure: bool = True  # whether the guess cannot be behind the camera
    weights: BlockRows | None = (
        None  # of each mark in the estimate of the pose; None: all count alike
    )

    @cached_property
    def pose(self) -> BlockRows:
        """The rows of the pose T_c_o that fits the image; the stage that finds it is added once."""
        if self.fitted is not None:
            return self.fitted
        program, weights = self.program, self.weights
        if weights is None:
            weights = program.constant(np.ones(self.N))
        seen = {"marks": self.model, "x": self.points, "guess": self.guess, "weights": weights}
        T = program.result(
            fit_pose_stage, "T", 3, 4, **seen, room=program.rows(count_pose_fit_rows(self.N))
        )
        if not self.sure:
            lost = program.result(flag_lost_pose, "lost", points=self.points, T=T)
            program.rescue(lambda blocks, step: self._without_guess(blocks, T, lost), lost)
        return T

    def _without_guess(self, blocks: Blocks, T: BlockRows, lost: BlockRows) -> None:
        """Find the poses that no guess led to from the image alone."""
        if blocks.get(lost).any():
            model, points = blocks.get(self.model), blocks.get(self.points)
            blocks.put(T, refit_lost_poses(blocks.get(T), model, points))
            blocks.put(lost, np.zeros(blocks.runs))

    def goal(self, values: Array | None, count: int) -> BlockRows | None:
        """Return the rows of so many numbers (n, B) at the goal, or None where none are known.

        InputError where the goal had another number of marks.
        """
        if values is not None and len(values) != count:
            raise InputError(f"{self.N} marks are seen here, and another number was at the goal")
        return None if values is None else self.program.each(values)

    def room(self, k: int) -> FeatureRows:
        """Return new rows for a feature of k numbers."""
        return FeatureRows(self.program.rows(k), self.program.rows(k, 6))

    def computed(self, stage: CompiledStage, k: int, **given: Any) -> FeatureRows:
        """Add the stage of a feature of k numbers, and return the rows that it fills."""
        rows = self.room(k)
        self.program.add(stage, **rows._asdict(), **given)
        return rows

    @property
    def image(self) -> dict[str, BlockRows]:
        """The rows of points and depths, as stages take them by name."""
        return {"points": self.points, "depth": self.depth}

    def observation(self, blocks: Blocks, cameras: Sequence[Camera]) -> Observation:
        """Return what is seen in blocks, by a camera or a pair of them."""
        camera, *others = cameras
        get = blocks.get
        model = get(self.model)
        seen = construct_unchecked(
            Observation,
            pixels_last=make_read_only(get(self.pixels)),
            points_last=make_read_only(get(self.points)),
            depth_last=make_read_only(get(self.depth)),
            camera=camera.of_runs(blocks.rows),
            model=make_read_only(
                model if (model != model[..., :1]).any() else model[..., 0].copy()
            ),
            guess_last=make_read_only(get(self.guess)),
            runs=make_read_only(blocks.rows.view()),
            weights_last=None if self.weights is None else make_read_only(get(self.weights)),
        )
        if self.other is None or self.between is None:
            return seen
        between = make_read_only(get(self.between))
        other = self.other.observation(blocks, others)
        return replace_unchecked(seen, other=other, between_last=between)

    def some(self, marks: NDArray[np.int64]) -> ObservationRows:
        """Return the rows of some of the marks, with the stage that copies them."""
        names = ["pixels", "points", "depth", "model"]
        if self.weights is not None:
            names.append("weights")
        program, own = self.program, vars(self)
        chosen: dict[str, Any] = {name: select_rows(program, own[name], marks) for name in names}
        other = None if self.other is None else self.other.some(marks)
        return replace(self, N=len(marks), **chosen, other=other)


def select_rows(program: Program, rows: BlockRows, which: NDArray[np.int64]) -> BlockRows:
    """Add the stages that copy some entries of rows (n, ...), by number; return the new rows."""
    if which.tolist() == list(range(rows.shape[0])):
        return rows
    found = program.rows(len(which), *rows.shape[1:])
    for i, n in enumerate(which.tolist()):
        program.add(control_law.copy_rows, rows=rows[n].flat, to=found[i].flat)
    return found


def concatenate_rows(program: Program, parts: Sequence[BlockRows]) -> BlockRows:
    """Return rows of parts that follow one another, copied if there are several."""
    if len(parts) == 1:
        return parts[0]
    found, at = program.rows(sum(part.shape[0] for part in parts), *parts[0].shape[1:]), 0
    for part in parts:
        program.add(control_law.copy_rows, rows=part.flat, to=found[at : at + part.shape[0]].flat)
        at += part.shape[0]
    return found
