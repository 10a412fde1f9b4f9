"""Random starts: around the goal for a flying camera, within joint limits for other robots."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from robsim.analysis.field import Field
from robsim.base.arrays import Array, numbers, runs_last
from robsim.base.errors import InputError, said
from robsim.geometry.pose import Pose, homogeneous

ROUNDS = 100  # of draws at most
Draw = Callable[[np.random.Generator, int], Array]


def drawn(field: Field, count: int, seed: int, distance: Any, cone: Any) -> Array:
    """Return starts (nq, count) with all marks in front of their cameras; see `equilibria`."""
    draw = _around_the_goal(field, *_cap(distance, cone)) if _flies(field) else _anywhere(field)
    rng, kept, found = np.random.default_rng(seed), [], 0
    for _ in range(ROUNDS):
        q = draw(rng, count)
        kept.append(q[:, field.in_front(q)])
        found += kept[-1].shape[1]
        if found >= count:
            return np.ascontiguousarray(np.concatenate(kept, axis=1)[:, :count])
    raise InputError(
        f"starts: of {ROUNDS * count} that were drawn only {found} have all marks in front of the "
        "camera; give starts of your own, of shape (B, nq)"
    )


def _cap(distance: Any, cone: Any) -> tuple[float, float, float]:
    """Return the nearest and farthest distance and the half angle of the cone; or InputError."""
    pair, angle = numbers(distance, "distance", (2,)), numbers(cone, "cone (radians)", ())
    if pair.ndim != 1 or not 0 < pair[0] <= pair[1]:
        raise InputError(
            "distance: expected (nearest, farthest) above 0, in units of the distance at the "
            f"goal, got {said(distance)}"
        )
    if angle.ndim or not 0 <= angle <= np.pi:
        raise InputError(f"cone: expected a half angle from 0 to pi radians, got {said(cone)}")
    return float(pair[0]), float(pair[1]), float(angle)


def _flies(field: Field) -> bool:
    """Return whether a single floating joint on the world carries the first camera."""
    tree, columns = field.scene.tree, field.controller.columns
    body, _ = tree.find(field.controller.sights[0].eye.name)
    free = tree.models[body].free and tree.parent[body] == 0
    return bool(free and (tree.owners[columns] == body).all())


def _around_the_goal(field: Field, near: float, far: float, cone: float) -> Draw:
    """Return a function that draws poses of a camera that looks at the middle of the marks."""
    sight, tree = field.controller.sights[0], field.scene.tree
    home = runs_last(field.scene.home, 1)
    body, T_b_c = tree.find(sight.eye.name)
    first = tree.iq[body]
    T_w_o = Pose(homogeneous(sight.project(home).T_w_o)[0])
    middle = T_w_o @ sight.target.marks.mean(axis=0)
    way = (T_w_o @ field.goal_pose.inv()).position - middle
    if not way.any():
        raise InputError(
            "starts: a goal given as numbers says nothing about where to start, and home is in "
            "the middle of the marks; give starts, of shape (B, nq)"
        )
    place = Pose(homogeneous(tree.joints.place[body][..., None])[0])

    def draw(rng: np.random.Generator, count: int) -> Array:
        scale, roll = rng.uniform(near, far, count), rng.uniform(-np.pi, np.pi, count)
        out = _in_cone(way / np.linalg.norm(way), cone, rng, count)
        T = np.tile(np.eye(4), (count, 1, 1))
        T[:, :3, :3] = facing(-out, roll)
        T[:, :3, 3] = middle + np.linalg.norm(way) * scale[:, None] * out
        q = np.repeat(home, count, axis=1)
        q[first : first + 7] = (place.inv() @ Pose(T) @ Pose(T_b_c).inv()).q.T
        return q

    return draw


def _in_cone(axis: Array, cone: float, rng: np.random.Generator, count: int) -> Array:
    """Return unit vectors (count, 3), uniform on the sphere within the angle `cone` of the axis."""
    along, round_ = rng.uniform(np.cos(cone), 1.0, count), rng.uniform(-np.pi, np.pi, count)
    turn = facing(axis[None], np.zeros(1))[0]
    across = np.sqrt(1.0 - along**2)
    inside = np.stack([across * np.cos(round_), across * np.sin(round_), along], axis=1)
    return np.asarray(inside @ turn.T)


def facing(z: Array, roll: Array, y: Array | None = None) -> Array:
    """Return rotations (B, 3, 3) with third axes z (B, 3), turned about them by `roll`.

    Without roll the second axes are as near as can be to y (3,); None: to some axis.
    """
    helper = np.eye(3)[np.argmin(np.abs(z), axis=1)] if y is None else y
    x = np.cross(helper, z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y, (c, s) = np.cross(z, x), (np.cos(roll)[:, None], np.sin(roll)[:, None])
    return np.stack([c * x + s * y, c * y - s * x, z], axis=2)


def _anywhere(field: Field) -> Draw:
    """Return a function that draws commanded coordinates uniformly within their limits.

    The other coordinates stay at home.
    """
    scene, tree = field.scene, field.scene.tree
    home = runs_last(scene.home, 1)
    bodies = np.unique(tree.owners[field.controller.columns])
    moved = [member for member in tree.members if member.body in bodies]

    def draw(rng: np.random.Generator, count: int) -> Array:
        q = np.repeat(home, count, axis=1)
        for _, kind, rows, *_ in moved:
            q[rows] = kind.sample(rng, count, home[rows, 0], scene.limits[rows]).T
        return q

    return draw
