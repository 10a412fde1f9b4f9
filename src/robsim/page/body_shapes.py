"""Triangles and edges of bodies, built once for each body."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.geometry.face_picture import FacePicture, shrink_picture
from robsim.geometry.grey_picture import GreyPicture
from robsim.geometry.primitives import Primitive
from robsim.plot import palette, wireframe
from robsim.plot.goal_outlines import build_frame_outline
from robsim.plot.wireframe import ScenePart, WireSolid
from robsim.world.mounted_camera import MountedCamera
from robsim.world.scene import Scene

MOST_TEXELS = 96  # rows and columns of a picture on a page
T = TypeVar("T")
BodyKey = tuple[str, int]  # kind of the result, and identity of the body


class BodyShapes:
    """Arrays with the shapes of bodies, by a name that depends on their content alone.

    A shape is built once for each frozen body, and found again by the identity of this body.
    `former` are the shapes of the scene before a change: equal bodies keep their shapes, and shapes
    without a body are deleted by `forget_former`.

    Attributes
    ----------
    arrays : dict
        Corners of triangles, ends of edges, or points (n, 3) in metres, by name, and grey values
        (rows, columns) of pictures.
    """

    def __init__(self, former: BodyShapes | None = None) -> None:
        self.arrays: dict[str, NDArray[Any]] = {}
        self._built: dict[BodyKey, tuple[object, Any]] = {}  # the body stays alive; Any: by kind
        self._former = former._built if former else {}
        self._used: set[BodyKey] = set()

    def forget_former(self) -> None:
        """Delete the shapes that were not used since the change."""
        self._former = {}

    def list_scene_parts(self, scene: Scene, depth: float) -> list[ScenePart]:
        """Return the parts of a scene; the depth of a frustum is in metres."""

        def list_parts(_: Scene) -> list[ScenePart]:
            builders = self.list_drawable, self.build_solid, self.build_camera_solid
            return wireframe.list_scene_parts(scene, depth, *builders)

        return self._find_in_scene(f"parts {depth}", scene, list_parts)

    def list_frame_outline(self, scene: Scene, name: str, depth: float) -> list[WireSolid]:
        """Return the outline of the body of a frame; the depth of a frustum is in metres."""

        def list_outline(_: Scene) -> list[WireSolid]:
            builders = self.list_drawable, self.build_solid, self.build_camera_solid
            return build_frame_outline(scene, name, depth, *builders)

        return self._find_in_scene(f"outline {depth} {name}", scene, list_outline)

    def list_drawable(self, shapes: Iterable[Primitive]) -> list[Primitive]:
        """Return the shapes to draw, with the content of mesh files."""
        return [
            each
            for shape in shapes
            for each in self._find("drawable", shape, _list_drawable_shapes_of_one)
        ]

    def build_solid(self, label: str, shape: Primitive, color: str | None = None) -> WireSolid:
        """Return a primitive as a solid, in its own colour or in another one."""
        wire: WireSolid = self._find("solid", shape, _build_unlabelled_solid)
        return replace(wire, label=label, color=palette.convert_color(color or shape.figure_color))

    def build_camera_solid(self, eye: MountedCamera, depth: float) -> WireSolid:
        """Return the body of a camera, or a frustum; the depth of a frustum is in metres."""
        wire: WireSolid = self._find(
            f"camera {depth}", eye, lambda _: wireframe.build_camera_solid(eye, depth)
        )
        return wire

    def store_solid(self, wire: WireSolid) -> dict[str, str]:
        """Return the names of the corners of the triangles of a solid, and of its edges.

        The faces must be convex.
        """
        triangles, edges = self._find("arrays", wire.segments, lambda _: _list_triangles(wire))
        return {"triangles": self._store(triangles), "edges": self._store(edges)}

    def store_picture(self, face: FacePicture) -> dict[str, Any]:
        """Return the name of the grey values of a picture, and the corners of its face."""
        greys = self._find("picture", face.picture, lambda _: _name_greys(face.picture))
        return {"greys": self._store(greys), "corners": face.corners.ravel().tolist()}

    def store_points(self, points: ArrayLike) -> str:
        """Return the name of an array of points (n, 3)."""
        return self._store(_name_points(points))

    def _store(self, named: tuple[str, NDArray[Any]]) -> str:
        name, self.arrays[name] = named
        return name

    def _find_in_scene(self, kind: str, scene: Scene, build: Callable[[Scene], T]) -> T:
        """Return the result of `build` for a scene; the shapes that it uses are kept with it."""

        def build_with_keys(_: Scene) -> tuple[T, frozenset[BodyKey]]:
            self._used = set()
            return build(scene), frozenset(self._used)

        result: T
        result, keys = self._find(kind, scene, build_with_keys)
        self._built |= {key: self._former[key] for key in keys if key not in self._built}
        return result

    def _find(self, kind: str, body: object, build: Callable[[Any], Any]) -> Any:  # Any: by kind
        """Return the result of `build` for a body, which is built once."""
        key = kind, id(body)
        self._used.add(key)
        if key not in self._built:
            self._built[key] = self._former.get(key) or (body, build(body))
        return self._built[key][1]


def _list_drawable_shapes_of_one(shape: Primitive) -> list[Primitive]:
    """Return the shapes that are drawn in place of a shape."""
    return wireframe.list_drawable_shapes([shape])


def _build_unlabelled_solid(shape: Primitive) -> WireSolid:
    """Return a primitive as a solid without a label."""
    return wireframe.build_shape_solid("", shape)


def _list_triangles(wire: WireSolid) -> tuple[tuple[str, NDArray[Any]], ...]:
    """Return the corners of the triangles of a solid, and the ends of its edges, with names."""
    fans = [face[[0, i, i + 1]] for face in wire.faces for i in range(1, len(face) - 1)]
    return _name_points(np.array(fans)), _name_points(wire.segments)


def _name_points(points: ArrayLike) -> tuple[str, NDArray[Any]]:
    """Return points (n, 3), and a name that depends on their values."""
    values = np.ascontiguousarray(np.asarray(points, dtype=np.float32).reshape(-1, 3))
    digest = hashlib.blake2b(values.tobytes(), digest_size=9)
    return f"shape {digest.hexdigest()}", values


def _name_greys(picture: GreyPicture) -> tuple[str, NDArray[Any]]:
    """Return the grey values of a picture with at most MOST_TEXELS rows and columns, and a name."""
    return f"picture {picture.digest[:18]}", shrink_picture(picture.grey, MOST_TEXELS)
