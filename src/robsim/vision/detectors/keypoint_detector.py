"""The detector of marks on a picture by matched keypoints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Integer, Number, register
from robsim.declare.spec import add_article
from robsim.geometry.face_picture import FacePicture
from robsim.geometry.pose import IDENTITY
from robsim.vision.camera import Camera
from robsim.vision.detectors.keypoint_homography import (
    PlaneFit,
    find_keypoints,
    find_reference,
    fit_plane,
    match_keypoints,
)
from robsim.vision.detectors.mark_detector import MarkDetector, MarkSearch, MarkTarget, Picture
from robsim.vision.plane import append_one, map_points
from robsim.vision.tags.tag_families import import_opencv

DEVIATION = 0.04  # pixels: posters with 100 to 300 matches, with noise of 2 grey values or without


@register("mark detector", "keypoints")
@dataclass(frozen=True, eq=False)
class KeypointDetector(MarkDetector):
    """Detector of marks on a poster by the keypoints of its picture, with the extra `vision`.

    The marks are any points of a `Poster`, or of a face of a `Block` with a picture. Keypoints of
    SIFT (Lowe 2004) in the camera picture are matched with keypoints of the poster's picture.
    Without its lens, the camera sees the plane of the poster by a homography H,

        (x, y, 1) ~ H (X, Y, 1),

    which is fitted to the matches by random samples with a fixed seed, and then by least squares to
    the matches that agree. H and the lens map the marks into the picture. The detector needs no
    last places: a poster that was hidden is found again.

    A mark is not found if it is outside the picture, or if too few matches are near it, for
    instance because something hides this part of the poster. No mark is found if too few matches
    agree, as on another picture.

    Raises
    ------
    InputError
        By `check`, if the camera has no size, the object has no picture or marks that are not on
        it, or OpenCV is not installed.

    Notes
    -----
    The marks of a picture have a common error, because all of them follow from one homography. The
    lens is the lens that the controller believes.

    Examples
    --------
    >>> import robsim as rs
    >>> poster = rs.shapes.Poster(np.zeros((30, 40), dtype=np.uint8), width=0.4)
    >>> wall = rs.Object("wall", poster, marks=[[-0.1, 0, 0], [0.1, 0, 0], [0.5, 0, 0]])
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
    >>> KeypointDetector().check(wall.mark_target, wall.marks, camera)
    Traceback (most recent call last):
    robsim.base.errors.InputError: KeypointDetector: mark 2 is not on the picture of 0.4 x 0.3 m
    """

    ratio: Annotated[
        float,
        Number(above=0, most=1),
        "Largest distance of a match, relative to the second nearest keypoint (Lowe's ratio test).",
    ] = 0.75
    keypoints: Annotated[
        int, Integer(4, 100_000), "Largest number of keypoints in each of both pictures."
    ] = 500
    tolerance: Annotated[
        float,
        Number(above=0, most=100, unit="px"),
        "Largest distance of a match from the homography.",
    ] = 1.5
    least_matches: Annotated[
        int, Integer(4, 100_000), "Fewest matches that agree with the homography."
    ] = 12
    neighbourhood: Annotated[
        float,
        Number(above=0, most=1),
        "Largest distance of matches that support a mark, relative to the diagonal of the poster.",
    ] = 0.2
    least_nearby: Annotated[
        int, Integer(0, 100_000), "Fewest matches in the neighbourhood of a mark."
    ] = 3

    def check(self, target: MarkTarget | None, marks: Array, camera: Camera) -> None:
        super().check(target, marks, camera)
        if not isinstance(target, FacePicture):
            own = "no picture" if target is None else add_article(type(target).__name__)
            raise InputError(
                "KeypointDetector needs a picture, such as a Poster in the shapes of the object, "
                f"and the object has {own}"
            )
        on = target.contains(np.moveaxis(marks, 1, -1))  # in a batch marks may be (N, 3, runs)
        off = np.flatnonzero(~on.reshape(len(marks), -1).all(axis=1))
        if off.size:
            width, height = target.size
            raise InputError(
                f"KeypointDetector: mark {off[0]} is not on the picture of "
                f"{width:.3g} x {height:.3g} m"
            )
        import_opencv("keypoints need")

    def find(self, pictures: Picture, search: MarkSearch) -> Array:
        each = [self._find_in(grey, search.of_picture(k)) for k, grey in enumerate(pictures)]
        return np.array(each).reshape(search.last.shape)

    def _find_in(self, grey: Picture, search: MarkSearch) -> Array:
        """Return the marks (N, 2) in one picture (h, w)."""
        face, camera = search.target, search.camera
        assert isinstance(face, FacePicture)
        marks = (face.middle.inv() @ search.marks)[:, :2]
        fit = self._fit_face(grey, face, camera)
        if fit is None or len(fit.inliers) < self.least_matches:
            return np.full(marks.shape, np.nan)
        rays = map_points(fit.H, marks) / _find_focal(camera)
        found = np.full(marks.shape, np.nan)
        ahead = np.isfinite(rays[:, 0])
        found[ahead] = camera.project(append_one(rays[ahead]), IDENTITY)
        limit = np.array(grey.shape[::-1]) - 0.5
        seen = ((found >= -0.5) & (found < limit)).all(axis=1)
        seen &= self._count_nearby(marks, fit, face) >= self.least_nearby
        found[~seen] = np.nan
        return found

    def _fit_face(self, grey: Picture, face: FacePicture, camera: Camera) -> PlaneFit | None:
        """Return the homography from metres on a face to pixels of a camera without its lens."""
        height, width = grey.shape
        reference = find_reference(face.picture, (width, height), self.keypoints)
        seen = find_keypoints(np.ascontiguousarray(grey), self.keypoints)
        in_grey, in_reference = match_keypoints(seen, reference, self.ratio)
        if not len(in_grey):
            return None
        rays = camera.normalise(seen.places[in_grey])
        valid = np.isfinite(rays[:, 0])  # a pixel beyond the image of a lens has no ray
        points = reference.places[in_reference][valid] * face.size
        return fit_plane(points, _find_focal(camera) * rays[valid], self.tolerance)

    def _count_nearby(self, marks: Array, fit: PlaneFit, face: FacePicture) -> Array:
        """Return the number of matches (N,) near each mark."""
        apart = np.linalg.norm(marks[:, None] - fit.inliers, axis=-1)
        return np.asarray((apart < self.neighbourhood * np.hypot(*face.size)).sum(axis=1))

    @property
    def deviation(self) -> float:
        """Typical standard deviation of a mark, in pixels.

        It is the value for a poster with 100 to 300 matches.
        """
        return DEVIATION


def _find_focal(camera: Camera) -> float:
    """Return the mean focal length of a camera, in pixels."""
    return float(np.mean(camera.focal))
