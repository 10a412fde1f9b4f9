"""The distance between the shapes of two things, by the separating axis theorem."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value, suggest_names
from robsim.geometry.hull import Hull
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.primitives import Primitive
from robsim.world.scene import Scene

BATCH_SIZE = 256  # configurations at a time, so that they fit into the cache
PARALLEL = 1e-9  # sine of the angle below which two edges count as parallel


class PosedHull(NamedTuple):
    """A hull with the ball around it and the pose of its frame at each configuration."""

    hull: Hull
    centre: Array  # (3,)
    radius: float
    pose: Array  # (B, 4, 4) of the frame in the world

    @property
    def centres(self) -> Array:
        """The centres (B, 3) of the bounding ball, in the world."""
        centres: Array = self.pose[:, :3, :3] @ self.centre + self.pose[:, :3, 3]
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
    crossing edges are nearest, also between capsules and balls however they lie, and less where a
    corner faces a corner or the side of an edge. Each shape counts as its convex hull, a wheel as
    the prism around its circle, and a tapered cylinder likewise, so that the bound holds. A mesh,
    which only figures open, raises InputError.

    >>> from robsim import Block, Object
    >>> cubes = [Object(n, Block(1, 1, 1), pose=Pose.at(x, 0, 0)) for n, x in [("a", 0), ("b", 3)]]
    >>> float(clearance(Scene(objects=cubes), [], "a", "b"))
    2.0
    """
    if not isinstance(scene, Scene):
        raise InputError(f"scene: expected a Scene, got {format_value(scene)}")
    values = scene.coordinates(q, limits=False)
    rows = values.reshape(math.prod(values.shape[:-1]), scene.nq)
    mine, theirs = _select_hulls(scene, one), _select_hulls(scene, other)
    shared = sorted(set(mine) & set(theirs))
    if shared:
        raise InputError(f"'{shared[0]}' is on both sides: nothing is apart from itself")
    least = np.full(len(rows), np.inf)
    for start in range(0, len(rows), BATCH_SIZE):
        some = rows[start : start + BATCH_SIZE]
        firsts, seconds = (list(_pose_hulls(scene, hulls, some)) for hulls in (mine, theirs))
        _lower_clearances(firsts, seconds, least[start : start + BATCH_SIZE])
    return least.reshape(values.shape[:-1])


def _lower_clearances(firsts: list[PosedHull], seconds: list[PosedHull], least: Array) -> None:
    """Lower each of `least` (B,) in place to the gap of the nearest pair of solids there."""
    for a in firsts:
        for b in seconds:
            away = _vector_lengths(b.centres - a.centres) - a.radius - b.radius
            near = np.flatnonzero(away < least)  # elsewhere this pair is not the nearest
            if near.size:
                gaps = _find_widest_gaps(
                    a.hull, b.hull, _relative_poses(a.pose[near], b.pose[near])
                )
                least[near] = np.minimum(least[near], gaps)


def _find_widest_gaps(a: Hull, b: Hull, T_a_b: Array) -> Array:
    """Return the widest gap (B,) between two hulls along any of their axes."""
    R, p = T_a_b[:, :3, :3], T_a_b[:, :3, 3]
    turned = np.swapaxes(R, 1, 2)
    across = np.cross(a.edges[:, None], (b.edges @ turned)[:, None])
    across = across.reshape(len(R), len(a.edges) * len(b.edges), 3)
    between = _segment_vectors(a.centre, a.core, p + R @ b.centre, R @ b.core)[:, None]
    fixed = np.broadcast_to(a.normals, (len(R), *a.normals.shape))
    ways = np.concatenate([fixed, b.normals @ turned, across, between], axis=1)
    axes, are_axes = _normalise_vectors(ways)
    first = axes @ a.points.T
    second = axes @ (b.points @ turned + p[:, None]).transpose(0, 2, 1)
    ahead = second.min(axis=2) - first.max(axis=2)
    behind = first.min(axis=2) - second.max(axis=2)
    gaps: Array = np.where(are_axes, np.maximum(ahead, behind), -np.inf).max(axis=1)
    return gaps - (a.beyond + b.beyond)


