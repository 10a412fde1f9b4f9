"""The bricks that robots are built of: block, wheel and camera body, drawn as wire frames.

Sizes are in metres (in `robsim.classic`, as in the chapter, in centimetres).
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import product
from typing import Any, Self

import numpy as np

from robsim.arrays import Array, frozen, positive
from robsim.errors import InputError
from robsim.pose import IDENTITY, Pose, one_pose

Face = tuple[int, ...]
MOST_POINTS = 4096  # of a circle


@dataclass(frozen=True)
class Primitive:
    """A wire-frame solid that stands at `pose`; what a subclass adds is its shape."""

    pose: Pose = field(default=IDENTITY, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", one_pose(self.pose, f"{type(self).__name__} pose"))
        for size in fields(self):
            if size.type == "float":
                value = positive(getattr(self, size.name), f"{type(self).__name__} {size.name}")
                object.__setattr__(self, size.name, value)

    def at(self, pose: Any) -> Self:
        """A copy moved by `pose`, rigidly: each vertex p becomes pose @ p.

        >>> float(Block(2, 2, 2).at(Pose.at(1, 0, 0)).vertices[:, 0].max())
        2.0
        """
        moved = one_pose(pose, "pose to move a primitive by")
        return replace(self, pose=moved @ self.pose)

    @cached_property
    def vertices(self) -> Array:
        """(V, 3) corner points."""
        return frozen(self.pose @ self._corners())

    @property
    def edges(self) -> Array:
        """(E, 2) pairs of vertex numbers."""
        return np.array(sorted({tuple(sorted(e)) for e in self._edges()}))

    @property
    def color(self) -> str:
        """Of the lines: a letter as in the chapter, or any colour that Matplotlib knows."""
        raise NotImplementedError

    @property
    def faces(self) -> tuple[Face, ...]:
        """Vertex numbers around each face."""
        raise NotImplementedError

    def _corners(self) -> Array:
        raise NotImplementedError

    def _edges(self) -> list[tuple[int, int]]:
        """By default every side of every face."""
        return [(a, b) for f in self.faces for a, b in zip(f, f[1:] + f[:1], strict=True)]


# a rectangular tube of two rings of four corners, 0-3 and 4-7
_RING = ((-1, -1), (1, -1), (1, 1), (-1, 1))
_SIDES: tuple[Face, ...] = tuple((i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4) for i in range(4))


@dataclass(frozen=True)
class Block(Primitive):
    """A box: x along its length, y along its width, z along its height, origin at its centre.

    8 vertices, 12 edges, 6 faces (chapter, section 2.1).

    >>> block = Block(0.3, 0.2, 0.1, color="r")
    >>> block.vertices.max(axis=0), len(block.edges), len(block.faces)
    (array([0.15, 0.1 , 0.05]), 12, 6)
    """

    length: float
    width: float
    height: float
    color: str = "k"

    @property
    def faces(self) -> tuple[Face, ...]:
        """Bottom, top, four sides."""
        return ((3, 2, 1, 0), (4, 5, 6, 7), *_SIDES)

    def _corners(self) -> Array:
        half = np.array([self.length, self.width, self.height]) / 2
        return half * [(x, y, z) for z, (x, y) in product((-1, 1), _RING)]


@dataclass(frozen=True)
class Wheel(Primitive):
    """Two circles of `n` points, `width` apart; z is the axis of rotation, x points to angle 0.

    The origin lies midway between the centres. 2n vertices, 2n edges (the two circles), n + 2
    faces for solid drawing (chapter, section 2.2).

    >>> len(Wheel(0.1, 0.02, n=16).edges)
    32
    """

    radius: float
    width: float
    n: int = 32
    color: str = "k"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.n, int | np.integer) or not 3 <= self.n <= MOST_POINTS:
            raise InputError(
                f"Wheel n must be a whole number of at least 3, got {self.n!r}; "
                f"and at most {MOST_POINTS}"
            )

    @property
    def faces(self) -> tuple[Face, ...]:
        """The tread, then the two discs."""
        n = self.n
        tread = tuple((i, (i + 1) % n, (i + 1) % n + n, i + n) for i in range(n))
        return (*tread, tuple(range(n - 1, -1, -1)), tuple(range(n, 2 * n)))

    def _corners(self) -> Array:
        angle = 2 * np.pi * np.arange(self.n) / self.n
        circle = self.radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        z = np.repeat([-self.width / 2, self.width / 2], self.n)
        return np.column_stack([np.tile(circle, (2, 1)), z])

    def _edges(self) -> list[tuple[int, int]]:
        n = self.n
        return [(i + ring, (i + 1) % n + ring) for ring in (0, n) for i in range(n)]


@dataclass(frozen=True)
class CameraBody(Primitive):
    """A box whose front flares into a larger opening, the eye of the camera.

    The frame sits at the centre of the back face, where the image is formed: z along the length
    is the optical axis, x along the height, y along the width. 12 vertices, 20 edges, 9 faces:
    the front is open (chapter, section 2.3). The box is three quarters of the length, the opening
    1.5 times the box.

    >>> body = CameraBody(0.08, 0.04, 0.03)
    >>> len(body.vertices), len(body.edges), len(body.faces)
    (12, 20, 9)
    """

    length: float
    width: float
    height: float
    color: str = "k"

    @property
    def faces(self) -> tuple[Face, ...]:
        """The back, the sides of the box, the sides of the flare."""
        flare = tuple(tuple(i + 4 for i in side) for side in _SIDES)
        return ((3, 2, 1, 0), *_SIDES, *flare)

    def _corners(self) -> Array:
        rings = ((1.0, 0.0), (1.0, 0.75), (1.5, 1.0))  # (scale, share of the length)
        half = np.array([self.height / 2, self.width / 2])
        return np.array(
            [(*(scale * half * corner), z * self.length) for scale, z in rings for corner in _RING]
        )
