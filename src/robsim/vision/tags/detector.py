"""The detector of tags and boards, which returns named marks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from threading import Lock
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, has_items
from robsim.base.errors import InputError, format_value
from robsim.declare import ListOf, OneOf, Table, register
from robsim.vision.camera import Camera
from robsim.vision.detectors.mark_detector import (
    LEAST_SIDE,
    MarkDetector,
    MarkSearch,
    MarkTarget,
    Picture,
    require_kind,
)
from robsim.vision.tags.board import Board
from robsim.vision.tags.detection_checks import cell_width, find_doubts
from robsim.vision.tags.detector_backends import make_board_finder, make_tag_finder
from robsim.vision.tags.edges import refine_corners
from robsim.vision.tags.tag import Tag

MOST_PIXELS = 200_000_000
FEW = 4  # corners that a pose needs
DEVIATION = 0.007  # pixels: tags with sides of 28 to 110 pixels, noise of 2 grey values
TARGETS = ListOf(OneOf(Table(Tag), Table(Board)), 1)


class Detections(dict[str, Array]):
    """The marks (N, 2) detected in an image, in pixels, by the names of their targets.

    The items are {name of a target: marks}. Targets that are not detected have no item, nor has a
    target that is seen more than once, because the right detection is unknown.

    Attributes
    ----------
    doubtful : dict of str to str
        Reasons why a detection may be false or inaccurate, by the name of the target.
    """

    def __init__(self, marks: dict[str, Array], doubtful: dict[str, str]):
        super().__init__(marks)
        self.doubtful = doubtful

    def pixels(self, targets: Iterable[Tag | Board]) -> Array:
        """Return the marks (N, 2) of several targets in order, NaN if they are not detected.

        Parameters
        ----------
        targets : iterable of Tag or Board
            Targets; N is the sum of their numbers of marks.

        Examples
        --------
        >>> Detections({}, {}).pixels([Tag("tag36h11", 0, size=0.1)])[0]
        array([nan, nan])
        """
        gaps = [(each.name, np.full((len(each.marks), 2), np.nan)) for each in targets]
        return np.concatenate([self.get(name, gap) for name, gap in gaps])


@register("mark detector", "tags")
@dataclass(frozen=True, eq=False)
class TagDetector(MarkDetector):
    """A detector of tags and boards in grey images, called as `detector(image)`.

    AprilTags are detected by pyapriltags, ArUco tags and ChArUco boards by OpenCV. The corners of
    tags are then refined from the edges of their black squares. The call returns `Detections`:
    marks by the name of their target. The detector needs the extra `vision`.

    As the detector of a servo task it searches each picture for the tag or the board of the object,
    without its last place.

    Parameters
    ----------
    targets : iterable of Tag or Board, optional
        Targets to detect. No tag may belong to two targets. None, in a servo task: the target of
        the object.

    Raises
    ------
    InputError
        If a target is not a Tag or Board, two targets have the same tag, or a library is missing.

    Examples
    --------
    >>> TagDetector([Tag("tag36h11", 0, size=0.1), Tag("tag36h11", 0, size=0.2)])
    Traceback (most recent call last):
    robsim.base.errors.InputError: targets: tag36h11_0 and tag36h11_0 both have tag 0 of tag36h11
    """

    targets: Annotated[
        tuple[Tag | Board, ...] | None,
        TARGETS,
        "Targets to detect. None, in a servo task: the target of the object.",
    ] = None

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(self, targets: Iterable[Tag | Board] | None = None) -> None: ...

    def __post_init__(self) -> None:
        if self.targets is not None:
            object.__setattr__(self, "targets", _check_targets(self.targets))
            _ = self._finder

    @cached_property
    def _finder(self) -> TargetFinder:
        """The libraries' detectors of the targets."""
        return TargetFinder(self.targets or ())

    def __call__(self, image: NDArray[np.generic]) -> Detections:
        """Return the marks in a grey image, in pixels (column, row).

        Parameters
        ----------
        image : ndarray of uint8, shape (h, w)
            Grey image; pixel centres are whole numbers.

        Returns
        -------
        Detections
            Marks (N, 2) by the name of their target, and reasons for doubt.

        Raises
        ------
        InputError
            If the image has another type or shape, or fewer than 16 pixels on a side.
        """
        if self.targets is None:
            raise InputError("a TagDetector without targets has no image of its own: name targets")
        return self._finder.detect(_check_grey_image(image))

    def check(self, target: MarkTarget | None, marks: Array, camera: Camera) -> None:
        super().check(target, marks, camera)
        require_kind(self, target, Tag, Board)
        assert isinstance(target, Tag | Board)
        if self.targets is not None and target not in self.targets:
            raise InputError(f"TagDetector: {target.name} is not one of its targets")
        _find_target_finder(target)

    def find(self, pictures: Picture, search: MarkSearch) -> Array:
        assert isinstance(search.target, Tag | Board)
        finder = _find_target_finder(search.target)
        found = np.full((len(pictures), len(search.marks), 2), np.nan)
        for each, picture in zip(found, pictures, strict=True):
            seen = finder.detect(np.ascontiguousarray(picture))
            each[:] = seen.get(search.target.name, np.nan)
        return found

    @property
    def deviation(self) -> float:
        """Typical standard deviation of a corner of a tag, in pixels.

        It is the value for sharp pictures with noise of 2 grey values.
        """
        return DEVIATION


