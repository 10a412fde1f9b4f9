"""A mesh by its file name, which is never opened."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import PurePosixPath
from typing import Annotated, Any

import numpy as np

from robsim.base.arrays import Array, numbers
from robsim.base.errors import InputError, said
from robsim.declare import ListOf, Number, Text, register
from robsim.declare.spec import Spec
from robsim.geometry.primitives.primitive import Colour, Face, Primitive

SCALE = Number()


@dataclass(frozen=True)
class MeshName(Text):
    """The declaration of a mesh's file name, which must stay within its package."""

    def check(self, value: Any, what: str) -> str:
        _check_mesh_name(value)
        return str(value)


@dataclass(frozen=True)
class Scale(ListOf):
    """The declaration of three scale factors other than 0."""

    item: Spec = SCALE
    least: int = 3
    most: int = 3

    def check(self, value: Any, what: str) -> tuple[float, ...]:
        scale = numbers(value, what, (3,))
        if scale.shape != (3,) or not scale.all():
            raise InputError(f"{what} must be three numbers other than 0, got {value}")
        return tuple(scale.tolist())


@register("shape", "mesh")
@dataclass(frozen=True)
class Mesh(Primitive):
    """A mesh by its file name only: the file is never opened, and the mesh is not drawn.

    `filename` is "package://name/..." or a name relative to the folder of the model's file; it
    may climb one folder, to that of the package, and no further. `scale` is along x, y and z.
    The mass of a mesh is not known: the link gives it.

    >>> Mesh("package://arm/meshes/elbow.stl").vertices.shape
    (0, 3)
    """

    filename: Annotated[str, MeshName(most=1000), "Name of the file of the mesh."]
    scale: Annotated[tuple[float, float, float], Scale(), "Scale along x, y and z."] = (
        1.0,
        1.0,
        1.0,
    )
    color: Colour = "k"
    mass: None = field(default=None, kw_only=True)
    density: None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.mass is not None or self.density is not None:
            raise InputError("a mesh is not opened, so its inertia is not known: give the link's")

    @property
    def edges(self) -> Array:
        """The edges (0, 2): a mesh has none here."""
        return np.empty((0, 2), dtype=np.int64)

    @property
    def faces(self) -> tuple[Face, ...]:
        """The faces: a mesh has none here."""
        return ()

    def _corners(self) -> Array:
        return np.empty((0, 3))


def _check_mesh_name(name: object) -> None:
    """Raise InputError unless the name stays within its package, or that of the model."""
    good = 'expected "package://name/..." or a name relative to the folder of the file'
    if not isinstance(name, str) or not 0 < len(name) <= 1000 or not name.isprintable():
        raise InputError(f"mesh {said(name)}: {good}")
    package = name.startswith("package://")
    path = PurePosixPath(name.removeprefix("package://").lstrip("/") if package else name)
    parts = path.parts
    if path.is_absolute() or "\\" in name or ":" in str(path) or len(parts) < 1 + package:
        raise InputError(f"mesh {said(name)}: absolute, or not a file name; {good}")
    depth = -1 if package else 1  # the first part names the package
    for part in parts:
        depth += -1 if part == ".." else 1
        if depth < 0:
            raise InputError(f"mesh {said(name)}: leaves its package by '..'; {good}")
