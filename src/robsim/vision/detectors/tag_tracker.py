"""The tracker of tags by the edges of their black squares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.declare import Flag, Integer, Number, register
from robsim.kernels.detection.square_edges import follow_squares
from robsim.vision.camera import Camera
from robsim.vision.detectors.board_tracking import check_board, follow_board
from robsim.vision.detectors.mark_detector import (
    MarkDetector,
    MarkSearch,
    MarkTarget,
    Picture,
    require_kind,
)
from robsim.vision.tags.board import Board
from robsim.vision.tags.detector import TagDetector
from robsim.vision.tags.tag import Tag
from robsim.vision.tags.tag_families import find_tag_family

DEVIATION = 0.007  # pixels: tags with sides of 28 to 110 pixels, noise of 2 grey values
INNER_CELLS = 12  # for each cell that may have the wrong colour


@register("mark detector", "tag_tracker")
@dataclass(frozen=True, eq=False)
class TagTracker(MarkDetector):
    """Tracker of a tag or a board, which fits the edges of black squares near their last places.

    It is a hundred times faster than `TagDetector`. It finds each side by the strongest edge from
    dark to light on a few lines across its last place, then fits the edges as `TagDetector` does,
    and checks that the cells of the border are black and surrounded by white. The cells within are
    compared with the cells of the tag, so that another tag, or the same tag turned by a quarter, is
    not found. A side may move by `reach` pixels from one picture to the next, and by 1.5 cells. A
    lost tag stays lost, unless it returns to its last place or `search_every` is given.

    The tags of a `Board` are followed one by one. An inner corner of the board is found if one of
    the two tags that touch it is found.

    The cells of tags come from OpenCV, of the extra `vision`; with `reads_cells=False` the
    tracker does not need it.

    Raises
    ------
    InputError
        By `check`, if the camera has no size, the object has no tag or board, a board has fewer
        than 3 x 3 squares or less than 0.6 white cells around its tags, or OpenCV is missing.

    Examples
    --------
    >>> tag = Tag("tag36h11", 7, size=0.1)
    >>> camera = Camera([[800, 0, 319.5], [0, 800, 239.5], [0, 0, 1]], size=(640, 480))
    >>> y, x = np.mgrid[:480, :640]
    >>> size = np.maximum(abs(x - 320.0), abs(y - 240.0))
    >>> picture = np.where((size < 40.5) & (size > 30), 30, 225).astype(np.uint8)
    >>> last = np.array([[[278, 202], [358, 202], [358, 282], [278, 282]]], dtype=float)
    >>> tracker = TagTracker(reads_cells=False)
    >>> tracker.find(picture[None], MarkSearch(tag, tag.marks, camera, last)).round(3)
    array([[[279.5, 199.5],
            [360.5, 199.5],
            [360.5, 280.5],
            [279.5, 280.5]]])
    """

    follows: ClassVar[bool] = True

    reach: Annotated[
        float,
        Number(above=0, most=200, unit="px"),
        "Largest motion of a side from one picture to the next.",
    ] = 12.0
    reads_cells: Annotated[
        bool, Flag(), "Whether the cells of a tag are compared, or only its border."
    ] = True
    most_wrong: Annotated[
        int | None,
        Integer(0, 100),
        "Largest number of cells with the wrong colour, if they are compared. None: a twelfth of "
        "the cells within the border, which is less than the distance of two tags of a family.",
    ] = None
    search_every: Annotated[
        int | None,
        Integer(1, 1_000_000),
        "Pictures from one search for a lost target in the whole picture by `TagDetector` to the "
        "next, which needs the extra `vision`. None: no search.",
    ] = None

    def check(self, target: MarkTarget | None, marks: Array, camera: Camera) -> None:
        super().check(target, marks, camera)
        require_kind(self, target, Tag, Board)
        if isinstance(target, Board):
            check_board(target)
        assert isinstance(target, Tag | Board)
        self._list_patterns(target)
        if self.search_every is not None:
            TagDetector().check(target, marks, camera)

    def find(self, pictures: Picture, search: MarkSearch) -> Array:
        assert isinstance(search.target, Tag | Board)
        grey = np.ascontiguousarray(pictures)
        patterns = self._list_patterns(search.target)
        how = patterns, self._choose_most_wrong(patterns.shape[1]), float(self.reach)
        if isinstance(search.target, Board):
            each = [follow_board(one, search.of_picture(k), *how) for k, one in enumerate(grey)]
            found = np.array(each).reshape(search.last.shape)
        else:
            last = np.ascontiguousarray(search.last, dtype=float)
            found = np.empty(last.shape)
            follow_squares(grey, last[:, None], *how, found[:, None])
        if self.search_every is not None and search.number % self.search_every == 0:
            lost = np.isnan(found).all(axis=(1, 2))
            found[lost] = TagDetector().find(pictures[lost], search)
        return found

    def _choose_most_wrong(self, cells: int) -> int:
        """Return the largest number of wrong cells, for tags with cells on a side; -1 for any."""
        allowed = (cells - 2) ** 2 // INNER_CELLS if self.most_wrong is None else self.most_wrong
        return allowed if self.reads_cells else -1

    def _list_patterns(self, target: Tag | Board) -> NDArray[np.bool_]:
        """Return whether the cells (T, n, n) of the tags are black; InputError without OpenCV."""
        count = len(target.ids) if isinstance(target, Board) else 1
        if not self.reads_cells:
            n = find_tag_family(target.family).cells
            return np.zeros((count, n, n), dtype=bool)
        cells = target.tag_cells if isinstance(target, Board) else target.cells
        return np.ascontiguousarray(cells).reshape(count, *cells.shape[-2:])

    @property
    def deviation(self) -> float:
        """Typical standard deviation of a corner of a tag, in pixels.

        It is the value for sharp pictures with noise of 2 grey values.
        """
        return DEVIATION
