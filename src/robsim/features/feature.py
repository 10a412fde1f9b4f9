"""The protocol of features, and the observation that they measure."""

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
from robsim.features.images.inverse_depth import fit_inverse_depth
from robsim.features.observation_checks import (
    check_image,
    check_observation_fields,
    check_pictures,
    convert_poses,
)
from robsim.geometry.pose import PoseLike, homogeneous_matrix
from robsim.kernels.estimation.pose_fit import fit_pose
from robsim.vision.camera import Camera
from robsim.vision.pose_estimation import estimate_pose

FEATURES = family("feature")
Tolerance = Annotated[
    float, Number(above=0), "Largest |e| at convergence, in the unit of the feature."
]


@dataclass(frozen=True, eq=False)
class Observation:
    """Marks as a controller observes them at one instant, for B runs.

    `Observation.of` makes an observation from arrays with the run first. The fields that end in
    `_last` have the run last, as the kernels do; the properties `pixels`, `points`, `depth` and
    `pose` are run-first views of the same numbers, for features in plain NumPy. All arrays are
    read-only.

    Attributes
    ----------
    pixels_last : ndarray of shape (N, 2, B)
        Measured pixels (column, row). NaN for a mark that is not measured.
    points_last : ndarray of shape (N, 2, B)
        Normalised image points: undistorted, at unit depth.
    depth_last : ndarray of shape (N, B)
        Believed depths in metres.
    camera : Camera
        Believed camera.
    model : ndarray of shape (N, 3) or (N, 3, B), optional
        Believed positions of the marks in axes of the target, in metres.
    guess_last : ndarray of shape (3, 4, B), optional
        Start of the estimate of the pose T_c_o.
    other : Observation, optional
        The same marks observed by the second camera of a stereo pair.
    between_last : ndarray of shape (3, 4, B), optional
        Pose of the second camera in axes of the first camera.
    runs : ndarray of shape (B,), optional
        Indices of the observed runs. Default: all runs.
    weights_last : ndarray of shape (N, B), optional
        Weights of the marks in the estimate of the pose. Default: 1 for every mark.
    pictures : ndarray of uint8, shape (B, h, w), optional
        Grey values of the whole picture, for features with `uses_pictures`.
    plane_last : ndarray of shape (3, B), optional
        Coefficients (a, b, c) of the believed inverse depth 1/Z = a x + b y + c of the plane of the
        target at the normalised point (x, y), in 1/m. Given with `pictures`.
    time : float, default 0
        Seconds since the start of the run.

    Raises
    ------
    InputError
        If an array has no runs or no marks, if the numbers of runs or marks differ, or if a number
        is infinite.

    Examples
    --------
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])
    >>> seen = Observation.of([[400, 240]], [2.0], camera)
    >>> seen.pixels, seen.points
    (array([[[400., 240.]]]), array([[[0.1, 0. ]]]))
    """

    pixels_last: Array
    points_last: Array
    depth_last: Array
    camera: Camera
    model: Array | None = None
    guess_last: Array | None = None
    other: Observation | None = None
    between_last: Array | None = None
    runs: NDArray[np.int64] | None = None
    weights_last: Array | None = None
    pictures: NDArray[np.uint8] | None = None
    plane_last: Array | None = None
    time: float = 0.0

    def __post_init__(self) -> None:
        vars(self).update(check_observation_fields(vars(self)))

    @property
    def pixels(self) -> Array:
        """Measured pixels (B, N, 2) = (column, row)."""
        return view_for_user(self.pixels_last)

    @property
    def points(self) -> Array:
        """Normalised image points (B, N, 2) = (x, y), undistorted, at unit depth."""
        return view_for_user(self.points_last)

    @property
    def depth(self) -> Array:
        """Believed depths (B, N) in metres."""
        return view_for_user(self.depth_last)

    @property
    def K(self) -> Array:
        """Believed intrinsic matrix (3, 3)."""
        return np.asarray(self.camera.K)

    @property
    def pose(self) -> Array:
        """Pose T_c_o (B, 4, 4) of the target, estimated from the image and the model."""
        return homogeneous_matrix(self.pose_last)

    @cached_property
    def pose_last(self) -> Array:
        """Pose T_c_o (3, 4, B); estimated without the guess if the guess is behind the camera."""
        if self.model is None or self.guess_last is None:
            raise InputError("a pose needs the model of the target and a guess; there is none")
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
        guess: PoseLike | None = None,
        pose: PoseLike | None = None,
        other: Observation | None = None,
        between: PoseLike | None = None,
        pictures: ArrayLike | None = None,
    ) -> Observation:
        """Return an observation of pixels and depths by a camera.

        Parameters
        ----------
        pixels : array_like of shape (B, N, 2) or (N, 2)
            Measured pixels (column, row). NaN for a mark that is not measured.
        depth : array_like of shape (B, N) or (N,)
            Depths of the marks in metres.
        camera : Camera
            Believed camera.
        model : array_like of shape (N, 3), optional
            Positions of the marks in axes of the target, in metres. A pose needs it.
        guess : Pose or array_like of shape (4, 4) or (B, 4, 4), optional
            Start of the estimate of the pose T_c_o.
        pose : Pose or array_like of shape (4, 4) or (B, 4, 4), optional
            Known pose T_c_o, which replaces the estimate.
        other : Observation, optional
            The same marks observed by a second camera.
        between : Pose or array_like of shape (4, 4) or (B, 4, 4), optional
            Pose of the second camera in axes of the first camera.
        pictures : array_like of uint8, shape (B, h, w) or (h, w), optional
            Grey values of whole pictures. The plane of the target is fitted to the marks.

        Returns
        -------
        Observation
            The observation of B runs; one run if `pixels` has no axis of runs.

        Raises
        ------
        InputError
            If the numbers of runs or marks differ, or if a number is infinite.

        Examples
        --------
        >>> seen = Observation.of([[0.1, 0.2], [0.3, 0.4]], [1.0, 2.0], Camera(np.eye(3)))
        >>> seen.points.shape, seen.depth
        ((1, 2, 2), array([[1., 2.]]))
        """
        image = check_image(pixels, depth, camera)
        runs = image[0].shape[-1]
        observation = cls(
            *image,
            camera,
            None if model is None else as_floats(model, "model", ("N", 3)),
            convert_poses(guess, "guess", runs),
            other,
            convert_poses(between, "between", runs),
        )
        if pictures is not None:
            plane = make_read_only(fit_inverse_depth(image[1], image[2]))
            vars(observation).update(pictures=check_pictures(pictures, runs), plane_last=plane)
        if pose is not None:
            vars(observation)["pose_last"] = convert_poses(pose, "pose", runs)
        return observation

    @classmethod
    def of_last(
        cls, pixels: Array, depth: Array, camera: Camera, **more: Array | Observation | None
    ) -> Observation:
        """Return an observation from valid arrays with the run last, without checks.

        Parameters
        ----------
        pixels : ndarray of shape (N, 2, B)
            Measured pixels.
        depth : ndarray of shape (N, B)
            Depths in metres.
        camera : Camera
            Believed camera.
        **more
            Other fields by name.

        Returns
        -------
        Observation
            The observation, with read-only views of the arrays.
        """
        points = camera.points_of(pixels)
        fields = {"pixels_last": pixels, "points_last": points, "depth_last": depth, **more}
        views = {
            name: make_read_only(part.view()) if isinstance(part, np.ndarray) else part
            for name, part in fields.items()
        }
        return construct_unchecked(cls, camera=camera, **views)

    def blind(self, hidden: Sequence[NDArray[np.bool_]]) -> Observation:
        """Return the observation with NaN for hidden marks.

        Parameters
        ----------
        hidden : sequence of ndarray of bool of shape (N, B)
            Hidden marks, for each camera.

        Returns
        -------
        Observation
            The observation without the hidden marks.
        """
        mine, *others = hidden
        missing = mine[:, None]
        points = self._change_arrays(
            lambda x: np.where(missing, np.nan, x), "pixels_last", "points_last"
        )
        depth = make_read_only(np.where(mine, np.nan, self.depth_last))
        other = self.other and self.other.blind(others)
        return replace_unchecked(self, **points, depth_last=depth, other=other)

    def repeated(self, runs: int) -> Observation:
        """Return the observation with the first run repeated.

        Parameters
        ----------
        runs : int
            Number of repetitions.

        Returns
        -------
        Observation
            The observation of `runs` equal runs.
        """
        names = ["pixels_last", "points_last", "depth_last", "guess_last", "between_last"]
        if self.model is not None and self.model.ndim > 2:
            names.append("model")
        return replace_unchecked(
            self,
            **self._change_arrays(lambda x: np.repeat(x[..., :1], runs, axis=-1), *names),
            camera=self.camera.of_runs(np.zeros(1, dtype=np.int64)),
            other=self.other and self.other.repeated(runs),
            runs=np.zeros(runs, dtype=np.int64),
            pictures=None if self.pictures is None else np.repeat(self.pictures[:1], runs, axis=0),
            plane_last=None
            if self.plane_last is None
            else np.repeat(self.plane_last[:, :1], runs, axis=1),
        )

    def of_runs(self, runs: NDArray[np.int64]) -> Observation:
        """Return the observation of some of the runs.

        Parameters
        ----------
        runs : ndarray of int
            Places of the runs in this observation.

        Returns
        -------
        Observation
            The observation of these runs, in this order.
        """
        names = ["pixels_last", "points_last", "depth_last", "guess_last", "between_last"]
        names += ["weights_last", "plane_last"]
        if self.model is not None and self.model.ndim > 2:
            names.append("model")
        return replace_unchecked(
            self,
            **self._change_arrays(lambda x: x[..., runs], *names),
            other=self.other and self.other.of_runs(runs),
            runs=None if self.runs is None else self.runs[runs],
            pictures=None if self.pictures is None else self.pictures[runs],
        )

    def some(self, marks: NDArray[np.int64]) -> Observation:
        """Return the observation of some of the marks.

        Parameters
        ----------
        marks : ndarray of int
            Indices of the marks.

        Returns
        -------
        Observation
            The observation of these marks, in this order.
        """
        names = "pixels_last", "points_last", "depth_last", "model", "weights_last"
        other = self.other and self.other.some(marks)
        return replace_unchecked(
            self, **self._change_arrays(lambda x: x[marks], *names), other=other
        )

    def _change_arrays(
        self, change: Callable[[Array], Array], *names: str
    ) -> dict[str, Array | None]:
        """Return some arrays after a change, read-only, by name; None stays None."""
        arrays = {name: getattr(self, name) for name in names}
        return {
            name: None if x is None else make_read_only(change(x)) for name, x in arrays.items()
        }


