"""What a figure or a page lacks, told once."""

from __future__ import annotations

import warnings

from robsim.base.errors import FileWarning
from robsim.geometry.primitives import Mesh
from robsim.world.scene import Scene

SHOWN = 3  # meshes that a warning names, at most


def tell_lacks(scene: Scene) -> None:
    """Give one FileWarning for all meshes of a scene that are not drawn, with their number."""
    shapes = [shape for robot in scene.robots for link in robot.links for shape in link.shapes]
    shapes += [shape for thing in scene.objects for shape in thing.shapes]
    meshes = [shape for shape in shapes if isinstance(shape, Mesh)]
    lacks = [lack for mesh in meshes if (lack := mesh.lack)]
    if lacks:
        different = [*dict.fromkeys(lacks)]
        listed, rest = different[:SHOWN], ["..."] if len(different) > SHOWN else []
        text = "; ".join([*listed, *rest])
        message = f"{len(lacks)} of {len(meshes)} meshes are not drawn, or simpler shapes: {text}"
        warnings.warn(message, FileWarning, stacklevel=3)
