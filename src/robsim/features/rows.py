"""The rows of a program with what a controller knows of the marks, and of a feature of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen
from robsim.base.errors import InputError
from robsim.base.values import known, unchecked
from robsim.features.feature import Observation, without_guess
from robsim.kernels.control import commanding
from robsim.kernels.estimation.pose import fit, room_of
from robsim.kernels.features.pose_features import lost_stage
from robsim.kernels.machine.program import Blocks, Program
from robsim.kernels.machine.rows import Rows
from robsim.kernels.machine.stage import Stage
from robsim.vision.camera import Camera


class FeatureRows(NamedTuple):
    """The rows of a feature s (k,) and of its interaction matrix L (k, 6)."""

    s: Rows
    L: Rows


@dataclass(frozen=True)
class Seen:
    """The rows of an observation of N marks, as `Observation` has them."""

    program: Program
    N: int
    pixels: Rows  # (N, 2)
    points: Rows  # (N, 2), normalised
    depth: Rows  # (N,)
    camera: Rows  # in the order of `robsim.kernels.images.viewing`
    model: Rows  # (N, 3)
    guess: Rows  # (3, 4), the pose from which an estimate of T_c_o starts
    other: Seen | None = None  # the same marks, as the second camera of a pair sees them
    between: Rows | None = None  # (3, 4), the pose of the second camera in this one
    fitted: Rows | None = None  # (3, 4), the pose T_c_o that fits the image, where it is known
    sure: bool = True  # whether the guess cannot be behind the camera
    weights: Rows | None = None  # of each mark in the estimate of the pose; None: all count alike

    @cached_property
    def pose(self) -> Rows:
        """The rows of the pose T_c_o that fits the image; the stage that finds it is added once."""
        if self.fitted is not None:
            return self.fitted
        program, weights = self.program, self.weights
        if weights is None:
            weights = program.constant(np.ones(self.N))
        seen = {"marks": self.model, "x": self.points, "guess": self.guess, "weights": weights}
        T = program.result(fit, "T", 3, 4, **seen, room=program.rows(room_of(self.N)))
        if not self.sure:
            lost = program.result(lost_stage, "lost", points=self.points, T=T)
            program.rescue(lambda blocks, step: self._without_guess(blocks, T, lost), lost)
        return T

    def _without_guess(self, blocks: Blocks, T: Rows, lost: Rows) -> None:
        """Find the poses that no guess led to from the image alone."""
        if blocks.get(lost).any():
            model, points = blocks.get(self.model), blocks.get(self.points)
            blocks.put(T, without_guess(blocks.get(T), model, points))
            blocks.put(lost, np.zeros(blocks.runs))

    def goal(self, values: Array | None, count: int) -> Rows | None:
        """Return the rows of so many numbers (n, B) at the goal, or None where none are known.

        InputError where the goal had another number of marks.
        """
        if values is not None and len(values) != count:
            raise InputError(f"{self.N} marks are seen here, and another number was at the goal")
        return None if values is None else self.program.each(values)

    def room(self, k: int) -> FeatureRows:
        """Return new rows for a feature of k numbers."""
        return FeatureRows(self.program.rows(k), self.program.rows(k, 6))

    def computed(self, stage: Stage, k: int, **given: Any) -> FeatureRows:
        """Add the stage of a feature of k numbers, and return the rows that it fills."""
        rows = self.room(k)
        self.program.add(stage, **rows._asdict(), **given)
        return rows

    @property
    def image(self) -> dict[str, Rows]:
        """The rows of points and depths, as stages take them by name."""
        return {"points": self.points, "depth": self.depth}

    def observation(self, blocks: Blocks, cameras: Sequence[Camera]) -> Observation:
        """Return what is seen in blocks, by a camera or a pair of them."""
        camera, *others = cameras
        get = blocks.get
        model = get(self.model)
        seen = known(
            Observation,
            pixels_last=frozen(get(self.pixels)),
            points_last=frozen(get(self.points)),
            depth_last=frozen(get(self.depth)),
            camera=camera.of_runs(blocks.rows),
            model=frozen(model if (model != model[..., :1]).any() else model[..., 0].copy()),
            guess_last=frozen(get(self.guess)),
            runs=frozen(blocks.rows.view()),
            weights_last=None if self.weights is None else frozen(get(self.weights)),
        )
        if self.other is None or self.between is None:
            return seen
        between = frozen(get(self.between))
        other = self.other.observation(blocks, others)
        return unchecked(seen, other=other, between_last=between)

    def some(self, marks: NDArray[np.int64]) -> Seen:
        """Return the rows of some of the marks, with the stage that copies them."""
        names = ["pixels", "points", "depth", "model"]
        if self.weights is not None:
            names.append("weights")
        program, own = self.program, vars(self)
        chosen: dict[str, Any] = {name: picked(program, own[name], marks) for name in names}
        other = None if self.other is None else self.other.some(marks)
        return replace(self, N=len(marks), **chosen, other=other)


def picked(program: Program, rows: Rows, which: NDArray[np.int64]) -> Rows:
    """Add the stages that copy some entries of rows (n, ...), by number; return the new rows."""
    if which.tolist() == list(range(rows.shape[0])):
        return rows
    found = program.rows(len(which), *rows.shape[1:])
    for i, n in enumerate(which.tolist()):
        program.add(commanding.copied, rows=rows[n].flat, to=found[i].flat)
    return found


def joined(program: Program, parts: Sequence[Rows]) -> Rows:
    """Return rows of parts that follow one another, copied if there are several."""
    if len(parts) == 1:
        return parts[0]
    found, at = program.rows(sum(part.shape[0] for part in parts), *parts[0].shape[1:]), 0
    for part in parts:
        program.add(commanding.copied, rows=part.flat, to=found[at : at + part.shape[0]].flat)
        at += part.shape[0]
    return found
