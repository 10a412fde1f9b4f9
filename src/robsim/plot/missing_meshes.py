"""Warning about meshes that a figure or a page cannot show."""

from __future__ import annotations

import warnings
from itertools import chain

from robsim.base.errors import FileWarning
from robsim.geometry.primitives import Mesh
from robsim.plot.wireframe import list_scene_shapes
from robsim.world.scene import Scene

MOST_NAMED = 3  # largest number of reasons in a warning


def warn_missing_meshes(scene: Scene) -> None:
    """Issue one FileWarning if meshes of a scene are not drawn; it reports their number."""
    every = chain.from_iterable(list_scene_shapes(scene).values())
    meshes = [shape for shape in every if isinstance(shape, Mesh)]
    reasons = [reason for mesh in meshes if (reason := mesh.lack)]
    if reasons:
        different = [*dict.fromkeys(reasons)]
        text = "; ".join([*different[:MOST_NAMED], *["..."] * (len(different) > MOST_NAMED)])
        message = f"{len(reasons)} of {len(meshes)} meshes are not drawn, or simpler shapes: {text}"
        warnings.warn(message, FileWarning, stacklevel=3)
