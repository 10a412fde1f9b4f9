"""Poster: a rectangle with a picture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.declare import Role, register
from robsim.geometry.face_picture import FacePicture
from robsim.geometry.grey_picture import GreyPicture, PictureLike
from robsim.geometry.hull import Hull
from robsim.geometry.picture_spec import PICTURE
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.primitives.primitive import Face, FigureColour, Primitive, SideLength


@register("shape", "poster")
@dataclass(frozen=True)
class Poster(Primitive):
    """Rectangle with a picture, with x to the right, y down and z into the paper.

    The origin is the middle of the poster. An upright poster that faces a camera therefore has the
    orientation of the camera, as a `Tag` has. `picture` is the path of a file (PNG, JPEG, BMP,
    TIFF, PPM or WebP), a `GreyPicture`, or an array of uint8 of shape (h, w); the height follows
    from its proportions. The back has the grey value of `albedo`. Figures show the poster in the
    mean grey of the picture, or in a `color` other than white. A run stores the grey values, so
    that it can be repeated without the file.

    Raises
    ------
    FileError
        If the file cannot be read, is no picture, has an alpha channel, more than 8 bits, or more
        than 50 million pixels.
    InputError
        If the array is not a picture, the width is not positive, or a density is given.

    Examples
    --------
    >>> poster = Poster(np.zeros((30, 40), dtype=np.uint8), width=0.4)
    >>> poster.height, poster.vertices[0]
    (0.3, array([-0.2 , -0.15,  0.  ]))
    """

    picture: Annotated[GreyPicture, PICTURE, Role.FIGURE, "Picture on the front."]
    width: SideLength
    color: FigureColour = "w"

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            picture: PictureLike,
            width: float,
            color: str = "w",
            *,
            pose: Pose = IDENTITY,
            mass: float | None = None,
            density: float | None = None,
            albedo: float = 0.6,
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.density is not None:
            raise InputError("a poster has no volume: give its mass, not a density")

    @property
    def height(self) -> float:
        """The height in metres, from the proportions of the picture."""
        rows, columns = self.picture.grey.shape
        return float(self.width * rows / columns)

    @property
    def figure_color(self) -> str:
        """Colour in figures: the mean grey of the picture, unless `color` is not white."""
        return self.picture.mean_color if self.color == "w" else self.color

    @property
    def face_pictures(self) -> Mapping[int, FacePicture]:
        """The picture, on the first face."""
        size = self.width, self.height
        return {0: FacePicture(self.picture, self.pose, size)}

    @property
    def faces(self) -> tuple[Face, ...]:
        """Vertex indices of the front, which is seen from -z, and of the back."""
        return (0, 3, 2, 1), (0, 1, 2, 3)

    def _solid(self) -> tuple[float, Array, tuple[float, float, float]]:
        return 0.0, np.zeros(3), (self.width**2 / 12, self.height**2 / 12, 0.0)

    def _corners(self) -> Array:
        x, y = self.width / 2, self.height / 2
        return np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])

    def _hull(self) -> Hull:
        axes = np.eye(3)
        return Hull(self._corners(), axes[2:], axes[:2])
