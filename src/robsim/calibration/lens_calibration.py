"""The intrinsics and the distortion of a camera from images of a target."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, as_floats, as_integer, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.base.text_tables import align_columns
from robsim.base.value import Value
from robsim.calibration.calibration_model import lens_names
from robsim.calibration.fisheye_calibration import TargetViews, estimate_deviations, fit_fisheye
from robsim.declare.error_phrases import join_alternatives
from robsim.geometry.pose import Pose
from robsim.vision.camera import Camera
from robsim.vision.camera_checks import check_lens
from robsim.vision.image_size import SIZE
from robsim.vision.lens_models import LensModel
from robsim.vision.plane import estimate_homography
from robsim.vision.tags.board import Board
from robsim.vision.tags.tag import Tag
from robsim.vision.tags.tag_families import import_opencv

FEWEST_VIEWS, FEWEST_MARKS = 3, 4
FLAT = 1e-9  # relative to the size of the target: distance of marks from their plane
PARALLEL = np.radians(5)  # planes of views with smaller angles between them count as parallel


@dataclass(frozen=True, eq=False, repr=False)
class LensCalibration(Value):
    """The intrinsics and the distortion of a camera, the result of `calibrate_lens`.

    Attributes
    ----------
    camera : Camera
        Camera with its size.
    rms : float
        Root mean square of the distances in the image, in pixels.
    deviations : dict of str to float
        Standard deviation of each parameter by its name: fx, fy, cx and cy in pixels, and the
        distortion coefficients.
    poses : Pose of shape (V, 4, 4)
        Poses T_c_o of the target in each view.
    errors : ndarray of shape (V,)
        Root mean square of the distances in each view, in pixels.

    Examples
    --------
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], (640, 480))
    >>> LensCalibration(camera, 0.2, {}, Pose.at(0, 0, [1, 1, 1]), np.full(3, 0.2))
    <LensCalibration from 3 views: rms 0.2 px>
    """

    camera: Camera
    rms: float
    deviations: dict[str, float]
    poses: Pose
    errors: Array

    def __str__(self) -> str:
        """Return a table of the parameters with their standard deviations."""
        K = self.camera.K
        values = [*K[[0, 1, 0, 1], [0, 1, 2, 2]].tolist(), *self.camera.distortion]
        pairs = zip(lens_names(self.camera), values, self.deviations.values(), strict=False)
        rows = [("number", "value", "std"), *((n, f"{x:.6g}", f"{s:.2g}") for n, x, s in pairs)]
        return "\n".join(
            [repr(self), *align_columns([list(c) for c in zip(*rows, strict=True)], 1)]
        )

    def __repr__(self) -> str:
        return f"<LensCalibration from {len(self.errors)} views: rms {self.rms:.3g} px>"


def calibrate_lens(
    target: Board | Tag | ArrayLike,
    pixels: ArrayLike,
    size: Sequence[int],
    *,
    lens: Literal["perspective", "fisheye"] = "perspective",
    coefficients: int | None = None,
    guess: Camera | None = None,
) -> LensCalibration:
    """Return the intrinsics and the distortion of a camera from views of a target.

    The method for a perspective lens is Zhang 2000, as implemented by `cv2.calibrateCamera`, which
    also estimates the standard deviations; it needs the extra `vision`. A fisheye lens is estimated
    by least squares (Levenberg and Marquardt) without OpenCV, in the model of `cv2.fisheye`.

    Parameters
    ----------
    target : Board, Tag or array_like of shape (N, 3)
        Target, or its marks in metres in any frame.
    pixels : array_like of shape (V, N, 2)
        Pixels of the marks, NaN for marks that are not seen.
    size : (int, int)
        Width and height of the image in pixels.
    lens : {"perspective", "fisheye"}, default "perspective"
        Model of the lens.
    coefficients : {5, 0, 4, 8}, optional
        Number of distortion coefficients: 0 (no distortion), 4 (k1 k2 p1 p2), 5 (with k3, the
        default) or 8 (with k4 k5 k6). A fisheye has 4 (k1 k2 k3 k4, the default) or 0.
    guess : Camera, optional
        First estimate of the camera, with the same model of the lens. A perspective lens needs it
        if the marks are not in a plane.

    Returns
    -------
    LensCalibration
        Camera, standard deviations, and poses of the target.

    Raises
    ------
    InputError
        If the model of the lens is unknown, there are fewer than three views, fewer than four marks
        are seen in a view, or the planes of all views are parallel within 5 degrees, so that the
        focal length is undetermined.

    Examples
    --------
    >>> board = [[x, y, 0] for x in (0, 0.1, 0.2) for y in (0, 0.1)]
    >>> calibrate_lens(board, np.zeros((2, 6, 2)), (640, 480))
    Traceback (most recent call last):
    robsim.base.errors.InputError: pixels: expected 3 views or more, (V, N, 2), got 2
    """
    marks = _target_marks(target)
    u = as_floats(pixels, "pixels", (len(marks), 2), gaps=True)
    shape, model = SIZE.check(size, "size"), check_lens(lens)
    count = _check_count(coefficients, model)
    seen = _find_visible_marks(u)
    _check_guess(guess, model)
    if model.name == "fisheye":
        return _run_fisheye(TargetViews(marks, u, seen), shape, count, guess)
    if _is_flat(marks):
        _check_tilts(marks, u, seen, shape)
    elif guess is None:
        raise InputError("target: its marks are not in a plane: give a first estimate, guess=")
    return _run_opencv(marks, u, seen, shape, count, guess)


def _check_count(coefficients: int | None, model: LensModel) -> int:
    """Return the number of coefficients; raise InputError for a number that the model lacks."""
    if coefficients is None:
        return 4 if model.name == "fisheye" else 5
    count = as_integer(coefficients, "coefficients", 0)
    if count not in model.counts:
        choices = join_alternatives(*map(str, model.counts))
        raise InputError(f"coefficients: expected {choices}, got {count}")
    return count


def _check_guess(guess: object, model: LensModel) -> None:
    """Raise InputError unless the first estimate is None or a camera with a model of the lens."""
    if guess is None:
        return
    if not isinstance(guess, Camera):
        raise InputError(f"guess: expected a Camera, got {format_value(guess)}")
    if guess.lens != model.name:
        raise InputError(f"guess: expected a camera with a {model.name} lens, got {guess.lens}")


def _run_opencv(
    marks: Array,
    u: Array,
    seen: NDArray[np.bool_],
    size: tuple[int, int],
    count: int,
    guess: Camera | None,
) -> LensCalibration:
    """Return the calibration of OpenCV for the visible marks of each view."""
    cv2 = import_opencv("a lens calibration needs")
    flags = _opencv_flags(cv2, count)
    objects = [marks[each].astype(np.float32) for each in seen]
    images = [u[i][each].astype(np.float32) for i, each in enumerate(seen)]
    K, lens = np.eye(3), np.zeros(8)
    if guess is not None:
        K, lens = np.array(guess.K), np.array(guess.coefficients)
        flags |= cv2.CALIB_USE_INTRINSIC_GUESS
    try:
        result = cv2.calibrateCameraExtended(objects, images, size, K, lens, flags=flags)
    except cv2.error as error:
        raise _refuse_views(error) from None
    rms, K, lens, turns, shifts, deviations, _, errors = result
    camera = Camera(K, size, distortion=tuple(np.ravel(lens)[:count].tolist()))
    poses = Pose.at(*np.reshape(shifts, (-1, 3)).T, rotvec=np.reshape(turns, (-1, 3)))
    std = np.ravel(deviations)[: 4 + count].tolist()
    named_deviations = dict(zip(lens_names(camera)[: 4 + count], std, strict=True))
    return LensCalibration(
        camera, float(rms), named_deviations, poses, make_read_only(np.ravel(errors))
    )


def _run_fisheye(
    views: TargetViews, size: tuple[int, int], count: int, guess: Camera | None
) -> LensCalibration:
    """Return the calibration of a fisheye for the visible marks of each view."""
    fit = fit_fisheye(views, size, count, guess)
    if _is_flat(views.marks):
        normal = np.linalg.svd(views.marks - views.marks.mean(axis=0))[2][2]
        _refuse_parallel_planes(fit.poses[:, :3, :3] @ normal)
    deviations, errors = estimate_deviations(views, fit, count)
    rms = float(np.sqrt(fit.squares / views.seen.sum()))
    named = dict(zip(lens_names(fit.camera)[: 4 + count], deviations.tolist(), strict=True))
    return LensCalibration(fit.camera, rms, named, Pose(fit.poses), make_read_only(errors))


def _refuse_views(error: Exception) -> InputError:
    """Return the error for views for which OpenCV does not converge."""
    text = " ".join(str(error).split())
    return InputError(f"pixels: OpenCV does not converge for these views: {format_value(text)}")


def _target_marks(target: Board | Tag | ArrayLike) -> Array:
    """Return the marks (N, 3) of a target."""
    if isinstance(target, Tag | Board):
        return target.marks
    marks = as_floats(target, "target (marks in metres)", ("N", 3))
    if marks.ndim != 2:
        raise InputError(f"target: expected marks (N, 3), got {marks.shape}")
    return marks


def _find_visible_marks(u: Array) -> NDArray[np.bool_]:
    """Return whether the marks (V, N) are seen; raise InputError for too few views or marks."""
    if u.ndim != 3 or len(u) < FEWEST_VIEWS:
        views = len(u) if u.ndim == 3 else 1
        raise InputError(f"pixels: expected {FEWEST_VIEWS} views or more, (V, N, 2), got {views}")
    seen = np.asarray(np.isfinite(u).all(axis=2))
    few = np.flatnonzero(seen.sum(axis=1) < FEWEST_MARKS)
    if few.size:
        raise InputError(
            f"pixels: {seen[few[0]].sum()} marks seen in view {few[0]}; a view needs "
            f"{FEWEST_MARKS} or more: leave it out"
        )
    return seen


def _opencv_flags(cv2: Any, coefficients: int) -> int:
    """Return the flags of OpenCV for a number of coefficients."""
    none = cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3
    known = {0: none, 4: cv2.CALIB_FIX_K3, 5: 0, 8: cv2.CALIB_RATIONAL_MODEL}
    return int(known[coefficients])


def _is_flat(marks: Array) -> bool:
    """Return whether marks are in a plane."""
    spread = np.linalg.svd(marks - marks.mean(axis=0), compute_uv=False)
    return bool(spread[2] <= FLAT * spread[0])


def _check_tilts(marks: Array, u: Array, seen: NDArray[np.bool_], size: tuple[int, int]) -> None:
    """Raise InputError if the planes of all views are parallel.

    A plane with the vanishing line l has its normal along K' l (Hartley and Zisserman 2004, section
    8.6). For this check the focal length in K is the larger side of the image.
    """
    axes = np.linalg.svd(marks - marks.mean(axis=0))[2][:2]
    flat = (marks - marks.mean(axis=0)) @ axes.T
    K = np.array([[max(size), 0, size[0] / 2], [0, max(size), size[1] / 2], [0, 0, 1.0]])
    H = np.array([estimate_homography(flat[each], u[i][each]) for i, each in enumerate(seen)])
    lost = np.flatnonzero(~np.isfinite(H).all((1, 2)))
    if lost.size:
        raise InputError(f"pixels: the marks of view {lost[0]} are on a line: leave it out")
    n = np.linalg.inv(H)[:, 2] @ K
    _refuse_parallel_planes(n / np.sqrt(np.square(n).sum(axis=1, keepdims=True)))


def _refuse_parallel_planes(n: Array) -> None:
    """Raise InputError if the unit normals n (V, 3) of the planes of all views are parallel."""
    cosine = np.abs(n @ n.T).min()
    if np.arccos(min(cosine, 1.0)) < PARALLEL:
        raise InputError(
            f"views: the planes of all {len(n)} are parallel within 5 degrees, so the "
            "focal length is undetermined: tilt the target by 20 degrees or more, to either side"
        )
