"""The bricks that robots are built of: block, wheel, ball, camera body, drawn as wire frames.

Sizes are in metres (in `robsim.classic`, as in the chapter, in centimetres).
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from itertools import product
from pathlib import PurePosixPath
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, frozen, numbers, positive
from robsim.base.errors import InputError
from robsim.geometry.inertia import Inertia
from robsim.geometry.pose import IDENTITY, Pose, one_pose

Face = tuple[int, ...]
MOST_POINTS = 4096  # of a circle


@dataclass(frozen=True)
class Primitive:
    """A wire-frame solid that stands at `pose`; what a subclass adds is its shape.

    It weighs nothing unless its `mass` (kg) is given, or its `density` (kg/m^3): it is solid then,
    and the same all through.
    """

    pose: Pose = field(default=IDENTITY, kw_only=True)
    mass: float | None = field(default=None, kw_only=True)
    density: float | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", one_pose(self.pose, f"{type(self).__name__} pose"))
        for size in fields(self):
            if size.type == "float":
                value = positive(getattr(self, size.name), f"{type(self).__name__} {size.name}")
                object.__setattr__(self, size.name, value)
        for part in ("mass", "density"):
            if getattr(self, part) is not None:
                value = positive(getattr(self, part), f"{type(self).__name__} {part}")
                object.__setattr__(self, part, value)
        if self.mass is not None and self.density is not None:
            raise InputError(f"{type(self).__name__}: give its mass or its density, not both")

    def at(self, pose: Any) -> Self:
        """A copy moved by `pose`, rigidly: each vertex p becomes pose @ p.

        >>> float(Block(2, 2, 2).at(Pose.at(1, 0, 0)).vertices[:, 0].max())
        2.0
        """
        moved = one_pose(pose, "pose to move a primitive by")
        return replace(self, pose=moved @ self.pose)

    @property
    def inertia(self) -> Inertia | None:
        """Of the solid, in the axes that its pose stands in; None where it weighs nothing.

        >>> Block(2, 1, 1, mass=12).inertia.tensor.diagonal()
        array([2., 5., 5.])
        """
        if self.mass is None and self.density is None:
            return None
        volume, centre, per_mass = self._solid()
        mass = self.mass or volume * (self.density or 0.0)
        with np.errstate(over="ignore", invalid="ignore"):  # what overflows is refused
            tensor = np.diag(mass * np.asarray(per_mass))
        return Inertia(mass, centre, tensor).at(self.pose)

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

    def _solid(self) -> tuple[float, ArrayLike, ArrayLike]:
        """Volume, centre of mass, and principal moments per mass along its own axes."""
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

    def _solid(self) -> tuple[float, ArrayLike, ArrayLike]:
        a, b, c = self.length, self.width, self.height
        return a * b * c, np.zeros(3), _moments(a * a / 12, b * b / 12, c * c / 12)

    def _corners(self) -> Array:
        half = np.array([self.length, self.width, self.height]) / 2
        return half * [(x, y, z) for z, (x, y) in product((-1, 1), _RING)]


@dataclass(frozen=True)
class Wheel(Primitive):
    """Two circles of `n` points, `width` apart; z is the axis of rotation, x points to angle 0.

    The origin lies midway between the centres. 2n vertices, 2n edges (the two circles), n + 2
    faces for solid drawing (chapter, section 2.2). Its inertia is that of the round cylinder, not
    of the prism that is drawn.

    >>> len(Wheel(0.1, 0.02, n=16).edges)
    32
    """

    radius: float
    width: float
    n: int = 32
    color: str = "k"

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_points(self.n, "Wheel")

    @property
    def faces(self) -> tuple[Face, ...]:
        """The tread, then the two discs."""
        n = self.n
        tread = tuple((i, (i + 1) % n, (i + 1) % n + n, i + n) for i in range(n))
        return (*tread, tuple(range(n - 1, -1, -1)), tuple(range(n, 2 * n)))

    def _solid(self) -> tuple[float, ArrayLike, ArrayLike]:
        r, h = self.radius, self.width
        return np.pi * r * r * h, np.zeros(3), _moments(r * r / 4, r * r / 4, h * h / 12)

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
    1.5 times the box. Its inertia is that of box and flare as if both were solid.

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

    def _solid(self) -> tuple[float, ArrayLike, ArrayLike]:
        """Slices across z, of s times the box, s(z) = 1 in the box and up to 1.5 in the flare.

        With t in [0, 1] along the flare and s = 1 + t / 2, the integrals of s^2, s^2 t, s^2 t^2
        and s^4 are 19/12, 43/48, 19/30 and 211/80.
        """
        box, flare = 0.75 * self.length, 0.25 * self.length
        area = box + flare * 19 / 12  # all integrals over z, per area of the box
        first = box * box / 2 + flare * (box * 19 / 12 + flare * 43 / 48)
        second = box * box * box / 3 + flare * (
            box * box * 19 / 12 + 2 * box * flare * 43 / 48 + flare * flare * 19 / 30
        )
        z, breadth = first / area, (box + flare * 211 / 80) / area
        x2, y2 = (side * side / 12 * breadth for side in (self.height, self.width))
        volume = area * self.height * self.width
        return volume, np.array([0.0, 0.0, z]), _moments(x2, y2, second / area - z * z)

    def _corners(self) -> Array:
        rings = ((1.0, 0.0), (1.0, 0.75), (1.5, 1.0))  # (scale, share of the length)
        half = np.array([self.height / 2, self.width / 2])
        return np.array(
            [(*(scale * half * corner), z * self.length) for scale, z in rings for corner in _RING]
        )


@dataclass(frozen=True)
class Ball(Primitive):
    """A sphere around its origin, drawn as three circles of `n` points, about x, y and z.

    3n vertices, 3n edges; its faces are the three discs. Its inertia is that of the round ball.

    >>> len(Ball(0.1, n=16).edges)
    48
    """

    radius: float
    n: int = 32
    color: str = "k"

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_points(self.n, "Ball")

    @property
    def faces(self) -> tuple[Face, ...]:
        """The three discs."""
        n = self.n
        return tuple(tuple(range(start, start + n)) for start in (0, n, 2 * n))

    def _solid(self) -> tuple[float, ArrayLike, ArrayLike]:
        r = self.radius
        return 4 / 3 * np.pi * r * r * r, np.zeros(3), np.full(3, 2 / 5 * r * r)

    def _corners(self) -> Array:
        angle = 2 * np.pi * np.arange(self.n) / self.n
        circle = self.radius * np.stack([np.cos(angle), np.sin(angle), np.zeros(self.n)], axis=1)
        return np.concatenate([np.roll(circle, shift, axis=1) for shift in (1, 2, 0)])


@dataclass(frozen=True)
class Mesh(Primitive):
    """A mesh by the name of its file alone: it is never opened here, and so is not drawn.

    `filename` is "package://name/..." or a name relative to the folder of the model's file; it
    may climb one folder, to that of the package, and no further. `scale` is along x, y and z.
    What a mesh weighs is not known: the link says that.

    >>> Mesh("package://arm/meshes/elbow.stl").vertices.shape
    (0, 3)
    """

    filename: str
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    color: str = "k"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.mass is not None or self.density is not None:
            raise InputError("a mesh is not opened, so its inertia is not known: give the link's")
        _check_mesh_name(self.filename)
        scale = numbers(self.scale, "Mesh scale", (3,))
        if scale.shape != (3,) or not scale.all():
            raise InputError(f"Mesh scale must be three numbers other than 0, got {self.scale}")
        object.__setattr__(self, "scale", tuple(scale.tolist()))

    @property
    def edges(self) -> Array:
        """None, (0, 2)."""
        return np.empty((0, 2), dtype=np.int64)

    @property
    def faces(self) -> tuple[Face, ...]:
        """None."""
        return ()

    def _corners(self) -> Array:
        return np.empty((0, 3))


def _moments(x2: float, y2: float, z2: float) -> Array:
    """Principal moments per mass from the mean squares of the distances along the axes."""
    return np.array([y2 + z2, x2 + z2, x2 + y2])


def _check_points(n: object, kind: str) -> None:
    """InputError unless circles can have n points."""
    if not isinstance(n, int | np.integer) or not 3 <= n <= MOST_POINTS:
        raise InputError(
            f"{kind} n must be a whole number of at least 3, got {n!r}; and at most {MOST_POINTS}"
        )


def _check_mesh_name(name: object) -> None:
    """InputError unless the name stays within its package, or the package of the model's file."""
    good = 'expected "package://name/..." or a name relative to the folder of the file'
    if not isinstance(name, str) or not 0 < len(name) <= 1000 or not name.isprintable():
        raise InputError(f"mesh {name!r:.80}: {good}")
    package = name.startswith("package://")
    path = PurePosixPath(name.removeprefix("package://").lstrip("/") if package else name)
    parts = path.parts
    if path.is_absolute() or "\\" in name or ":" in str(path) or len(parts) < 1 + package:
        raise InputError(f"mesh {name!r:.80}: absolute, or not a file name; {good}")
    depth = -1 if package else 1  # the first part names the package
    for part in parts:
        depth += -1 if part == ".." else 1
        if depth < 0:
            raise InputError(f"mesh {name!r:.80}: leaves its package by '..'; {good}")
