"""The distance between the shapes of two things, by the separating axis theorem."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, said, suggest
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.primitives import Ball, Block, CameraBody, Primitive, Wheel
from robsim.world.scene import Scene

ROWS = 256  # configurations at a time, so that they fit into the cache
PARALLEL = 1e-9  # sine of the angle below which two edges count as parallel


class Hull(NamedTuple):
    """The convex hull of a primitive; parallel faces and parallel edges are listed once."""

    points: Array  # (V, 3)
    normals: Array  # (F, 3) of its faces, unit
    edges: Array  # (E, 3) along its edges, unit
    centre: Array  # (3,) of a ball around it
    radius: float
    beyond: float  # metres from its points to its surface: the radius of a ball, else 0


class Solid(NamedTuple):
    """A hull with the pose of the frame that carries it, at each configuration."""

    hull: Hull
    pose: Array  # (B, 4, 4) in the world

    @property
    def centres(self) -> Array:
        """The centres (B, 3) of the bounding ball, in the world."""
        centres: Array = self.pose[:, :3, :3] @ self.hull.centre + self.pose[:, :3, 3]
        return centres


def clearance(scene: Scene, q: Any, one: Any, other: Any) -> Array:
    """Return a lower bound (...,) of the distance in metres between two things at q (..., nq).

    A thing is a robot "crawler", one of its links "crawler.arm", an object, a camera with a body,
    or a list of such names. A positive value is a lower bound of the distance, 0 means that they
    touch, and a negative value is minus the length of a motion that separates them.

    Two convex polytopes are disjoint if and only if their projections are, on the normal of a face
    of either or on the cross product of an edge of each (S. Gottschalk, M. C. Lin and D. Manocha,
    OBBTree: a hierarchical structure for rapid interference detection, SIGGRAPH 1996). The gap
    along any axis is never more than the distance. It is the distance itself where a face or two
    crossing edges are nearest, and less where a corner faces a corner or the side of an edge. Each
    shape counts as its convex hull, and a wheel as the prism around its circle, so that the bound
    holds. A mesh, whose file is never opened, raises InputError.

    >>> from robsim import Block, Object
    >>> cubes = [Object(n, Block(1, 1, 1), pose=Pose.at(x, 0, 0)) for n, x in [("a", 0), ("b", 3)]]
    >>> float(clearance(Scene(objects=cubes), [], "a", "b"))
    2.0
    """
    if not isinstance(scene, Scene):
        raise InputError(f"scene: expected a Scene, got {said(scene)}")
    values = scene.coordinates(q, limits=False)
    rows = values.reshape(math.prod(values.shape[:-1]), scene.nq)
    mine, theirs = _hulls(scene, one), _hulls(scene, other)
    shared = sorted(set(mine) & set(theirs))
    if shared:
        raise InputError(f"'{shared[0]}' is on both sides: nothing is apart from itself")
    least = np.full(len(rows), np.inf)
    for start in range(0, len(rows), ROWS):
        some = rows[start : start + ROWS]
        firsts, seconds = (list(_solids(scene, hulls, some)) for hulls in (mine, theirs))
        _lower(firsts, seconds, least[start : start + ROWS])
    return least.reshape(values.shape[:-1])


def _lower(firsts: list[Solid], seconds: list[Solid], least: Array) -> None:
    """Lower each of `least` (B,) in place to the gap of the nearest pair of solids there."""
    for a in firsts:
        for b in seconds:
            away = _length(b.centres - a.centres) - a.hull.radius - b.hull.radius
            near = np.flatnonzero(away < least)  # elsewhere this pair is not the nearest
            if near.size:
                gaps = _gaps(a.hull, b.hull, _relative(a.pose[near], b.pose[near]))
                least[near] = np.minimum(least[near], gaps)


def _gaps(a: Hull, b: Hull, T_a_b: Array) -> Array:
    """Return the widest gap (B,) between two hulls along any of their axes."""
    R, p = T_a_b[:, :3, :3], T_a_b[:, :3, 3]
    turned = np.swapaxes(R, 1, 2)
    across = np.cross(a.edges[:, None], (b.edges @ turned)[:, None])
    across = across.reshape(len(R), len(a.edges) * len(b.edges), 3)
    between = (p + R @ b.centre - a.centre)[:, None]
    fixed = np.broadcast_to(a.normals, (len(R), *a.normals.shape))
    axes, are_axes = _units(np.concatenate([fixed, b.normals @ turned, across, between], axis=1))
    first = axes @ a.points.T
    second = axes @ (b.points @ turned + p[:, None]).transpose(0, 2, 1)
    ahead = second.min(axis=2) - first.max(axis=2)
    behind = first.min(axis=2) - second.max(axis=2)
    gaps: Array = np.where(are_axes, np.maximum(ahead, behind), -np.inf).max(axis=1)
    return gaps - (a.beyond + b.beyond)


def _units(vectors: Array) -> tuple[Array, Any]:
    """Return unit vectors (..., 3), and whether each vector (...,) was long enough to normalise."""
    size = _length(vectors)
    enough = size > PARALLEL
    return vectors / np.where(enough, size, 1.0)[..., None], enough


def _length(vectors: Array) -> Array:
    length: Array = np.sqrt((vectors * vectors).sum(axis=-1))
    return length


def _relative(A: Array, B: Array) -> Array:
    """Return T_a_b (B, 4, 4) of two poses (B, 4, 4) in the world."""
    T: Array = np.asarray(Pose(A).inv().matrix) @ B
    return T


# ---- selection of shapes ----


def _hulls(scene: Scene, given: Any) -> dict[str, list[Hull]]:
    """Return the hulls of named things by their frames; InputError if a name has none."""
    names = [given] if isinstance(given, str) else given
    if not isinstance(names, list | tuple) or not all(isinstance(n, str) for n in names):
        raise InputError(f"expected the name of a robot, link or object, or several, got {given!r}")
    frames, robots = _shapes(scene), [robot.name for robot in scene.robots]
    found: dict[str, tuple[Primitive, ...]] = {}
    for name in names:
        if name in robots:
            found |= {frame: s for frame, s in frames.items() if frame.startswith(f"{name}.")}
        elif name in frames:
            found[name] = frames[name]
        else:
            hint = suggest(name, [*robots, *frames], "things")
            raise InputError(f"no robot, link or object {name!r} in the scene; {hint}")
    if not any(found.values()):
        raise InputError(f"{', '.join(names) or 'an empty list'}: no shapes, so nothing can touch")
    return {name: [hull(shape) for shape in shapes] for name, shapes in found.items()}


def _shapes(scene: Scene) -> dict[str, tuple[Primitive, ...]]:
    """Return all shapes of a scene by the name of the frame that carries them."""
    bodies = {eye.name: eye.camera.drawn(IDENTITY) for eye in scene.cameras}
    return {
        **{f"{robot.name}.{k.name}": k.shapes for robot in scene.robots for k in robot.links},
        **{thing.name: thing.shapes for thing in scene.objects},
        **{name: () if body is None else (body,) for name, body in bodies.items()},
    }


def _solids(scene: Scene, named: dict[str, list[Hull]], q: Array) -> Iterator[Solid]:
    for frame, hulls in named.items():
        if hulls:
            pose = scene.pose(frame, q).matrix
            yield from (Solid(each, pose) for each in hulls)


# ---- hulls ----


def hull(shape: Primitive) -> Hull:
    """Return the hull of a primitive in the axes of the frame that carries it.

    >>> [len(part) for part in hull(Block(1, 2, 3))[:3]]
    [8, 3, 3]
    """
    own = shape.at(shape.pose.inv())
    points, normals, edges = _parts(own)
    points, turned = shape.pose @ points, shape.pose.rotation.T
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    beyond = own.radius if isinstance(own, Ball) else 0.0
    radius = float(_length(points - centre).max()) + beyond
    normals, edges = (_units(way @ turned)[0] for way in (normals, edges))
    return Hull(points, normals, edges, centre, radius, beyond)


def _parts(own: Primitive) -> tuple[Array, Array, Array]:
    """Return points, normals and edge directions of a shape in its own axes."""
    if isinstance(own, Block):
        return own.vertices, np.eye(3), np.eye(3)
    if isinstance(own, Wheel):
        return _prism(own)
    if isinstance(own, Ball):  # its centre; the radius is in `beyond`
        return np.zeros((1, 3)), np.eye(3), np.empty((0, 3))
    if isinstance(own, CameraBody):
        return _frustum(own.vertices)
    raise InputError(f"no hull of a {type(own).__name__} is known")


def _prism(wheel: Wheel) -> tuple[Array, Array, Array]:
    """Return the prism around a wheel's circle: points, normals and edge directions.

    Its sides touch the circle in their middles, so its corners are R/cos(pi/n) from the axis.
    """
    n, z = wheel.n, [[0.0, 0.0, 1.0]]
    corner = 2 * np.pi * np.arange(n) / n
    side = (corner + np.pi / n)[: n if n % 2 else n // 2]  # opposite sides are parallel for even n
    ring = _on_circle(corner) * wheel.radius / np.cos(np.pi / n)
    ends = [ring + np.array([0.0, 0.0, end * wheel.width / 2]) for end in (-1, 1)]
    normals, along = _on_circle(side), _on_circle(side + np.pi / 2)
    return np.concatenate(ends), np.concatenate([normals, z]), np.concatenate([along, z])


def _on_circle(angle: Array) -> Array:
    return np.column_stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))])


def _frustum(corners: Array) -> tuple[Array, Array, Array]:
    """Return the frustum from a camera's back to its opening, which encloses the box."""
    back, front = corners[:4], corners[8:]
    slants, sides = front - back, np.diff(back, axis=0, append=back[:1])
    normals = np.cross(sides, slants)
    z, xy = [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    return (
        np.concatenate([back, front]),
        np.concatenate([normals, z]),
        np.concatenate([slants, xy]),
    )
