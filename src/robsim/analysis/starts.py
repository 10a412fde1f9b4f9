"""Random starts: around the goal for a flying camera, within joint limits for other robots."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from robsim.analysis.field import Field
from robsim.analysis.flying import flies, flown
from robsim.base.arrays import Array, numbers, runs_last
from robsim.base.errors import InputError, said
from robsim.geometry.looking import facing, in_cone
from robsim.geometry.pose import Pose, homogeneous

ROUNDS = 100  # of draws at most
Draw = Callable[[np.random.Generator, int], Array]


def drawn(field: Field, count: int, seed: int, distance: Any, cone: Any) -> Array:
    """Return starts (nq, count) with all marks in front of their cameras; see `equilibria`."""
    around = flies(field.controller, field.controller.sights[0].eye.name)
    draw = _around_the_goal(field, *_cap(distance, cone)) if around else _anywhere(field)
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


def _around_the_goal(field: Field, near: float, far: float, cone: float) -> Draw:
    """Return a function that draws poses of a camera that looks at the middle of the marks."""
    sight = field.controller.sights[0]
    T_w_o = Pose(homogeneous(sight.project(runs_last(field.scene.home, 1)).T_w_o)[0])
    middle = T_w_o @ sight.target.marks.mean(axis=0)
    way = (T_w_o @ field.goal_pose.inv()).position - middle
    if not way.any():
        raise InputError(
            "starts: a goal given as numbers says nothing about where to start, and home is in "
            "the middle of the marks; give starts, of shape (B, nq)"
        )

    def draw(rng: np.random.Generator, count: int) -> Array:
        scale, roll = rng.uniform(near, far, count), rng.uniform(-np.pi, np.pi, count)
        along, around = rng.uniform(0.0, 1.0, (2, count))
        out = in_cone(way / np.linalg.norm(way), cone, along, around)
        T = np.tile(np.eye(4), (count, 1, 1))
        T[:, :3, :3] = facing(-out, roll)
        T[:, :3, 3] = middle + np.linalg.norm(way) * scale[:, None] * out
        return runs_last(flown(field.scene, sight.eye.name, T), 1)

    return draw


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
