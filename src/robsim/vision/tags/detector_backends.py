"""Detectors of AprilTag and OpenCV, with the same pixels and the same order of corners."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.vision.tags.board import Board
from robsim.vision.tags.tag_families import find_tag_family, import_opencv, opencv_dictionary

Image = NDArray[np.uint8]
Finder = Callable[[Image], Iterator[tuple[int, Array]]]  # yields numbers and corners (4, 2)
# pixels: smallest and largest size, and step, of OpenCV's threshold windows
WINDOWS = 3, 53, 10
# cells: if two squares are closer, OpenCV keeps the outer square; the edge of the paper is farther
# away
APART = 1.2
# pixels: standard deviation of the blur, and half size of the window for the corners of a
# chessboard; the window does not reach the tags
SMOOTH, WINDOW = 1.0, 3
FIRST_CENTER = 0.5  # pixels: position of the centre of the first pixel in AprilTag


def make_tag_finder(name: str) -> Finder:
    """Return the detector of a tag family; raise InputError if its library is not installed."""
    return _make_apriltag_finder(name) if find_tag_family(name).april else _make_aruco_finder(name)


def _make_apriltag_finder(name: str) -> Finder:
    """Return AprilTag's detector of a family."""
    try:
        from pyapriltags import Detector
    except ImportError:
        raise InputError("AprilTags need pyapriltags: pip install 'robsim[vision]'") from None
    detector = Detector(families=name, quad_decimate=1.0)

    def find(image: Image) -> Iterator[tuple[int, Array]]:
        for tag in detector.detect(image):
            yield tag.tag_id, convert_apriltag_corners(tag.corners)

    return find


def convert_apriltag_corners(corners: Array) -> Array:
    """Return AprilTag's corners (4, 2) in the pixels and order of this package.

    An edge between the pixels 39 and 40 is at 40 in AprilTag and at 39.5 here
    (AprilRobotics/apriltag, issue 121). AprilTag's corners go counter-clockwise from the lower
    left.
    """
    return corners[::-1] - FIRST_CENTER


def _make_aruco_finder(name: str) -> Finder:
    """Return OpenCV's detector of a family, which has the pixels and corners of this package."""
    detector = import_opencv().aruco.ArucoDetector(opencv_dictionary(name), _aruco_parameters(name))

    def find(image: Image) -> Iterator[tuple[int, Array]]:
        corners, numbers, _ = detector.detectMarkers(image)
        for number, each in zip([] if numbers is None else numbers.ravel(), corners, strict=True):
            yield int(number), np.asarray(each, dtype=float).reshape(4, 2)

    return find


def _aruco_parameters(name: str) -> Any:
    """Return OpenCV's detector parameters for tags from small to large."""
    parameters = import_opencv().aruco.DetectorParameters()
    least, most, step = WINDOWS
    parameters.adaptiveThreshWinSizeMin = least
    parameters.adaptiveThreshWinSizeMax = most
    parameters.adaptiveThreshWinSizeStep = step
    parameters.minMarkerDistanceRate = APART / (4 * find_tag_family(name).cells)  # of the perimeter
    return parameters


def make_board_finder(board: Board) -> Callable[[Image], tuple[Array, bool]]:
    """Return a function from an image to the inner corners (N, 2) of a board.

    Corners that are not seen are NaN. The second result of the function is true if a tag of the
    board is seen twice.
    """
    aruco = import_opencv().aruco
    parameters = aruco.CharucoParameters(), _aruco_parameters(board.family)
    detector = aruco.CharucoDetector(board.as_opencv(), *parameters)
    count = len(board.marks)

    def find(image: Image) -> tuple[Array, bool]:
        corners, numbers, _, tags = detector.detectBoard(image)
        points = np.full((count, 2), np.nan)
        if numbers is not None and len(numbers):
            points[numbers.ravel()] = _refine_saddles(image, corners)
        seen = [] if tags is None else tags.ravel().tolist()
        return points, len(set(seen)) < len(seen)

    return find


def _refine_saddles(image: Image, corners: Any) -> Array:
    """Return the inner corners (N, 2) of a chessboard, refined in a smoothed image.

    Without smoothing, OpenCV's corners are biased towards pixel centres by a twentieth of a pixel.
    """
    cv2 = import_opencv()
    smooth = cv2.GaussianBlur(image, (0, 0), SMOOTH)
    start = np.array(corners, dtype=np.float32).reshape(-1, 1, 2)
    stop = cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3
    refined = cv2.cornerSubPix(smooth, start, (WINDOW, WINDOW), (-1, -1), stop)
    return np.asarray(refined, dtype=float).reshape(-1, 2)
