"""Tags in images by AprilTag and OpenCV, in our pixels and our order of corners."""

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
WINDOWS = 3, 53, 10  # pixels: of OpenCV's thresholds, for tags from small to large
APART = 1.2  # cells: squares nearer than that are one, and the outer is taken; the paper is another
SMOOTH, WINDOW = 1.0, 3  # pixels: of a chessboard's corners, where tags are not in the way
SUPPORT = 0.5  # pixel: where AprilTag counts the centre of the first pixel


def make_tag_finder(name: str) -> Finder:
    """Return what finds the tags of a family; InputError: its program is not installed."""
    return _make_apriltag_finder(name) if find_tag_family(name).april else _make_aruco_finder(name)


def _make_apriltag_finder(name: str) -> Finder:
    """Return AprilTag's detector."""
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
    """Return corners (4, 2) in our pixels and order, of AprilTag's.

    An edge between the pixels 39 and 40 is at 40 there and at 39.5 here (AprilRobotics/apriltag,
    issue 121); corners go counter-clockwise from the lower left.
    """
    return corners[::-1] - SUPPORT


def _make_aruco_finder(name: str) -> Finder:
    """Return OpenCV's detector, whose pixels and corners are counted as ours."""
    detector = import_opencv().aruco.ArucoDetector(opencv_dictionary(name), _aruco_parameters(name))

    def find(image: Image) -> Iterator[tuple[int, Array]]:
        corners, numbers, _ = detector.detectMarkers(image)
        for number, each in zip([] if numbers is None else numbers.ravel(), corners, strict=True):
            yield int(number), np.asarray(each, dtype=float).reshape(4, 2)

    return find


def _aruco_parameters(name: str) -> Any:
    parameters = import_opencv().aruco.DetectorParameters()
    least, most, step = WINDOWS
    parameters.adaptiveThreshWinSizeMin = least
    parameters.adaptiveThreshWinSizeMax = most
    parameters.adaptiveThreshWinSizeStep = step
    parameters.minMarkerDistanceRate = APART / (4 * find_tag_family(name).cells)  # of the perimeter
    return parameters


def make_board_finder(board: Board) -> Callable[[Image], tuple[Array, bool]]:
    """Return what finds the inner corners (N, 2) of a board, NaN where not seen; True: twice."""
    aruco = import_opencv().aruco
    given = aruco.CharucoParameters(), _aruco_parameters(board.family)
    detector = aruco.CharucoDetector(board.as_opencv(), *given)
    count = len(board.marks)

    def find(image: Image) -> tuple[Array, bool]:
        corners, numbers, _, tags = detector.detectBoard(image)
        found = np.full((count, 2), np.nan)
        if numbers is not None and len(numbers):
            found[numbers.ravel()] = _refine_saddles(image, corners)
        seen = [] if tags is None else tags.ravel().tolist()
        return found, len(set(seen)) < len(seen)

    return find


def _refine_saddles(image: Image, corners: Any) -> Array:
    """Return the inner corners (N, 2) of a chessboard, found anew in an image that is smoothed.

    Sharp edges draw OpenCV's corners to the pixels, by a twentieth of one.
    """
    cv2 = import_opencv()
    smooth = cv2.GaussianBlur(image, (0, 0), SMOOTH)
    start = np.array(corners, dtype=np.float32).reshape(-1, 1, 2)
    stop = cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3
    found = cv2.cornerSubPix(smooth, start, (WINDOW, WINDOW), (-1, -1), stop)
    return np.asarray(found, dtype=float).reshape(-1, 2)
