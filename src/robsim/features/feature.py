"""The protocol of features, and the observation from which they are computed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen, runs_first, runs_last, shown_view
from robsim.base.errors import InputError
from robsim.declare import Number, family
from robsim.geometry.pose import homogeneous
from robsim.kernels.pose import fit_pose
from robsim.vision.camera import Camera
from robsim.vision.pose_estimation import estimate_pose

FEATURES = family("feature")
Tolerance = Annotated[
    float, Number(above=0), "Largest |e| that counts as arrived, in the unit of the feature."
]


@dataclass(eq=False)  # not frozen: one is made in every step
class Observation:
    """The controller's knowledge of N marks at one instant, for B runs.

    Names that end in `_last` are in the kernels' layout, the run last; the properties beside them
    are run-first views of the same numbers, for features written in plain NumPy.
    """

    pixels_last: Array  # (N, 2, B) measured pixels (column, row)
    points_last: Array  # (N, 2, B) the same, normalised: undistorted, at unit depth
    depth_last: Array  # (N, B) metres, as the controller believes it
    camera: Camera  # as the controller believes it
    model: Array | None = None  # (N, 3) marks in axes of the target, as believed; or (N, 3, B)
    guess_last: Array | None = None  # (3, 4, B) where the estimate of the pose starts
    other: Observation | None = None  # the same marks, as the second camera of a pair sees them
    between_last: Array | None = None  # (3, 4, B) pose of the second camera in this one
    runs: NDArray[np.int64] | None = None  # (B,) numbers of the runs, where these are not all

    @property
    def pixels(self) -> Array:
        """The measured pixels (B, N, 2) = (column, row)."""
        return shown_view(self.pixels_last)

    @property
    def points(self) -> Array:
        """The normalised image points (B, N, 2) = (x, y), undistorted, at unit depth."""
        return shown_view(self.points_last)

    @property
    def depth(self) -> Array:
        """The depths (B, N) in metres, as the controller believes them."""
        return shown_view(self.depth_last)

    @property
    def K(self) -> Array:
        """The intrinsics (3, 3) as the controller believes them."""
        return np.asarray(self.camera.K)

    @property
    def pose(self) -> Array:
        """The pose T_c_o (B, 4, 4) of the target, estimated from the image and the model."""
        return homogeneous(self.pose_last)

    @cached_property
    def pose_last(self) -> Array:
        """The pose T_c_o (3, 4, B); without the guess where that is behind the camera."""
        if self.model is None or self.guess_last is None:
            raise InputError("a pose needs the model of the target and a guess; here are none")
        T = np.empty_like(self.guess_last)
        marks = each_run(self.model, self.points_last.shape[-1])
        fit_pose(marks, self.points_last, self.guess_last, T)
        return without_guess(T, self.model, self.points_last)

    @classmethod
    def of(cls, pixels: Array, depth: Array, camera: Camera) -> Observation:
        """Return an observation of pixels (N, 2, B) at depths (N, B) in metres by a camera."""
        return cls(pixels, camera.points_of(pixels), depth, camera)

    def blind(self, hidden: Sequence[NDArray[np.bool_]]) -> Observation:
        """Return the observation with NaN for marks that are hidden (N, B) from each camera."""
        mine, *others = hidden
        gone = mine[:, None]
        return replace(
            self,
            pixels_last=np.where(gone, np.nan, self.pixels_last),
            points_last=np.where(gone, np.nan, self.points_last),
            depth_last=np.where(mine, np.nan, self.depth_last),
            other=self.other and self.other.blind(others),
        )

    def repeated(self, runs: int) -> Observation:
        """Return the observation of a single run as one of so many that see the same."""
        guess, between = self.guess_last, self.between_last
        return replace(
            self,
            pixels_last=np.repeat(self.pixels_last, runs, axis=-1),
            points_last=np.repeat(self.points_last, runs, axis=-1),
            depth_last=np.repeat(self.depth_last, runs, axis=-1),
            guess_last=None if guess is None else np.repeat(guess, runs, axis=-1),
            other=self.other and self.other.repeated(runs),
            between_last=None if between is None else np.repeat(between, runs, axis=-1),
        )

    def some(self, marks: NDArray[np.int64]) -> Observation:
        """Return the observation of some of the marks, by number."""
        return replace(
            self,
            pixels_last=self.pixels_last[marks],
            points_last=self.points_last[marks],
            depth_last=self.depth_last[marks],
            model=None if self.model is None else frozen(self.model[marks]),
            other=None if self.other is None else self.other.some(marks),
        )


def without_guess(T: Array, model: Array, points: Array) -> Array:
    """Return poses (3, 4, B), those that are NaN from normalised points (N, 2, B) alone.

    Where all marks, (N, 3) or (N, 3, B), are seen, the guess was behind the camera.
    """
    lost = np.isnan(T[0, 0]) & np.isfinite(points).all(axis=(0, 1))
    if not lost.any() or len(model) < 3:
        return T
    if model.ndim > 2 and (model != model[..., :1]).any():
        for b in np.flatnonzero(lost):
            T[..., b : b + 1] = _estimated(model[..., b], points[..., b : b + 1])
        return T
    T[..., lost] = _estimated(model if model.ndim == 2 else model[..., 0], points[..., lost])
    return T


def _estimated(model: Array, points: Array) -> Array:
    """Return poses (3, 4, B) of marks (N, 3) from normalised points (N, 2, B) alone."""
    found = estimate_pose(model, runs_first(points), Camera(np.eye(3)))
    return runs_last(found.T_c_o[:, :3], 2)


def each_run(model: Array, runs: int) -> Array:
    """Return marks (N, 3, B) of each run from those of all, or as they are."""
    return model if model.ndim > 2 else np.repeat(model[..., None], runs, axis=-1)


@runtime_checkable
class Feature(Protocol):
    """The protocol of a feature for visual servoing; a user's class needs no base class.

    `unit` is that of s, `tolerance` the largest |e| that counts as arrived. To give the same bits
    in any batch, compute element by element over the runs (see `robsim.testing.check_feature`).

    A feature may also have
    `interaction(seen)`, L (B, k, 6) with sdot = L V_c, V_c = (v, omega) in camera axes; without it
    L is found by moving the camera a little, numerically;
    `towards(goal)`, which gives the feature that is measured relative to what is seen at the goal;
    `least_marks`, how many marks it needs; `measures_depth`, true if s itself depends on depth;
    `uses_pose`, true if it reads `seen.pose`; `cameras`, 2 if it reads `seen.other`.
    """

    @property
    def unit(self) -> str:
        """The unit of s, such as "px" or "1"."""

    @property
    def tolerance(self) -> float:
        """The tolerance: a run has converged when max|e| is below it."""

    def measure(self, seen: Observation) -> Array:
        """Return the features s (B, k)."""
