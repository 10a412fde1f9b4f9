"""A picture on a plane face of a solid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.geometry.grey_picture import GreyPicture
from robsim.geometry.pose import Pose

SLACK = 1e-6  # of the size of a face


@dataclass(frozen=True, eq=False)
class FacePicture:
    """A picture that fills a rectangular face.

    Attributes
    ----------
    picture : GreyPicture
        The picture.
    middle : Pose
        Pose of the middle of the face, with x to the right, y down and z into the face.
    size : tuple of two float
        Width and height of the face in metres.

    Examples
    --------
    >>> picture = GreyPicture(np.zeros((30, 40), dtype=np.uint8))
    >>> face = FacePicture(picture, Pose.at(0.2, 0.15), (0.4, 0.3))
    >>> face.texel @ [0.4, 0.3, 0, 1]
    array([40., 30.])
    """

    picture: GreyPicture
    middle: Pose
    size: tuple[float, float]

    @property
    def texel(self) -> Array:
        """Column and row of the picture (2, 4) as affine functions of a point (x, y, z, 1).

        They are 0 at the left and upper edge of the picture.
        """
        rows, columns = self.picture.grey.shape
        scale = np.array([[columns / self.size[0]], [rows / self.size[1]]])
        texel: Array = scale * self.middle.inv().matrix[:2]
        texel[:, 3] += [columns / 2, rows / 2]
        return texel

    @property
    def corners(self) -> Array:
        """The corners (4, 3): upper left, upper right, lower right and lower left."""
        x, y = self.size[0] / 2, self.size[1] / 2
        corners: Array = self.middle @ np.array([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]])
        return corners

    def contains(self, points: Array) -> NDArray[np.bool_]:
        """Return whether points (..., 3) lie on the face, up to a millionth of its size.

        >>> picture = GreyPicture(np.zeros((30, 40), dtype=np.uint8))
        >>> face = FacePicture(picture, Pose.at(), (0.4, 0.3))
        >>> face.contains(np.array([[0.2, 0.1, 0.0], [0.3, 0.1, 0.0], [0.0, 0.0, 0.1]]))
        array([ True, False, False])
        """
        half, slack = np.array([*self.size, 0.0]) / 2, SLACK * max(self.size)
        return np.asarray((np.abs(self.middle.inv() @ points) <= half + slack).all(axis=-1))


def shrink_picture(grey: NDArray[np.uint8], most: int) -> NDArray[np.uint8]:
    """Return the means of blocks of a picture, with at most `most` rows and columns.

    >>> shrink_picture(np.array([[0, 10, 20, 30]], dtype=np.uint8), 2)
    array([[ 5, 25]], dtype=uint8)
    """
    values: Array = grey.astype(float)
    for axis, count in enumerate(grey.shape):
        edges = np.linspace(0, count, min(count, most) + 1).astype(int)
        sums = np.add.reduceat(values, edges[:-1], axis=axis)
        values = sums / np.expand_dims(np.diff(edges), 1 - axis)
    return np.rint(values).astype(np.uint8)
