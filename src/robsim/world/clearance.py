"""A lower bound of the distance between the shapes of two things, by separating axes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value, suggest_names
from robsim.geometry.hull import Hull
from robsim.geometry.pose import IDENTITY, Pose
from robsim.geometry.primitives import Primitive
from robsim.world.scene import Scene
from robsim.world.scene_parts import Configuration

BATCH_SIZE = 256  # configurations in a batch, so that they fit into the cache
PARALLEL = 1e-9  # two edges count as parallel if the sine of their angle is below this number
Names = str | Sequence[str]  # names of robots, links, objects or cameras


class PosedHull(NamedTuple):
    """A hull with its bounding ball and the pose of its frame at each configuration."""

    hull: Hull
    centre: Array  # (3,)
    radius: float
    pose: Array  # (B, 4, 4) of the frame in the world

    @property
    def centres(self) -> Array:
        """The centres (B, 3) of the bounding ball, in the world."""
        centres: Array = self.pose[:, :3, :3] @ self.centre + self.pose[:, :3, 3]
        return centres


def clearance(scene: Scene, q: Configuration, one: Names, other: Names) -> Array:
    """Return a lower bound of the distance between two things of a scene.

    Two convex polytopes are disjoint if and only if their projections are disjoint on the normal of
    a face of either polytope, or on the cross product of an edge of each (Gottschalk, Lin and
    Manocha 1996). The gap along any axis is never larger than the distance. The widest gap equals
    the distance if faces or crossing edges are nearest, and between capsules and balls in any pose;
    it is smaller if a corner faces a corner or the side of an edge.

    Every shape is replaced by its convex hull, and a wheel or a tapered cylinder by a prism around
    it. These are not smaller than the shapes, so the bound holds for the shapes as well.

    Parameters
    ----------
    scene : Scene
        Scene that contains both things.
    q : array_like of shape (..., nq), or mapping of str to array_like
        Coordinates of the scene, or the coordinates of each robot by its name.
    one, other : str or list of str
        Name of a robot such as "crawler", of one of its links such as "crawler.arm", of an object,
        or of a camera with a body; or several such names.

    Returns
    -------
    ndarray of shape (...)
        Lower bound of the distance in metres. If the hulls overlap, the value is not above zero,
        and a translation by its magnitude separates them.

    Raises
    ------
    InputError
        If a name does not exist, has no shapes, or is in both arguments, or if a shape is a mesh:
        only figures load meshes.

    References
    ----------
    S. Gottschalk, M. C. Lin and D. Manocha, OBBTree: a hierarchical structure for rapid
    interference detection, SIGGRAPH 1996.

    Examples
    --------
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
        raise InputError(f"'{shared[0]}' is on both sides: a thing has no distance from itself")
    least = np.full(len(rows), np.inf)
    for start in range(0, len(rows), BATCH_SIZE):
        batch = rows[start : start + BATCH_SIZE]
        firsts, seconds = (list(_pose_hulls(scene, hulls, batch)) for hulls in (mine, theirs))
        _lower_clearances(firsts, seconds, least[start : start + BATCH_SIZE])
    return least.reshape(values.shape[:-1])


def _lower_clearances(firsts: list[PosedHull], seconds: list[PosedHull], least: Array) -> None:
    """Lower each element of `least` (B,) in place to the gap of the nearest pair of solids."""
    for a in firsts:
        for b in seconds:
            away = _vector_lengths(b.centres - a.centres) - a.radius - b.radius
            near = np.flatnonzero(away < least)  # elsewhere, another pair is known to be nearer
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
    directions = np.concatenate([fixed, b.normals @ turned, across, between], axis=1)
    axes, are_axes = _normalise_vectors(directions)
    first = axes @ a.points.T
    second = axes @ (b.points @ turned + p[:, None]).transpose(0, 2, 1)
    ahead = second.min(axis=2) - first.max(axis=2)
    behind = first.min(axis=2) - second.max(axis=2)
    gaps: Array = np.where(are_axes, np.maximum(ahead, behind), -np.inf).max(axis=1)
    return gaps - (a.beyond + b.beyond)


def _segment_vectors(a: Array, u: Array, b: Array, v: Array) -> Array:
    """Return vectors (B, 3) between the nearest points of the segments a + s u and b + t v.

    Both s and t are in [-1, 1]; u = 0 or v = 0 is a point (C. Ericson, Real-Time Collision
    Detection, 2005, section 5.1.9).
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


def _normalise_vectors(vectors: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return unit vectors (..., 3), and whether each vector (...,) was long enough to normalise."""
    size = _vector_lengths(vectors)
    enough = size > PARALLEL
    return vectors / np.where(enough, size, 1.0)[..., None], enough


def _vector_lengths(vectors: Array) -> Array:
    """Return the lengths (...) of vectors (..., 3)."""
    length: Array = np.sqrt((vectors * vectors).sum(axis=-1))
    return length


def _relative_poses(A: Array, B: Array) -> Array:
    """Return T_a_b (B, 4, 4) of two poses (B, 4, 4) in the world."""
    T: Array = np.asarray(Pose(A).inv().matrix) @ B
    return T


# ---- selection of shapes ----


def _select_hulls(scene: Scene, selection: Names) -> dict[str, list[Hull]]:
    """Return the hulls of named things by frame; raise InputError if there are none."""
    names = [selection] if isinstance(selection, str) else selection
    if not isinstance(names, list | tuple) or not all(isinstance(n, str) for n in names):
        raise InputError(
            f"expected the name of a robot, link or object, or several, got {selection!r}"
        )
    frames, robots = _shapes_by_frame(scene), [robot.name for robot in scene.robots]
    selected: dict[str, tuple[Primitive, ...]] = {}
    for name in names:
        if name in robots:
            selected |= {frame: s for frame, s in frames.items() if frame.startswith(f"{name}.")}
        elif name in frames:
            selected[name] = frames[name]
        else:
            hint = suggest_names(name, [*robots, *frames], "things")
            raise InputError(f"no robot, link or object {name!r} in the scene; {hint}")
    if not any(selected.values()):
        raise InputError(
            f"{', '.join(names) or 'an empty list'}: no shapes, so there is no distance"
        )
    return {name: [shape.hull for shape in shapes] for name, shapes in selected.items()}


def _shapes_by_frame(scene: Scene) -> dict[str, tuple[Primitive, ...]]:
    """Return all shapes of a scene by the name of the frame that carries them."""
    bodies = {eye.name: eye.camera.drawn(IDENTITY) for eye in scene.cameras}
    return {
        **{f"{robot.name}.{k.name}": k.shapes for robot in scene.robots for k in robot.links},
        **{thing.name: thing.solids for thing in scene.objects},
        **{name: () if body is None else (body,) for name, body in bodies.items()},
    }


def _pose_hulls(
    scene: Scene, hulls_by_frame: dict[str, list[Hull]], q: Array
) -> Iterator[PosedHull]:
    """Yield hulls with the poses of their frames at coordinates q (B, nq)."""
    for frame, hulls in hulls_by_frame.items():
        if hulls:
            pose = scene.pose(frame, q).matrix
            yield from (PosedHull(each, each.centre, each.radius, pose) for each in hulls)
