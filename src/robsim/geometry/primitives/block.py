"""Box."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING, Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import Role, register
from robsim.geometry.face_picture import FacePicture
from robsim.geometry.grey_picture import GreyPicture, PictureLike
from robsim.geometry.hull import Hull
from robsim.geometry.picture_spec import FacePictures, FacePicturesSpec
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.primitives.primitive import Face, FigureColour, Primitive, SideLength

# a rectangular tube between two rings of four corners, 0-3 and 4-7
RING_CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))
OUTWARD = {  # the directions of the faces, in their order
    "-z": (0, 0, -1),
    "+z": (0, 0, 1),
    "-y": (0, -1, 0),
    "+x": (1, 0, 0),
    "+y": (0, 1, 0),
    "-x": (-1, 0, 0),
}
UPWARD = {"x": (0, 0, 1), "y": (0, 0, 1), "z": (0, 1, 0)}  # the upper ends of pictures on faces
BlockPictures = GreyPicture | FacePictures
TUBE_SIDES: tuple[Face, ...] = tuple((i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4) for i in range(4))


@register("shape", "block")
@dataclass(frozen=True)
class Block(Primitive):
    """Box, centred at the origin: x along its length, y along its width, z along its height.

    The block has 8 vertices, 12 edges and 6 faces (chapter, section 2.1). `picture` is a grey
    picture on every face, or a dict of pictures by the names of faces: "-z" (bottom), "+z" (top),
    "-y", "+x", "+y" and "-x". A picture fills its face. As seen from outside, it is upright along
    z, and along y on the bottom and the top. Its grey values replace the albedo there.

    Raises
    ------
    FileError or InputError
        If a picture cannot be read, as by `Poster`, or a face does not exist.

    Examples
    --------
    >>> block = Block(0.3, 0.2, 0.1, color="r")
    >>> block.vertices.max(axis=0), len(block.edges), len(block.faces)
    (array([0.15, 0.1 , 0.05]), 12, 6)
    """

    length: SideLength
    width: SideLength
    height: SideLength
    color: FigureColour = "k"
    picture: Annotated[
        BlockPictures | None,
        FacePicturesSpec(tuple(OUTWARD)),
        Role.FIGURE,
        "Picture on every face, or pictures by the names of faces.",
    ] = field(default=None, kw_only=True)

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            length: float,
            width: float,
            height: float,
            color: str = "k",
            *,
            picture: PictureLike | Mapping[str, PictureLike] | FacePictures | None = None,
            pose: Pose = IDENTITY,
            mass: float | None = None,
            density: float | None = None,
            albedo: float = 0.6,
        ) -> None: ...

    @property
    def face_pictures(self) -> Mapping[int, FacePicture]:
        """The pictures on faces, by the index of the face."""
        given = self.picture
        if given is None:
            return {}
        names = tuple(OUTWARD)
        named = dict.fromkeys(names, given) if isinstance(given, GreyPicture) else dict(given)
        return {names.index(name): self._place_picture(name, named[name]) for name in named}

    def _place_picture(self, name: str, picture: GreyPicture) -> FacePicture:
        """Return a picture on the face of a name."""
        outward, up = np.array(OUTWARD[name]), np.array(UPWARD[name[1]])
        sides, T = np.array([self.length, self.width, self.height]), np.eye(4)
        T[:3] = np.column_stack([np.cross(up, outward), -up, -outward, outward * sides / 2])
        right, down = abs(T[:3, :2].T) @ sides
        return FacePicture.on_rectangle(picture, self.pose @ Pose(T), (right, down))

    @property
    def faces(self) -> tuple[Face, ...]:
        """Vertex indices of the bottom, the top and the four sides."""
        return ((3, 2, 1, 0), (4, 5, 6, 7), *TUBE_SIDES)

    def _solid(self) -> tuple[float, Array, tuple[float, float, float]]:
        a, b, c = self.length, self.width, self.height
        return a * b * c, np.zeros(3), (a * a / 12, b * b / 12, c * c / 12)

    def _corners(self) -> Array:
        half = np.array([self.length, self.width, self.height]) / 2
        return half * [(x, y, z) for z, (x, y) in product((-1, 1), RING_CORNERS)]

    def _hull(self) -> Hull:
        return Hull(self._corners(), np.eye(3), np.eye(3))
