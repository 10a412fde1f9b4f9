"""The detector of dots by their grey centroids."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Flag, Number, register
from robsim.kernels.detection.dot_centroids import find_dots
from robsim.vision.camera import Camera
from robsim.vision.detectors.dot_centers import move_to_centers
from robsim.vision.detectors.mark_detector import (
    MarkDetector,
    MarkSearch,
    MarkTarget,
    Picture,
    require_kind,
)
from robsim.vision.tags.dot_pattern import DotPattern

DEVIATION = 0.01  # pixels: dots with a radius of 8 pixels, noise of 2 grey values


@register("mark detector", "dots")
@dataclass(frozen=True, eq=False)
class DotDetector(MarkDetector):
    """Detector of dark or bright dots by their grey centroids, without further packages.

    The dot nearest to the last place of a mark is measured. A threshold in the middle of the grey
    values near this place separates the dot from its background. The centroid weighs each pixel of
    the dot and of its rim by the difference w to the grey value of the background,

        (x, y) = sum w (x, y) / sum w.

    A dot is not found if it is cut by the border of the picture, if it is too small, if it touches
    another dot, or if it is no full ellipse because something hides a part of it.

    Raises
    ------
    InputError
        By `check`, if the camera has no size, a `DotPattern` has dots of the other brightness, or
        `unbiased` is set and the object has no pattern of four dots that are not on one line.

    Notes
    -----
    The centroid of a dot in the picture is not the image of its centre, because perspective
    enlarges the nearer half. For a dot of radius r at the distance Z, tilted by the angle a, the
    difference is about f (r/Z)^2 sin(a) cos(a) pixels: 0.04 px for f = 800 px, r = 5 mm, Z = 0.5 m
    and 45 degrees. With `unbiased` it is subtracted: the places of all dots of the pattern yield
    the homography of its plane, which yields the difference of each dot (Heikkila 2000), also
    through the lens that the controller believes. Pictures with fewer than four dots remain
    biased.

    Examples
    --------
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
    >>> y, x = np.mgrid[:480, :640]
    >>> picture = np.where(np.hypot(x - 300.0, y - 200.0) < 10.2, 30, 225).astype(np.uint8)
    >>> search = MarkSearch(None, np.zeros((1, 3)), camera, np.array([[[305.0, 196.0]]]))
    >>> DotDetector().find(picture[None], search)
    array([[[300., 200.]]])
    """

    follows: ClassVar[bool] = True

    reach: Annotated[
        float,
        Number(above=0, most=1000, unit="px"),
        "Largest distance of a dot from its last place, along each axis of the image.",
    ] = 20.0
    bright: Annotated[bool, Flag(), "Whether dots are brighter than their background."] = False
    least_area: Annotated[
        float, Number(least=1, unit="px^2"), "Smallest area of a dot in the picture."
    ] = 12.0
    least_contrast: Annotated[
        float,
        Number(least=1, most=255),
        "Smallest difference of grey values between a dot and its background.",
    ] = 20.0

    unbiased: Annotated[
        bool, Flag(), "Whether the shift of a centroid from the centre of its dot is subtracted."
    ] = False

    def check(self, target: MarkTarget | None, marks: Array, camera: Camera) -> None:
        super().check(target, marks, camera)
        if isinstance(target, DotPattern) and target.bright != self.bright:
            kind = "bright" if target.bright else "dark"
            raise InputError(
                f"DotDetector with bright={self.bright}, and the object has {kind} dots"
            )
        if self.unbiased:
            require_kind(self, target, DotPattern)
            assert isinstance(target, DotPattern)
            if np.linalg.matrix_rank(target.points - target.points.mean(axis=0)) < 2:
                raise InputError(
                    "DotDetector with unbiased=True needs dots that are not on one line"
                )

    def find(self, pictures: Picture, search: MarkSearch) -> Array:
        height, width = pictures.shape[1:]
        found = np.empty(search.last.shape)
        find_dots(
            np.ascontiguousarray(pictures),
            np.ascontiguousarray(search.last, dtype=float),
            self.reach,
            self.bright,
            self.least_area,
            self.least_contrast,
            np.zeros((height, width), dtype=np.int32),
            np.empty(height * width, dtype=np.int32),
            found,
        )
        if self.unbiased:
            found = np.array(
                [self._move(each, search.of_picture(k)) for k, each in enumerate(found)]
            )
        return found.reshape(search.last.shape)

    @staticmethod
    def _move(centroids: Array, search: MarkSearch) -> Array:
        """Return the images (N, 2) of the centres of dots from their centroids (N, 2)."""
        assert isinstance(search.target, DotPattern)
        return move_to_centers(search.target, search.camera, centroids)

    @property
    def deviation(self) -> float:
        """Typical standard deviation of a centroid, in pixels.

        It is the value for dots with a radius of 8 pixels and noise of 2 grey values.
        """
        return DEVIATION
