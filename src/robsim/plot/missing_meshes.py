"""Warning about meshes that a figure or a page cannot show."""

from __future__ import annotations

from itertools import chain

from robsim.geometry.primitives.unreadable_meshes import warn_unreadable_meshes
from robsim.plot.wireframe import list_scene_shapes
from robsim.world.scene import Scene


def warn_missing_meshes(scene: Scene) -> None:
    """Issue one FileWarning if meshes of a scene are not drawn; it reports their number."""
    warn_unreadable_meshes(chain.from_iterable(list_scene_shapes(scene).values()))