def reads_pictures(feature: object) -> bool:
    """Return whether a feature is measured from whole pictures instead of marks."""
    return bool(getattr(feature, "uses_pictures", False))


def check_goal_observation(value: Any, who: str) -> Observation:
    """Return the observation at the goal; raise InputError unless it is an Observation."""
    if not isinstance(value, Observation):
        raise InputError(f"{who}.towards: expected an Observation, got {format_value(value)}")
    return value


def refit_lost_poses(T: Array, model: Array, points: Array) -> Array:
    """Return poses (3, 4, B), with lost poses estimated from normalised points (N, 2, B) alone.

    A pose is lost if it is NaN although all marks (N, 3) or (N, 3, B) are measured: its guess was
    behind the camera.
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
    """Return poses (3, 4, B) of marks (N, 3), estimated from normalised points (N, 2, B) alone."""
    estimate = estimate_pose(model, move_runs_first(points), Camera(np.eye(3)))
    return move_runs_last(estimate.T_c_o[:, :3], 2)


def repeat_marks(model: Array, runs: int) -> Array:
    """Return the marks (N, 3, B) of each run, repeated if all runs share marks (N, 3)."""
    return model if model.ndim > 2 else np.repeat(model[..., None], runs, axis=-1)


@runtime_checkable
class Feature(Protocol):
    """Protocol of a feature for visual servoing; a class of a user needs no base class.

    A feature computes s from an `Observation`. To give the same bits in any batch, compute element
    by element over the runs (see `robsim.testing.check_feature`).

    Attributes
    ----------
    unit : str
        Unit of s, such as "px" or "1".
    tolerance : float
        Largest |e| at convergence.

    Notes
    -----
    These methods and attributes are optional:

    - `interaction(seen)` returns L (B, k, 6) with sdot = L V_c for the twist V_c = (v, omega) in
      camera axes. Without it RobSim differentiates `measure` by small motions of the camera.
    - `towards(goal)` returns the feature measured relative to the observation at the goal.
    - `least_marks`: smallest number of marks.
    - `measures_depth`: True if s depends on depth.
    - `uses_depth`: False if neither s nor L reads `seen.depth`.
    - `uses_pose`: True if the feature reads `seen.pose`.
    - `cameras`: 2 if the feature reads `seen.other`.
    - `uses_pictures`: True if the feature reads `seen.pictures`. The marks may then leave the
      image.
    - `zero_at_goal`: True if s_goal is 0 instead of s at the goal.
    - `step`: with `uses_pictures`, the largest step of the camera at convergence, in m and rad;
      without it, or 0, the error alone decides.

    Examples
    --------
    >>> class Distance:
    ...     unit, tolerance = "m", 1e-3
    ...     def measure(self, seen):
    ...         return seen.depth[:, :1]
    >>> isinstance(Distance(), Feature)
    True
    """

    @property
    def unit(self) -> str:
        """Unit of s, such as "px" or "1"."""

    @property
    def tolerance(self) -> float:
        """Tolerance: a run has converged if max|e| is below it."""

    def measure(self, seen: Observation) -> Array:
        """Return the features.

        Parameters
        ----------
        seen : Observation
            Marks of B runs.

        Returns
        -------
        ndarray of shape (B, k)
            Features s. NaN for a component without a value.
        """
