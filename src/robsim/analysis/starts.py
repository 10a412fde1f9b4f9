"""Random starts: around the goal for a flying camera, within joint limits for other robots."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.field import Field
from robsim.base.arrays import Array, numbers, runs_last
from robsim.base.errors import InputError, said
from robsim.starts.draw_starts import draw_starts
from robsim.starts.reach import Reach, flies
from robsim.starts.starts import LookAt, Start
from robsim.statistics.random_numbers import Draws

ROUNDS = 100  # attempts at a start, at most


def drawn(field: Field, count: int, seed: int, distance: Any, cone: Any) -> Array:
    """Return starts (nq, count) with all marks in front of their cameras; see `equilibria`."""
    reach = Reach(field.controller)
    q, tries, found = draw_starts(
        _around_the_goal(reach, distance, cone) if _is_flying_camera(reach) else _Commanded(),
        reach,
        partial(Draws, seed, "start"),
        np.arange(count),
        lambda draws, q: field.in_front(runs_last(q, 1)),
        [1] * ROUNDS,
    )
    if found.all():
        return runs_last(q, 1)
    raise InputError(
        f"starts: of {tries.sum()} that were drawn only {found.sum()} have all marks in front of "
        "the camera; give starts of your own, of shape (B, nq)"
    )


def _is_flying_camera(reach: Reach) -> bool:
    cameras = [eye.name for eye in reach.scene.cameras]
    return reach.frame in cameras and flies(reach.controller, reach.frame)


def _around_the_goal(reach: Reach, distance: Any, cone: Any) -> LookAt:
    """Return the sampler of poses whose camera looks at the middle of the marks."""
    pair, angle = numbers(distance, "distance", (2,)), numbers(cone, "cone (radians)", ())
    if pair.ndim != 1 or not 0 < pair[0] <= pair[1]:
        raise InputError(
            "distance: expected (nearest, farthest) above 0, in units of the distance at the "
            f"goal, got {said(distance)}"
        )
    if angle.ndim or not 0 <= angle <= np.pi:
        raise InputError(f"cone: expected a half angle from 0 to pi radians, got {said(cone)}")
    target = reach.controller.sights[0].target.name
    away = np.linalg.norm(reach.goal.position - reach.middle(target))
    if not away:
        raise InputError(
            "starts: a goal given as numbers says nothing about where to start, and home is in "
            "the middle of the marks; give starts, of shape (B, nq)"
        )
    return LookAt(target, distance=away * pair, cone=float(angle))


@dataclass(frozen=True, eq=False)
class _Commanded(Start):
    """Commanded coordinates anywhere within their limits, and the others at home."""

    def coordinates(self, reach: Reach, draws: Draws) -> tuple[Array, NDArray[np.bool_]]:
        """Return coordinates (draws, nq), all of which are reached."""
        scene, tree = reach.scene, reach.scene.tree
        q, share = np.tile(scene.home, (len(draws.numbers), 1)), draws.uniform(scene.nq)
        bodies = np.unique(tree.owners[reach.controller.columns])
        for member in tree.members:
            if member.body in bodies:
                at = member.q
                q[:, at] = member.kind.sample(share[:, at], scene.home[at], scene.limits[at])
        return q, np.ones(len(q), dtype=bool)
