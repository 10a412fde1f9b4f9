"""Keypoints of a picture in another one, and the homography that explains their matches."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, make_read_only
from robsim.geometry.grey_picture import GreyPicture
from robsim.vision.plane import estimate_homography, map_points
from robsim.vision.tags.tag_families import import_opencv

LEAST_CONTRAST = 0.02  # half of OpenCV's: smooth pictures have keypoints too
FEWEST = 4  # points of a homography
SEED, TRIALS = 31, 2000  # of the random samples
ROUNDS = 5  # of the fit to the inliers
OUTLYING = 3.0  # robust standard deviations: matches that are farther from the fit do not count
NORMAL = 1.4826  # standard deviations in the median of absolute values, for normal errors
LEAST_SPREAD = 0.1  # pixels: the smallest standard deviation for this test


class Keypoints(NamedTuple):
    """Keypoints of a picture.

    Attributes
    ----------
    places : ndarray of shape (K, 2)
        Column and row in pixels; pixel centres are whole numbers.
    descriptors : ndarray of float32, shape (K, 128)
        Gradients around each keypoint (Lowe 2004, section 6).
    """

    places: Array
    descriptors: NDArray[np.float32]


class PlaneFit(NamedTuple):
    """A homography, and the points (K, 2) of its first plane that agree with it."""

    H: Array
    inliers: Array


def find_keypoints(grey: NDArray[np.uint8], most: int) -> Keypoints:
    """Return the keypoints of SIFT with the strongest contrast.

    OpenCV shifts the places by a quarter of a pixel without `enable_precise_upscale`. The detector
    is made anew for each picture, so that threads share nothing.
    """
    options = {"contrastThreshold": LEAST_CONTRAST, "enable_precise_upscale": True}
    sift = import_opencv("keypoints need").SIFT_create(nfeatures=most, **options)
    found, descriptors = sift.detectAndCompute(grey, None)
    if not found:
        return Keypoints(np.zeros((0, 2)), np.zeros((0, 128), dtype=np.float32))
    return Keypoints(np.array([each.pt for each in found], dtype=float), descriptors)


@lru_cache(16)
def find_reference(picture: GreyPicture, size: tuple[int, int], most: int) -> Keypoints:
    """Return the keypoints of the picture of a face, with places from -0.5 to 0.5 of its sides.

    A picture with more pixels than the camera is first reduced to `size` (width, height), because
    the camera does not see its finest details.
    """
    grey = picture.grey
    share = min(1.0, size[0] / grey.shape[1], size[1] / grey.shape[0])
    if share < 1.0:
        columns, rows = (max(round(share * n), 1) for n in grey.shape[::-1])
        opencv = import_opencv("keypoints need")
        grey = opencv.resize(grey, (columns, rows), interpolation=opencv.INTER_AREA)
    found = find_keypoints(grey, most)
    shares = (found.places + 0.5) / grey.shape[::-1] - 0.5
    return Keypoints(make_read_only(shares), make_read_only(found.descriptors))


def match_keypoints(
    seen: Keypoints, reference: Keypoints, ratio: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the numbers of the keypoints that match, in both pictures.

    A match is kept if the second nearest descriptor of the reference is farther by 1 / ratio (Lowe
    2004, section 7.1).
    """
    none = np.zeros(0, dtype=np.int64)
    if not len(seen.places) or len(reference.places) < 2:
        return none, none
    opencv = import_opencv("keypoints need")
    nearest = opencv.BFMatcher(opencv.NORM_L2).knnMatch(
        seen.descriptors, reference.descriptors, k=2
    )
    pairs = [(a.queryIdx, a.trainIdx) for a, b in nearest if a.distance < ratio * b.distance]
    matched = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return matched[:, 0], matched[:, 1]


def fit_plane(points: Array, places: Array, tolerance: float) -> PlaneFit | None:
    """Return the homography from points (K, 2) to places (K, 2) and its inliers; None without one.

    Random samples with a fixed seed (OpenCV's USAC) yield the matches that agree to a tolerance in
    the unit of the places. The homography is then fitted to the matches within three robust
    standard deviations.
    """
    if len(points) < FEWEST:
        return None
    opencv = import_opencv("keypoints need")
    parameters = opencv.UsacParams()
    parameters.threshold, parameters.maxIterations = tolerance, TRIALS
    parameters.randomGeneratorState, parameters.isParallel = SEED, False
    H, agrees = opencv.findHomography(points, places, parameters)
    if H is None:
        return None
    near = agrees.ravel() > 0
    for _ in range(ROUNDS):
        if near.sum() < FEWEST:
            return None
        H = estimate_homography(points[near], places[near])
        apart = np.linalg.norm(map_points(H, points) - places, axis=1)
        if not np.isfinite(apart).all():
            return None
        spread = max(NORMAL * float(np.median(apart[near])), LEAST_SPREAD)
        near = apart < min(OUTLYING * spread, tolerance)
    return PlaneFit(H, points[near]) if np.linalg.det(H) > 0 else None
