"""Body of a camera: a box with a flared front."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from robsim.base.arrays import Array
from robsim.declare import register
from robsim.geometry.hull import Hull
from robsim.geometry.pose import Pose
from robsim.geometry.primitives.block import RING_CORNERS, TUBE_SIDES, Block
from robsim.geometry.primitives.primitive import Face, FigureColour, Primitive, SideLength


@register("shape", "camera")
@dataclass(frozen=True)
class CameraBody(Primitive):
    """Box with a front that flares into a larger opening, like the lens of a camera.

    The origin is the centre of the back face, the position of the image plane. The z axis, along
    the length, is the optical axis; x is along the height and y along the width. There are 12
    vertices, 20 edges and 9 faces; the front is open (chapter, section 2.3). The box takes three
    quarters of the length, and the opening is 1.5 times as wide and high as the box. For the
    inertia, box and flare are solid.

    Examples
    --------
    >>> body = CameraBody(0.08, 0.04, 0.03)
    >>> len(body.vertices), len(body.edges), len(body.faces)
    (12, 20, 9)
    """

    length: SideLength
    width: SideLength
    height: SideLength
    color: FigureColour = "k"

    @property
    def faces(self) -> tuple[Face, ...]:
        """Vertex indices of the back, the sides of the box and the sides of the flare."""
        flare = tuple(tuple(i + 4 for i in side) for side in TUBE_SIDES)
        return ((3, 2, 1, 0), *TUBE_SIDES, *flare)

    def _solid(self) -> tuple[float, Array, tuple[float, float, float]]:
        """Return volume, centre and mean squares, by integrals over slices across z.

        A slice is the cross-section of the box scaled by s(z), with s = 1 in the box. Along the
        flare, s = 1 + t / 2 for t in [0, 1], and the integrals of s^2, s^2 t, s^2 t^2 and s^4 over
        t are 19/12, 43/48, 19/30 and 211/80.
        """
        box, flare = 0.75 * self.length, 0.25 * self.length
        area = box + flare * 19 / 12  # integrals over z, divided by the cross-section of the box
        first = box * box / 2 + flare * (box * 19 / 12 + flare * 43 / 48)
        second = box * box * box / 3 + flare * (
            box * box * 19 / 12 + 2 * box * flare * 43 / 48 + flare * flare * 19 / 30
        )
        z, breadth = first / area, (box + flare * 211 / 80) / area
        x2, y2 = (side * side / 12 * breadth for side in (self.height, self.width))
        volume = area * self.height * self.width
        return volume, np.array([0.0, 0.0, z]), (x2, y2, second / area - z * z)

    def _corners(self) -> Array:
        rings = ((1.0, 0.0), (1.0, 0.75), (1.5, 1.0))  # (scale, fraction of the length)
        half = np.array([self.height / 2, self.width / 2])
        return np.array(
            [
                (*(scale * half * corner), z * self.length)
                for scale, z in rings
                for corner in RING_CORNERS
            ]
        )

    def simpler(self) -> tuple[Primitive, ...]:
        """Return two blocks: the box, and a block of the mean size of the flare."""
        blocks = []
        for start, end, scale in ((0.0, 0.75, 1.0), (0.75, 1.0, 1.25)):
            middle = Pose.at(0, 0, self.length * (start + end) / 2)
            sides = scale * self.height, scale * self.width, self.length * (end - start)
            blocks.append(Block(*sides, self.color).at(self.pose @ middle))
        return tuple(blocks)

    def _hull(self) -> Hull:
        """Return the frustum from the back to the opening, which encloses the box."""
        corners = self._corners()
        back, front = corners[:4], corners[8:]
        slants, sides = front - back, np.diff(back, axis=0, append=back[:1])
        z, xy = [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
        return Hull(
            np.concatenate([back, front]),
            np.concatenate([np.cross(sides, slants), z]),
            np.concatenate([slants, xy]),
        )
