"""The intrinsics of a fisheye lens from views of a target, by least squares."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.calibration.calibration_model import add_lens_step, predict_pose_rates
from robsim.geometry.pose import Pose
from robsim.vision.camera import Camera
from robsim.vision.pose_estimation import estimate_pose

ANGLES = np.radians([180.0, 140.0, 100.0, 60.0, 220.0])  # fields of view of the first estimates
ROUNDS = 200
CONVERGED = 1e-14  # relative decrease of the sum of squares


class TargetViews(NamedTuple):
    """The marks (N, 3) of a target, their pixels (V, N, 2), and which of them (V, N) are seen."""

    marks: Array
    pixels: Array
    seen: NDArray[np.bool_]

    def linearise(
        self, camera: Camera, poses: Array, free: NDArray[np.int64]
    ) -> tuple[Array, Array, Array]:
        """Return the residuals (V, 2N), and their derivatives by poses and by the lens."""
        predicted, J = predict_pose_rates(poses, self.marks, camera, free)
        residuals = np.where(self.seen[..., None], predicted - self.pixels, 0.0)
        J = np.where(self.seen[..., None, None], J, 0.0).reshape(len(poses), -1, J.shape[-1])
        return residuals.reshape(len(poses), -1), J[..., :6], J[..., 6:]


class FisheyeFit(NamedTuple):
    """A camera, poses (V, 4, 4) of the target, and the sum of squared distances in pixels."""

    camera: Camera
    poses: Array
    squares: float


def fit_fisheye(
    views: TargetViews, size: tuple[int, int], count: int, guess: Camera | None
) -> FisheyeFit:
    """Return the fisheye lens with `count` coefficients, 0 or 4, of least squared distances.

    Coefficients that are not estimated are zero. Without a guess the first estimate is the best of
    equidistant lenses with several fields of view, and the coefficients are estimated last.
    """
    if guess is not None:
        guess = guess.revised(size=size, distortion=guess.distortion if count else ())
    starts = [fit for fit in _list_starts(views, size, guess) if np.isfinite(fit.squares)]
    if not starts:
        raise InputError("pixels: no pose of the target fits some view: give guess=")
    first = min(starts, key=lambda fit: fit.squares)
    plain = first if guess is not None and count else _minimise(views, first, 0)
    return _minimise(views, plain, count)


def _list_starts(
    views: TargetViews, size: tuple[int, int], guess: Camera | None
) -> Iterator[FisheyeFit]:
    """Yield the first estimates, with poses that fit each view alone."""
    cameras = [] if guess is None else [guess]
    for angle in () if cameras else ANGLES:
        focal = max(size) / angle
        K = [[focal, 0, size[0] / 2 - 0.5], [0, focal, size[1] / 2 - 0.5], [0, 0, 1]]
        cameras.append(Camera(K, size, lens="fisheye"))
    for camera in cameras:
        each = zip(views.pixels, views.seen, strict=True)
        poses = [estimate_pose(views.marks[s], u[s], camera).T_c_o for u, s in each]
        yield _measure(views, camera, np.array(poses))


def _measure(views: TargetViews, camera: Camera, poses: Array) -> FisheyeFit:
    """Return a fit with its sum of squares, which is infinite if a mark has no image."""
    residuals, *_ = views.linearise(camera, poses, np.arange(0))
    squares = float(np.square(residuals).sum())
    return FisheyeFit(camera, poses, squares if np.isfinite(squares) else np.inf)


def _minimise(views: TargetViews, fit: FisheyeFit, count: int) -> FisheyeFit:
    """Return the minimum of the squares near a fit, by the method of Levenberg and Marquardt."""
    free, damping = np.arange(4 + count), 1e-3
    for _ in range(ROUNDS):
        trial = _step(views, fit, free, damping)
        if trial.squares < fit.squares:
            last, fit, damping = fit.squares, trial, 0.1 * damping
            if last - fit.squares <= CONVERGED * last:
                break
        elif damping > 1e8:
            break
        else:
            damping *= 10.0
    return fit


def _step(
    views: TargetViews, fit: FisheyeFit, free: NDArray[np.int64], damping: float
) -> FisheyeFit:
    """Return the fit after one damped step, with the poses eliminated."""
    residuals, A, B = views.linearise(fit.camera, fit.poses, free)
    U, W, g = A.swapaxes(1, 2) @ A, A.swapaxes(1, 2) @ B, A.swapaxes(1, 2) @ residuals[..., None]
    U = U + damping * U * np.eye(6)
    M, h = (B.swapaxes(1, 2) @ B).sum(axis=0), (B.swapaxes(1, 2) @ residuals[..., None]).sum(axis=0)
    M = M + damping * M * np.eye(len(free)) - (W.swapaxes(1, 2) @ np.linalg.solve(U, W)).sum(axis=0)
    h = h - (W.swapaxes(1, 2) @ np.linalg.solve(U, g)).sum(axis=0)
    lens = -np.linalg.solve(M, h)[:, 0]
    twists = -np.linalg.solve(U, g + W @ lens[:, None])[..., 0]
    try:
        camera = add_lens_step(fit.camera, lens, free)
    except InputError:  # a focal length below zero
        return fit
    return _measure(views, camera, np.asarray((Pose(fit.poses) @ Pose.exp(twists)).matrix))


def estimate_deviations(views: TargetViews, fit: FisheyeFit, count: int) -> tuple[Array, Array]:
    """Return the standard deviations (4 + count,) of fx, fy, cx, cy and the coefficients.

    The second array are the root mean squares (V,) of the distances in each view, in pixels.
    """
    free, views_count = np.arange(4 + count), len(views.pixels)
    residuals, A, B = views.linearise(fit.camera, fit.poses, free)
    U, W = A.swapaxes(1, 2) @ A, A.swapaxes(1, 2) @ B
    M = (B.swapaxes(1, 2) @ B - W.swapaxes(1, 2) @ np.linalg.solve(U, W)).sum(axis=0)
    excess = 2 * int(views.seen.sum()) - 6 * views_count - len(free)
    variance = fit.squares / max(excess, 1)
    errors = np.sqrt(np.square(residuals).sum(axis=1) / views.seen.sum(axis=1))
    return np.sqrt(variance * np.diag(np.linalg.inv(M))), errors
