"""The protocol of features, and the observation from which they are computed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import (
    Array,
    as_floats,
    make_read_only,
    move_runs_first,
    move_runs_last,
    view_for_user,
)
from robsim.base.errors import InputError, format_value
from robsim.base.value import construct_unchecked, replace_unchecked
from robsim.declare import Number, family
from robsim.features.observation_checks import check_image, check_observation_fields, convert_poses
from robsim.geometry.pose import homogeneous_matrix
from robsim.kernels.estimation.pose_fit import fit_pose
from robsim.vision.camera import Camera
from robsim.vision.pose_estimation import estimate_pose

FEATURES = family("feature")
Tolerance = Annotated[
    float, Number(above=0), "Largest |e| that counts as arrived, in the unit of the feature."
]


@dataclass(frozen=True, eq=False)
class Observation:
    """The controller's knowledge of N marks at one instant, for B runs.

    `Observation.of` makes one. Names that end in `_last` are in the kernels' layout, the run last;
    the properties beside them are run-first views of the same numbers, for features written in
    plain NumPy. All of them are read-only.

    InputError: arrays of no runs or marks, of unequal numbers of them, or with infinite numbers.
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
    weights_last: Array | None = None  # (N, B) of marks in the estimate of the pose; None: all 1

    def __post_init__(self) -> None:
        vars(self).update(check_observation_fields(vars(self)))

    @property
    def pixels(self) -> Array:
        """The measured pixels (B, N, 2) = (column, row)."""
        return view_for_user(self.pixels_last)

    @property
    def points(self) -> Array:
        """The normalised image points (B, N, 2) = (x, y), undistorted, at unit depth."""
        return view_for_user(self.points_last)

    @property
    def depth(self) -> Array:
        """The depths (B, N) in metres, as the controller believes them."""
        return view_for_user(self.depth_last)

    @property
    def K(self) -> Array:
        """The intrinsics (3, 3) as the controller believes them."""
        return np.asarray(self.camera.K)

    @property
    def pose(self) -> Array:
        """The pose T_c_o (B, 4, 4) of the target, estimated from the image and the model."""
        return homogeneous_matrix(self.pose_last)

    @cached_property
    def pose_last(self) -> Array:
        """The pose T_c_o (3, 4, B); without the guess where that is behind the camera."""
        if self.model is None or self.guess_last is None:
            raise InputError("a pose needs the model of the target and a guess; here are none")
        T, points = np.empty_like(self.guess_last), self.points_last.copy()
        weights = None if self.weights_last is None else self.weights_last.copy()
        marks = repeat_marks(self.model, points.shape[-1])
        fit_pose(marks, points, self.guess_last.copy(), T, weights)
        return make_read_only(refit_lost_poses(T, self.model, points))

    @classmethod
    def of(
        cls,
        pixels: ArrayLike,
        depth: ArrayLike,
        camera: Camera,
        *,
        model: ArrayLike | None = None,
        guess: Any = None,
        pose: Any = None,
        other: Observation | None = None,
        between: Any = None,
    ) -> Observation:
        """Return an observation of pixels (B, N, 2) at depths (B, N) in metres by a camera.

        Of a single run (N, 2) and (N,) do. NaN stands for marks that are not seen.

        model     marks (N, 3) in axes of the target, metres
        guess     pose T_c_o (4, 4) or (B, 4, 4) from which the estimate of the target's starts
        pose      that pose itself, where it is known
        other     the same marks as a second camera sees them
        between   pose (4, 4) or (B, 4, 4) of the second camera in the first

        InputError: unequal numbers of runs or marks, infinite numbers.

        >>> seen = Observation.of([[0.1, 0.2], [0.3, 0.4]], [1.0, 2.0], Camera(np.eye(3)))
        >>> seen.points.shape, seen.depth
        ((1, 2, 2), array([[1., 2.]]))
        """
        given = check_image(pixels, depth, camera)
        runs = given[0].shape[-1]
        made = cls(
            *given,
            camera,
            None if model is None else as_floats(model, "model", ("N", 3)),
            convert_poses(guess, "guess", runs),
            other,
            convert_poses(between, "between", runs),
        )
        if pose is not None:
            vars(made)["pose_last"] = convert_poses(pose, "pose", runs)
        return made

    @classmethod
    def of_last(cls, pixels: Array, depth: Array, camera: Camera, **more: Any) -> Observation:
        """Return an observation of pixels (N, 2, B) at depths (N, B), known to be right."""
        points = camera.points_of(pixels)
        given = {"pixels_last": pixels, "points_last": points, "depth_last": depth, **more}
        shown = {
            name: make_read_only(part.view()) if isinstance(part, np.ndarray) else part
            for name, part in given.items()
        }
        return construct_unchecked(cls, camera=camera, **shown)

    def blind(self, hidden: Sequence[NDArray[np.bool_]]) -> Observation:
        """Return the observation with NaN for marks that are hidden (N, B) from each camera."""
        mine, *others = hidden
        gone = mine[:, None]
        points = self._each(lambda x: np.where(gone, np.nan, x), "pixels_last", "points_last")
        depth = make_read_only(np.where(mine, np.nan, self.depth_last))
        other = self.other and self.other.blind(others)
        return replace_unchecked(self, **points, depth_last=depth, other=other)

    def repeated(self, runs: int) -> Observation:
        """Return the observation of the first run as one of so many that see the same."""
        names = ["pixels_last", "points_last", "depth_last", "guess_last", "between_last"]
        if self.model is not None and self.model.ndim > 2:
            names.append("model")
        return replace_unchecked(
            self,
            **self._each(lambda x: np.repeat(x[..., :1], runs, axis=-1), *names),
            camera=self.camera.of_runs(np.zeros(1, dtype=np.int64)),
            other=self.other and self.other.repeated(runs),
            runs=np.zeros(runs, dtype=np.int64),
        )

    def some(self, marks: NDArray[np.int64]) -> Observation:
        """Return the observation of some of the marks, by number."""
        names = "pixels_last", "points_last", "depth_last", "model", "weights_last"
        other = self.other and self.other.some(marks)
        return replace_unchecked(self, **self._each(lambda x: x[marks], *names), other=other)

    def _each(self, change: Callable[[Array], Array], *names: str) -> dict[str, Array | None]:
        """Return some arrays after a change, read-only, by their names; None of None."""
        arrays = {name: getattr(self, name) for name in names}
        return {
            name: None if x is None else make_read_only(change(x)) for name, x in arrays.items()
        }


