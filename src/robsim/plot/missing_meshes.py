"""What a figure or a page lacks, told once."""

from __future__ import annotations

import warnings
from itertools import chain

from robsim.base.errors import FileWarning
from robsim.geometry.primitives import Mesh
from robsim.plot.wireframe import list_scene_shapes
from robsim.world.scene import Scene

SHOWN = 3  # meshes that a warning names, at most


def warn_missing_meshes(scene: Scene) -> None:
    """Give one FileWarning for all meshes of a scene that are not drawn, with their number."""
    every = chain.from_iterable(list_scene_shapes(scene).values())
    meshes = [shape for shape in every if isinstance(shape, Mesh)]
    lacks = [lack for mesh in meshes if (lack := mesh.lack)]
    if lacks:
        different = [*dict.fromkeys(lacks)]
        text = "; ".join([*different[:SHOWN], *["..."] * (len(different) > SHOWN)])
        message = f"{len(lacks)} of {len(meshes)} meshes are not drawn, or simpler shapes: {text}"
        warnings.warn(message, FileWarning, stacklevel=3)
