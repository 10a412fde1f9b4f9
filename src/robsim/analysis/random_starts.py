"""Random starts: around the goal for a flying camera, within joint limits for other robots."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.analysis.vector_fields import VectorField
from robsim.base.arrays import Array, as_floats, move_runs_last
from robsim.base.errors import InputError, format_value
from robsim.starts.rejection_sampler import draw_starts
from robsim.starts.start_kinematics import StartKinematics, is_floating
from robsim.starts.start_samplers import LookAt, Start
from robsim.statistics.random_numbers import RandomNumbers

ROUNDS = 100  # most attempts for a start


def sample_starts(
    field: VectorField, count: int, seed: int, distance: ArrayLike, cone: ArrayLike
) -> Array:
    """Return starts (nq, count) with all marks in front of their cameras; see `equilibria`."""
    reach = StartKinematics(field.controller)
    q, tries, accepted = draw_starts(
        _make_goal_sampler(reach, distance, cone)
        if _is_flying_camera(reach)
        else _JointSpaceStart(),
        reach,
        partial(RandomNumbers, seed, "start"),
        np.arange(count),
        lambda draws, q: field.in_front(move_runs_last(q, 1)),
        [1] * ROUNDS,
    )
    if accepted.all():
        return move_runs_last(q, 1)
    raise InputError(
        f"starts: only {accepted.sum()} of {tries.sum()} random starts have all marks in front of "
        "the camera; give starts, of shape (B, nq)"
    )


def _is_flying_camera(reach: StartKinematics) -> bool:
    """Return whether the moving frame is a camera on a floating joint."""
    cameras = [eye.name for eye in reach.scene.cameras]
    return reach.frame in cameras and is_floating(reach.controller, reach.frame)


def _make_goal_sampler(reach: StartKinematics, distance: ArrayLike, cone: ArrayLike) -> LookAt:
    """Return the sampler of camera poses that look at the middle of the marks."""
    pair, angle = as_floats(distance, "distance", (2,)), as_floats(cone, "cone (radians)", ())
    if pair.ndim != 1 or not 0 < pair[0] <= pair[1]:
        raise InputError(
            "distance: expected (nearest, farthest) above 0, in units of the distance at the "
            f"goal, got {format_value(distance)}"
        )
    if angle.ndim or not 0 <= angle <= np.pi:
        raise InputError(
            f"cone: expected a half angle from 0 to pi radians, got {format_value(cone)}"
        )
    target = reach.controller.sights[0].target.name
    goal_distance = np.linalg.norm(reach.goal.position - reach.middle(target))
    if not goal_distance:
        raise InputError(
            "starts: a goal given as numbers has no pose, and home is in the middle of the "
            "marks; give starts, of shape (B, nq)"
        )
    return LookAt(target, distance=goal_distance * pair, cone=float(angle))


@dataclass(frozen=True, eq=False)
class _JointSpaceStart(Start):
    """Starts with commanded coordinates uniform within their limits, and the others at home."""

    def coordinates(
        self, reach: StartKinematics, draws: RandomNumbers
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Return coordinates (draws, nq), all of them reachable."""
        bodies = np.unique(reach.scene.tree.owners[reach.controller.columns])
        q = reach.sample_coordinates(draws, bodies)
        return q, np.ones(len(q), dtype=bool)
