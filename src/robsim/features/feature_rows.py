"""Rows of a compiled program: an observation of marks, and a feature computed from it."""

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
    """Rows of a feature s (k,) and of its interaction matrix L (k, 6).

    A feature of pictures also has the row of the status of its picture, and may have the row of the
    share of the diagonal that the law adds to L'L.
    """

    s: BlockRows
    L: BlockRows
    status: BlockRows | None = None
    damping: BlockRows | None = None

    @property
    def numbers(self) -> dict[str, BlockRows]:
        """The rows of s and L by name."""
        return {"s": self.s, "L": self.L}


@dataclass(frozen=True)
class ObservationRows:
    """Rows of an observation of N marks, with the fields of `Observation`."""

    program: Program
    N: int
    pixels: BlockRows  # (N, 2)
    points: BlockRows  # (N, 2), normalised
    depth: BlockRows  # (N,)
    camera: BlockRows  # in the order of `robsim.kernels.images.projection`
    model: BlockRows  # (N, 3)
    guess: BlockRows  # (3, 4), start of the estimate of T_c_o
    other: ObservationRows | None = None  # the same marks, observed by the second camera of a pair
    between: BlockRows | None = None  # (3, 4), pose of the second camera in the first camera
    fitted: BlockRows | None = None  # (3, 4), pose T_c_o that fits the image, if known
    sure: bool = True  # whether the guess is in front of the camera for certain
    weights: BlockRows | None = None  # weight of each mark in the estimate of the pose; None: equal
    plane: BlockRows | None = None  # (3,), coefficients of the inverse depth of the target
    seconds: float = 0.0  # control period

    @cached_property
    def pose(self) -> BlockRows:
        """Rows of the pose T_c_o that fits the image; the stage that estimates it is added once."""
        if self.fitted is not None:
            return self.fitted
        program, weights = self.program, self.weights
        if weights is None:
            weights = program.constant(np.ones(self.N))
        arguments = {"marks": self.model, "x": self.points, "guess": self.guess, "weights": weights}
        T = program.result(
            fit_pose_stage,
            "T",
            3,
            4,
            **arguments,
            scratch=program.rows(count_pose_fit_rows(self.N)),
        )
        if not self.sure:
            lost = program.result(flag_lost_pose, "lost", points=self.points, T=T)
            program.rescue(lambda blocks, step: self._refit_poses(blocks, T, lost), lost)
        return T

    def _refit_poses(self, blocks: Blocks, T: BlockRows, lost: BlockRows) -> None:
        """Estimate the poses that the guess did not lead to from the image alone."""
        if blocks.get(lost).any():
            model, points = blocks.get(self.model), blocks.get(self.points)
            blocks.put(T, refit_lost_poses(blocks.get(T), model, points))
            blocks.put(lost, np.zeros(blocks.runs))

    def goal(self, values: Array | None, count: int) -> BlockRows | None:
        """Return the rows of `count` numbers (n, B) at the goal, or None if there is no goal.

        Raises InputError if the goal has another number of marks.
        """
        if values is not None and len(values) != count:
            raise InputError(f"{self.N} marks are observed, and the goal has another number")
        return None if values is None else self.program.each(values)

    def room(self, k: int) -> FeatureRows:
        """Return new rows for a feature of k numbers."""
        return FeatureRows(self.program.rows(k), self.program.rows(k, 6))

    def computed(self, stage: CompiledStage, k: int, **given: Any) -> FeatureRows:
        """Add the stage of a feature of k numbers; return the rows that it fills."""
        rows = self.room(k)
        self.program.add(stage, **rows.numbers, **given)
        return rows

    @property
    def image(self) -> dict[str, BlockRows]:
        """Rows of points and depths, by the names that stages use."""
        return {"points": self.points, "depth": self.depth}

    def observation(self, blocks: Blocks, cameras: Sequence[Camera]) -> Observation:
        """Return the observation of a camera, or of a pair of cameras, from blocks."""
        camera, *others = cameras
        get = blocks.get
        model = get(self.model)
        observation = construct_unchecked(
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
            plane_last=None if self.plane is None else make_read_only(get(self.plane)),
        )
        if self.other is None or self.between is None:
            return observation
        between = make_read_only(get(self.between))
        other = self.other.observation(blocks, others)
        return replace_unchecked(observation, other=other, between_last=between)

    def some(self, marks: NDArray[np.int64]) -> ObservationRows:
        """Return the rows of some of the marks, and add the stages that copy them."""
        names = ["pixels", "points", "depth", "model"]
        if self.weights is not None:
            names.append("weights")
        program, fields = self.program, vars(self)
        selected: dict[str, Any] = {
            name: select_rows(program, fields[name], marks) for name in names
        }
        other = None if self.other is None else self.other.some(marks)
        return replace(self, N=len(marks), **selected, other=other)


def select_rows(program: Program, rows: BlockRows, indices: NDArray[np.int64]) -> BlockRows:
    """Add the stages that copy some entries of rows (n, ...), by index; return the new rows."""
    if indices.tolist() == list(range(rows.shape[0])):
        return rows
    copies = program.rows(len(indices), *rows.shape[1:])
    for i, n in enumerate(indices.tolist()):
        program.add(control_law.copy_rows, rows=rows[n].flat, to=copies[i].flat)
    return copies


def concatenate_rows(program: Program, parts: Sequence[BlockRows]) -> BlockRows:
    """Return the rows of parts in sequence, copied if there are several parts."""
    if len(parts) == 1:
        return parts[0]
    rows, start = program.rows(sum(part.shape[0] for part in parts), *parts[0].shape[1:]), 0
    for part in parts:
        program.add(
            control_law.copy_rows, rows=part.flat, to=rows[start : start + part.shape[0]].flat
        )
        start += part.shape[0]
    return rows