def _segment_vectors(a: Array, u: Array, b: Array, v: Array) -> Array:
    """Return vectors (B, 3) between the nearest points of the segments a + s u and b + t v.

    Both s and t are in [-1, 1]; u = 0 and v = 0 are points. C. Ericson, Real-Time Collision
    Detection, 2005, section 5.1.9.
    """
    gap = b - a
    uu, vv, uv = u @ u, (v * v).sum(axis=-1), v @ u
    ug, vg = gap @ u, (v * gap).sum(axis=-1)
    free = uu * vv - uv * uv
    s = np.clip((ug * vv - vg * uv) / np.where(free > PARALLEL * uu * vv, free, np.inf), -1, 1)
    t = np.clip((s * uv - vg) / np.where(vv > 0, vv, np.inf), -1, 1)
    s = np.clip((ug + t * uv) / (uu or np.inf), -1, 1)
    vectors: Array = gap + t[:, None] * v - s[:, None] * u
    return vectors


def _normalise_vectors(vectors: Array) -> tuple[Array, Any]:
    """Return unit vectors (..., 3), and whether each vector (...,) was long enough to normalise."""
    size = _vector_lengths(vectors)
    enough = size > PARALLEL
    return vectors / np.where(enough, size, 1.0)[..., None], enough


def _vector_lengths(vectors: Array) -> Array:
    length: Array = np.sqrt((vectors * vectors).sum(axis=-1))
    return length


def _relative_poses(A: Array, B: Array) -> Array:
    """Return T_a_b (B, 4, 4) of two poses (B, 4, 4) in the world."""
    T: Array = np.asarray(Pose(A).inv().matrix) @ B
    return T


# ---- selection of shapes ----


def _select_hulls(scene: Scene, given: Any) -> dict[str, list[Hull]]:
    """Return the hulls of named things by their frames; InputError if a name has none."""
    names = [given] if isinstance(given, str) else given
    if not isinstance(names, list | tuple) or not all(isinstance(n, str) for n in names):
        raise InputError(f"expected the name of a robot, link or object, or several, got {given!r}")
    frames, robots = _shapes_by_frame(scene), [robot.name for robot in scene.robots]
    found: dict[str, tuple[Primitive, ...]] = {}
    for name in names:
        if name in robots:
            found |= {frame: s for frame, s in frames.items() if frame.startswith(f"{name}.")}
        elif name in frames:
            found[name] = frames[name]
        else:
            hint = suggest_names(name, [*robots, *frames], "things")
            raise InputError(f"no robot, link or object {name!r} in the scene; {hint}")
    if not any(found.values()):
        raise InputError(f"{', '.join(names) or 'an empty list'}: no shapes, so nothing can touch")
    return {name: [shape.hull for shape in shapes] for name, shapes in found.items()}


def _shapes_by_frame(scene: Scene) -> dict[str, tuple[Primitive, ...]]:
    """Return all shapes of a scene by the name of the frame that carries them."""
    bodies = {eye.name: eye.camera.drawn(IDENTITY) for eye in scene.cameras}
    return {
        **{f"{robot.name}.{k.name}": k.shapes for robot in scene.robots for k in robot.links},
        **{thing.name: thing.shapes for thing in scene.objects},
        **{name: () if body is None else (body,) for name, body in bodies.items()},
    }


def _pose_hulls(scene: Scene, named: dict[str, list[Hull]], q: Array) -> Iterator[PosedHull]:
    for frame, hulls in named.items():
        if hulls:
            pose = scene.pose(frame, q).matrix
            yield from (PosedHull(each, each.centre, each.radius, pose) for each in hulls)
