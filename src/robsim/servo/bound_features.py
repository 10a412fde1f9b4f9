"""What a task regulates in a scene: s, its goal, and how the joints move it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_positive, make_read_only, move_runs_first
from robsim.base.errors import GoalError, InputError, format_value
from robsim.base.value import replace_unchecked
from robsim.features.feature import Observation
from robsim.kernels.formulas.jacobian import BodyMoves
from robsim.kernels.formulas.projection_arrays import Projection
from robsim.servo.bound_block import BoundBlock
from robsim.servo.camera_target import CameraTarget, PairKey, adjoint, compute_relative_pose
from robsim.servo.laws.broyden_rule import Interaction
from robsim.servo.laws.depth_model import DepthModel
from robsim.servo.laws.inverse import multiply_batches


@dataclass(frozen=True, eq=False)
class FeatureState:
    """The features s with L and the Jacobians, as the controller models them, with the run last."""

    s: Array  # (k, B)
    L: Array  # (k, 6, B) for the twist of the first camera, where all cameras move as one
    J: Array  # (6, n, B) of the first camera against its target
    task_jacobian: Array  # (k, n, B) L J, or as learnt by Broyden's rule


@dataclass(frozen=True, eq=False)
class BoundFeatures:
    """All feature blocks of a task with their goal, and the commanded velocities."""

    parts: tuple[BoundBlock, ...]
    sights: tuple[CameraTarget, ...]  # as believed, each once; the first is the reference
    exact: bool  # whether the belief is the truth
    columns: NDArray[np.int64]
    depths: DepthModel
    which: Interaction | Array  # or one constant L (k, 6)
    goals: dict[PairKey, Observation]  # of each sight at the goal, whose depth is the true one
    q_goal: Array | None  # (nq, runs) where it was shown
    given: Array | None  # (k,) features at the goal, where they are given as numbers
    runs: int = 1  # of which each has numbers of its own, and so a goal of its own

    def at_its_goal(self) -> BoundFeatures:
        """Return a copy whose features are measured relative to the goal, where they can be."""
        bound = [
            (part.towards(view) if self.given is None else part).counted(view)
            for part, view in self._goal_views
        ]
        made = replace(self, parts=tuple(bound))
        seen = ("_goal_projections", "_seen_at_goal", "_goal_observations")  # by any feature
        vars(made).update((name, vars(self)[name]) for name in seen)
        return made

    def _task_jacobian(self, L: Array, each: list[Array], J: dict[PairKey, Array]) -> Array:
        """Return L J (k, n, B), camera by camera: sdot = L (J_c - J_o) qdot."""
        if self.as_one:
            return multiply_batches(L, J[self.sights[0].key])
        rows = zip(each, self.parts, strict=True)
        return _stack_features(
            [multiply_batches(L_part, J[part.sights[0].key]) for L_part, part in rows]
        )

    @cached_property
    def as_one(self) -> bool:
        """Whether all cameras have one relative motion to their targets, and so one twist."""
        return all(sight.moves_with(self.sights[0]) for sight in self.sights)

    @cached_property
    def s_goal(self) -> Array:
        """The features s (k, runs) at the goal; (k, 1) where they are given."""
        s = self.at_goal.s
        if self.given is not None:
            if self.given.shape != (len(s),):
                raise GoalError(
                    f"goal s: expected {len(s)} numbers for {self.names}, got {self.given.size}"
                )
            return self.given[:, None].copy()  # writeable, as s is: kernels are compiled for it
        if not s.size or not np.isfinite(s).all():
            raise GoalError(
                f"{self.names}: s at the goal must be finite, got {format_value(s[:, 0])}{self.reasons}"
            )
        return s

    @property
    def names(self) -> str:
        """The names of the features, as text."""
        return ", ".join(part.name for part in self.parts)

    @property
    def reasons(self) -> str:
        """The reasons for which features can have no finite value at a goal, as text."""
        found = [getattr(part.feature, "singular", None) for part in self.parts]
        return "".join(f"; {reason}" for reason in dict.fromkeys(found) if reason)

    @property
    def k(self) -> int:
        """The number of features."""
        return sum(part.size for part in self.parts)

    @property
    def units(self) -> tuple[str, ...]:
        """The unit of each feature (k,)."""
        return tuple(part.feature.unit for part in self.parts for _ in range(part.size))

    @property
    def goal_pixels(self) -> Array:
        """The pixels of the marks of all sights at the goal: (N, 2), or (runs, N, 2)."""
        last = np.concatenate([self.goals[sight.key].pixels_last for sight in self.sights])
        pixels = move_runs_first(last) if self.runs > 1 else last[..., 0]
        return pixels if self.given is None else np.full(pixels.shape, np.nan)

    @property
    def motions(self) -> int:
        """The number of different relative motions of cameras and targets."""
        apart: list[CameraTarget] = []
        for sight in self.sights:
            if not any(sight.moves_with(other) for other in apart):
                apart.append(sight)
        return len(apart)

    @cached_property
    def at_goal(self) -> FeatureState:
        """The features at the goal; J is where the goal was shown."""
        s = _stack_features([part.measure(view) for part, view in self._goal_views])
        projections, columns = self._goal_projections, self.columns
        J = {t.key: t.jacobian(projections[t.key], t.moves(columns)) for t in self.sights}
        if isinstance(self.which, np.ndarray):
            each: list[Array] = []  # all cameras move as one
            L = np.repeat(self.which[..., None], s.shape[1], axis=-1)
        else:
            each = self.L_goals
            L = _stack_features(
                [_convert_to_first_camera(L, A) for L, A in zip(each, self.adjoints, strict=True)]
            )
        return FeatureState(s, L, J[self.sights[0].key], self._task_jacobian(L, each, J))

    @cached_property
    def tolerances(self) -> Array:
        """The tolerance (k,) of each component, from its feature."""
        each = [np.full(p.size, as_positive(p.feature.tolerance, "tolerance")) for p in self.parts]
        return np.concatenate(each)

    @cached_property
    def weights(self) -> Array:
        """The weight (k, 1) of each component, from its block."""
        return np.concatenate([np.full(p.size, p.weight) for p in self.parts])[:, None]

    @cached_property
    def L_goals(self) -> list[Array]:
        return [part.interaction(view) for part, view in self._goal_views]

    def depends(self) -> list[NDArray[np.bool_] | None]:
        """Return on which marks the numbers of each block depend, as `BoundBlock.depends` does."""
        seen = self._seen_at_goal, self._goal_projections
        return [part.depends(part.all_at_goal(*seen)) for part in self.parts]

    def made_of(self) -> list[tuple[BoundBlock, NDArray[np.bool_]]]:
        """Return each block, and of which marks its numbers are made, as they are at the goal.

        Where that is given as numbers, as they are where the target is seen from before it.
        InputError: they have no value there.
        """
        seen = self._seen_at_goal
        if self.given is not None:
            seen = {sight.key: sight.before() for sight in self.sights}
        found = []
        for part in self.parts:
            marks = part.made_of(part.all_at_goal(seen, self._goal_projections))
            if marks is None:
                raise InputError(f"{part.name} has no value at the goal, so no marks to weigh")
            found.append((part, marks))
        return found

    @property
    def _goal_views(self) -> Iterable[tuple[BoundBlock, Observation]]:
        """Each block with what it is shown at the goal."""
        return zip(self.parts, self._goal_observations, strict=True)

    @cached_property
    def _goal_observations(self) -> list[Observation]:
        """The observation of each block at the goal."""
        return [part.at_goal(self._seen_at_goal, self._goal_projections) for part in self.parts]

    @cached_property
    def _seen_at_goal(self) -> dict[PairKey, Observation]:
        """The observation of each sight at the goal, with the chosen depth."""
        return {
            key: replace_unchecked(
                goal, depth_last=make_read_only(self.depths.at_goal(goal.depth_last))
            )
            for key, goal in self.goals.items()
        }

    @cached_property
    def _goal_projections(self) -> dict[PairKey, Projection]:
        """The believed projections where the goal was shown, or at home where it was computed."""
        q = self.q_goal
        return {
            sight.key: sight.project(sight.home(self.runs) if q is None else q)
            for sight in self.sights
        }

    @cached_property
    def moves(self) -> dict[PairKey, BodyMoves]:
        """How the commanded velocities move each camera against its target."""
        return {sight.key: sight.moves(self.columns) for sight in self.sights}

    @cached_property
    def own_moves(self) -> tuple[NDArray[np.int64], dict[PairKey, BodyMoves]]:
        """The prescribed velocities, and how they move each camera against its target."""
        columns = make_read_only(np.flatnonzero(self.sights[0].scene.prescribed))
        return columns, {sight.key: sight.moves(columns) for sight in self.sights}

    @cached_property
    def adjoints(self) -> list[Array | None]:
        """The map (6, 6, B) of the first camera's twist to each block's; None for itself."""
        first = self.sights[0].key
        projections = self._goal_projections
        return [
            None
            if part.sights[0].key == first
            else adjoint(
                compute_relative_pose(
                    projections[part.sights[0].key].T_w_c, projections[first].T_w_c
                )
            )
            for part in self.parts
        ]


def _convert_to_first_camera(L: Array, A: Array | None) -> Array:
    if A is None:
        return L
    return multiply_batches(L, np.ascontiguousarray(np.broadcast_to(A, (6, 6, L.shape[2]))))


def _stack_features(arrays: Sequence[Array]) -> Array:
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)