def check_goal_observation(given: Any, who: str) -> Observation:
    """Return what is given for the view at the goal, or raise an InputError unless it is one."""
    if not isinstance(given, Observation):
        raise InputError(f"{who}.towards: expected an Observation, got {format_value(given)}")
    return given


def refit_lost_poses(T: Array, model: Array, points: Array) -> Array:
    """Return poses (3, 4, B), those that are NaN from normalised points (N, 2, B) alone.

    Where all marks, (N, 3) or (N, 3, B), are seen, the guess was behind the camera.
    """
    lost = np.isnan(T[0, 0]) & np.isfinite(points).all(axis=(0, 1))
    if not lost.any() or len(model) < 3:
        return T
    if model.ndim > 2 and (model != model[..., :1]).any():
        for b in np.flatnonzero(lost):
            T[..., b : b + 1] = _estimate_poses(model[..., b], points[..., b : b + 1])
        return T
    T[..., lost] = _estimate_poses(model if model.ndim == 2 else model[..., 0], points[..., lost])
    return T


def _estimate_poses(model: Array, points: Array) -> Array:
    """Return poses (3, 4, B) of marks (N, 3) from normalised points (N, 2, B) alone."""
    found = estimate_pose(model, move_runs_first(points), Camera(np.eye(3)))
    return move_runs_last(found.T_c_o[:, :3], 2)


def repeat_marks(model: Array, runs: int) -> Array:
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
    `uses_depth`, false if neither s nor L reads `seen.depth`;
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
