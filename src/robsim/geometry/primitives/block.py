"""Box."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import product
from typing import TYPE_CHECKING, Annotated

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import Role, Table, register
from robsim.geometry.face_picture import FacePicture
from robsim.geometry.grey_picture import GreyPicture, PictureLike
from robsim.geometry.hull import Hull
from robsim.geometry.picture_spec import PICTURE
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.primitives.block_pictures import BlockPictures
from robsim.geometry.primitives.primitive import Face, FigureColour, Primitive, SideLength

# a rectangular tube between two rings of four corners, 0-3 and 4-7
RING_CORNERS = ((-1, -1), (1, -1), (1, 1), (-1, 1))
OUTWARD = {  # the directions of the faces, in their order
    "bottom": (0, 0, -1),
    "top": (0, 0, 1),
    "right": (0, -1, 0),
    "front": (1, 0, 0),
    "left": (0, 1, 0),
    "back": (-1, 0, 0),
}
TUBE_SIDES: tuple[Face, ...] = tuple((i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4) for i in range(4))


@register("shape", "block")
@dataclass(frozen=True)
class Block(Primitive):
    """Box, centred at the origin: x along its length, y along its width, z along its height.

    The block has 8 vertices, 12 edges and 6 faces (chapter, section 2.1). A `picture` is on every
    face, `pictures` are on single faces (`BlockPictures`). A picture fills its face and replaces
    the albedo there. As seen from outside, it is upright along z, and on the top and the bottom
    along y.

    Raises
    ------
    FileError or InputError
        If a picture cannot be read, as by `Poster`.

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
    picture: Annotated[GreyPicture | None, PICTURE, Role.FIGURE, "Picture on every face."] = field(
        default=None, kw_only=True
    )
    pictures: Annotated[
        BlockPictures | None,
        Table(BlockPictures),
        Role.FIGURE,
        "Pictures on single faces, which replace `picture` there.",
    ] = field(default=None, kw_only=True)

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            length: float,
            width: float,
            height: float,
            color: str = "k",
            *,
            pose: Pose = IDENTITY,
            mass: float | None = None,
            density: float | None = None,
            albedo: float = 0.6,
            picture: PictureLike | None = None,
            pictures: BlockPictures | None = None,
        ) -> None: ...

    @property
    def face_pictures(self) -> Mapping[int, FacePicture]:
        """The pictures on faces, by the index of the face."""
        own = {} if self.pictures is None else vars(self.pictures)
        found = {name: own.get(name) or self.picture for name in OUTWARD}
        return {
            k: self._place_picture(name, picture)
            for k, (name, picture) in enumerate(found.items())
            if picture is not None
        }

    def _place_picture(self, name: str, picture: GreyPicture) -> FacePicture:
        """Return a picture on the face of a name."""
        outward, sides = np.array(OUTWARD[name]), np.array([self.length, self.width, self.height])
        up, T = np.array((0, 1, 0) if outward[2] else (0, 0, 1)), np.eye(4)
        T[:3] = np.column_stack([np.cross(up, outward), -up, -outward, outward * sides / 2])
        right, down = abs(T[:3, :2].T) @ sides
        return FacePicture(picture, self.pose @ Pose(T), (right, down))

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
