"""The interface of detectors, which measure marks in pictures."""

from __future__ import annotations

from typing import ClassVar, NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import DeclaredValue, KindOf, family
from robsim.declare.spec import add_article
from robsim.geometry.face_picture import FacePicture
from robsim.vision.camera import Camera
from robsim.vision.tags.board import Board
from robsim.vision.tags.dot_pattern import DotPattern
from robsim.vision.tags.tag import Tag

MARK_DETECTORS = family("mark detector")
Picture = NDArray[np.uint8]
MarkTarget = Tag | Board | DotPattern | FacePicture
LEAST_SIDE = 16  # pixels of the smallest picture; AprilTag aborts the process for pictures below 3


class MarkSearch(NamedTuple):
    """The marks that a detector searches in pictures, as the controller believes them.

    Attributes
    ----------
    target : Tag, Board, DotPattern, FacePicture or None
        Believed printed target of the object, or the picture under its marks; None without one.
    marks : ndarray of shape (N, 3)
        Believed marks in axes of the object, in metres.
    camera : Camera
        Believed camera, which differs from the camera of the pictures if the task has a belief.
    last : ndarray of shape (B, N, 2)
        Pixels of each mark in the picture before, or where it was found last.
    number : int
        Number of the picture in its run, from 0.

    Examples
    --------
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
    >>> MarkSearch(None, np.zeros((1, 3)), camera, np.full((1, 1, 2), 300.0)).number
    0
    """

    target: MarkTarget | None
    marks: Array
    camera: Camera
    last: Array
    number: int = 0

    def of_picture(self, k: int) -> MarkSearch:
        """Return the search in one of several pictures, with its last places (1, N, 2).

        Examples
        --------
        >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
        >>> last = np.array([[[1.0, 2.0]], [[3.0, 4.0]]])
        >>> MarkSearch(None, np.zeros((1, 3)), camera, last).of_picture(1).last
        array([[[3., 4.]]])
        """
        return self._replace(last=self.last[k : k + 1])


class MarkDetector(DeclaredValue):
    """Base of detectors, which measure the marks of an object in pictures.

    A detector has no memory: a detector that follows marks takes their last places from
    `MarkSearch`. The result for a picture does not depend on the other pictures of a call.

    Attributes
    ----------
    follows : bool
        Whether the result depends on the last places of the marks.

    Examples
    --------
    A detector with errors of its own:

    >>> from dataclasses import dataclass
    >>> @dataclass(frozen=True)
    ... class Rounded(MarkDetector):
    ...     follows = True
    ...     def find(self, pictures, search):
    ...         return np.rint(search.last)
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
    >>> search = MarkSearch(None, np.zeros((1, 3)), camera, np.array([[[300.2, 199.6]]]))
    >>> Rounded().find(np.zeros((1, 480, 640), np.uint8), search)
    array([[[300., 200.]]])
    """

    follows: ClassVar[bool] = False

    def check(self, target: MarkTarget | None, marks: Array, camera: Camera) -> None:
        """Raise InputError unless the detector can detect these marks.

        Parameters
        ----------
        target : Tag, Board, DotPattern, FacePicture or None
            Printed target of the object, or the picture under its marks.
        marks : ndarray of shape (N, 3)
            Marks in axes of the object, in metres.
        camera : Camera
            Camera that takes the pictures.
        """
        name = type(self).__name__
        if camera.size is None:
            raise InputError(f"{name} needs the size of the camera")
        if min(camera.size) < LEAST_SIDE:
            raise InputError(f"{name} needs pictures of {LEAST_SIDE} pixels on a side or more")

    def find(self, pictures: Picture, search: MarkSearch) -> Array:
        """Return the marks (B, N, 2) in pictures, in pixels; NaN for marks that are not found.

        Parameters
        ----------
        pictures : ndarray of uint8, shape (B, h, w)
            Grey pictures; pixel centres are whole numbers.
        search : MarkSearch
            Marks to detect.
        """
        raise NotImplementedError

    @property
    def deviation(self) -> float:
        """Typical standard deviation of a detected mark, in pixels.

        It is the value for a sharp picture with noise of 2 grey values, for `advise`.
        """
        raise NotImplementedError


@runtime_checkable
class OwnMarkDetector(Protocol):
    """The protocol of a detector of your own, which derives from `MarkDetector`."""

    def check(self, target: MarkTarget | None, marks: Array, camera: Camera) -> None:
        """Raise InputError unless the detector can detect these marks."""

    def find(self, pictures: Picture, search: MarkSearch) -> Array:
        """Return the marks (B, N, 2) in pictures, in pixels; NaN for marks that are not found."""


DETECTOR = KindOf(MARK_DETECTORS, none="none", protocol=OwnMarkDetector)


def require_kind(detector: MarkDetector, target: object, *kinds: type) -> None:
    """Raise InputError unless the printed target of an object is of one of some kinds."""
    if not isinstance(target, kinds):
        words = " or ".join(kind.__name__ for kind in kinds)
        own = "no printed target" if target is None else add_article(type(target).__name__)
        raise InputError(f"{type(detector).__name__} needs a {words}, and the object has {own}")