class TargetFinder:
    """The detectors of libraries for several targets.

    Parameters
    ----------
    targets : sequence of Tag or Board
        Targets to detect.
    """

    def __init__(self, targets: Sequence[Tag | Board]):
        self._tags = {(t.family, t.id): t for t in targets if isinstance(t, Tag)}
        self._boards = {t: make_board_finder(t) for t in targets if isinstance(t, Board)}
        self._finders = {
            name: make_tag_finder(name) for name in sorted({name for name, _ in self._tags})
        }
        self._lock = Lock()  # the libraries keep buffers between images

    def detect(self, grey: NDArray[np.uint8]) -> Detections:
        """Return the marks in a contiguous grey image."""
        with self._lock:
            tags = self._detect_tags(grey).items()
            boards = [(board, find(grey)) for board, find in self._boards.items()]
        results = [(tag.name, *_select_tag_corners(grey, tag, seen)) for tag, seen in tags]
        results += [(board.name, *_check_board_corners(*seen)) for board, seen in boards]
        marks = {name: points for name, points, _ in results if points is not None}
        return Detections(marks, {name: "; ".join(why) for name, _, why in results if why})

    def _detect_tags(self, grey: NDArray[np.uint8]) -> dict[Tag, list[Array]]:
        """Return the corners of each target, one array for each detection."""
        corners_of: dict[Tag, list[Array]] = {}
        for name, find in self._finders.items():
            for number, corners in find(grey):
                if tag := self._tags.get((name, number)):
                    corners_of.setdefault(tag, []).append(corners)
        return corners_of


@lru_cache(16)
def _find_target_finder(target: Tag | Board) -> TargetFinder:
    """Return the detector of one target; InputError if its library is not installed."""
    return TargetFinder((target,))


def _select_tag_corners(
    grey: NDArray[np.uint8], tag: Tag, detections: list[Array]
) -> tuple[Array | None, list[str]]:
    """Return the corners of a tag, or None, and reasons for doubt.

    If a tag is detected several times, the corners of the only detection without doubts are
    returned, because tags of weak families are also detected in noise.
    """
    every = [_refine_tag_corners(grey, tag, corners) for corners in detections]
    certain = [each for each in every if not each[1]]
    if len(every) == 1 or len(certain) == 1:
        return (certain or every)[0]
    return None, [f"seen {len(certain or every)} times"]


def _refine_tag_corners(
    grey: NDArray[np.uint8], tag: Tag, detected: Array
) -> tuple[Array, list[str]]:
    """Return the corners of a tag refined from its edges, and reasons for doubt."""
    better = refine_corners(grey, detected, cell_width(detected, tag))
    corners = detected if better is None else better
    blurred = ["no sharp edges"] if better is None else []
    return corners, [*blurred, *find_doubts(grey, tag, corners)]


def _check_board_corners(corners: Array, repeated: bool) -> tuple[Array | None, list[str]]:
    """Return the inner corners of a board, or None, and reasons for doubt."""
    seen = int(np.isfinite(corners[:, 0]).sum())
    if repeated:
        return None, ["one of its tags is seen more than once"]
    if not seen:
        return None, []
    return corners, [f"{seen} of {len(corners)} corners"] if seen < FEW else []


def _check_targets(targets: Iterable[Tag | Board]) -> tuple[Tag | Board, ...]:
    """Return the targets as a tuple; raise InputError if two targets share a tag."""
    if not has_items(targets):
        raise InputError(f"targets: expected a list of Tag and Board, got {format_value(targets)}")
    every = tuple(targets)
    owners: dict[tuple[str, int], str] = {}
    for target in every:
        if not isinstance(target, Tag | Board):
            raise InputError(f"targets: expected a Tag or a Board, got {format_value(target)}")
        for number in target.ids if isinstance(target, Board) else (target.id,):
            key = target.family, number
            if key in owners:
                raise InputError(
                    f"targets: {owners[key]} and {target.name} both have tag {number} of {key[0]}"
                )
            owners[key] = target.name
    if not every:
        raise InputError("targets: expected at least one Tag or Board")
    return every


def _check_grey_image(image: object) -> NDArray[np.uint8]:
    """Return a grey image as a contiguous array; raise InputError for any other image."""
    if not isinstance(image, np.ndarray):
        raise InputError(f"image: expected an array (h, w) of uint8, got {format_value(image)}")
    if image.ndim == 3 and image.shape[-1] in (3, 4):
        raise InputError(
            f"image: shape {image.shape} has colours; make it grey, as by "
            "cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)"
        )
    if image.ndim != 2 or min(image.shape) < LEAST_SIDE or image.size > MOST_PIXELS:
        raise InputError(
            f"image: expected shape (h, w) of {LEAST_SIDE} pixels or more, got {image.shape}"
        )
    if image.dtype != np.uint8:
        raise InputError(f"image: expected grey values of uint8, 0 to 255, got {image.dtype}")
    return np.ascontiguousarray(image)
