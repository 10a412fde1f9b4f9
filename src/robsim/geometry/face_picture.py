"""A picture on a plane face of a solid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array
from robsim.geometry.grey_picture import GreyPicture
from robsim.geometry.pose import Pose


@dataclass(frozen=True, eq=False)
class FacePicture:
    """A picture on a face, with the affine functions of its texels.

    Attributes
    ----------
    picture : GreyPicture
        The picture.
    texel : ndarray of shape (2, 4)
        Column and row of the picture as functions of a point (x, y, z, 1) of the face. They are 0
        at the left and upper edge of the picture.
    """

    picture: GreyPicture
    texel: Array

    @classmethod
    def on_rectangle(
        cls, picture: GreyPicture, middle: Pose, size: tuple[float, float]
    ) -> FacePicture:
        """Return a picture that fills a rectangle of a width and a height in metres.

        `middle` has the x axis to the right, y down and z into the face.

        >>> picture = GreyPicture(np.zeros((30, 40), dtype=np.uint8))
        >>> face = FacePicture.on_rectangle(picture, Pose.at(0.2, 0.15), (0.4, 0.3))
        >>> face.texel @ [0.4, 0.3, 0, 1]
        array([40., 30.])
        """
        rows, columns = picture.grey.shape
        scale = np.array([[columns / size[0]], [rows / size[1]]])
        texel: Array = scale * middle.inv().matrix[:2]
        texel[:, 3] += [columns / 2, rows / 2]
        return cls(picture, texel)
