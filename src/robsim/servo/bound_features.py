"""The bound features of a task in a scene: s, its goal, and its dependence on the joints."""

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
from robsim.features.images.inverse_depth import fit_inverse_depth
from robsim.features.images.taken_pictures import TakenPictures
from robsim.kernels.formulas.jacobian import BodyMoves
from robsim.kernels.formulas.projection_arrays import Projection
from robsim.servo.bound_block import BoundBlock
from robsim.servo.camera_target import CameraTarget, PairKey, adjoint, compute_relative_pose
from robsim.servo.goals.goal import GoalKind
from robsim.servo.goals.goal_marks import locate_goal_marks
from robsim.servo.goals.goal_pictures import draw_pictures
from robsim.servo.laws.broyden_rule import Interaction
from robsim.servo.laws.depth_model import DepthModel
from robsim.servo.laws.inverse import multiply_batches


@dataclass(frozen=True, eq=False)
class FeatureState:
    """Features s with L and the Jacobians, as the controller models them, with the run last."""

    s: Array  # (k, B)
    L: Array  # (k, 6, B) for the twist of the first camera, if all cameras move as one
    J: Array  # (6, n, B) of the first camera relative to its target
    task_jacobian: Array  # (k, n, B) L J, or its estimate by Broyden's rule


@dataclass(frozen=True, eq=False)
class GoalViews:
    """Observations of a goal by all camera-target pairs, in the scene in which it is shown.

    That scene differs from the present scene if bodies have moved since (`TaughtGoal.places`).
    """

    q_shown: Array | None  # (nq, runs) configuration of a shown goal
    truth: CameraTarget  # true first pair
    sights: tuple[CameraTarget, ...]  # believed pairs, each once
    observations: dict[PairKey, Observation]  # with the true depths
    goal: GoalKind

    def compute_target_pose(self) -> Array | None:
        """Return the true T_c_o (3, 4, runs) of the first pair; None unless the goal is shown."""
        if self.q_shown is None:
            return None
        seen = self.truth.project(self.q_shown)
        return compute_relative_pose(seen.T_w_c, seen.T_w_o)


@dataclass(frozen=True, eq=False)
class BoundFeatures:
    """The feature blocks of a task in a scene, with their goal and the commanded velocities."""

    parts: tuple[BoundBlock, ...]
    sights: tuple[CameraTarget, ...]  # believed pairs, each once; the first pair is the reference
    exact: bool  # whether the belief is the truth
    columns: NDArray[np.int64]
    depths: DepthModel
    which: Interaction | Array  # model of L, or a constant L (k, 6)
    goal_views: GoalViews
    goal_values: Array | None  # (k,) goal of numbers, `GoalFeatures.s`
    runs: int = 1  # number of runs with individual numbers, and therefore goals

    def measure_from_goal(self) -> BoundFeatures:
        """Return a copy with features measured relative to the goal, if they have `towards`."""
        bound = [
            (part.towards(view) if self.goal_values is None else part)
            .with_interaction(self.which)
            .with_size(view)
            for part, view in self._goal_views
        ]
        copy = replace(self, parts=tuple(bound))
        # these do not depend on the features
        cached = ("_goal_projections", "pair_observations", "_goal_observations")
        vars(copy).update((name, vars(self)[name]) for name in cached)
        return copy

    @property
    def goals(self) -> dict[PairKey, Observation]:
        """Observation of each pair at the goal, with the true depths."""
        return self.goal_views.observations

    @property
    def q_goal(self) -> Array | None:
        """Configuration (nq, runs) that reaches a shown goal in the present scene; None if unknown.

        It is unknown if bodies have moved since the goal was shown.
        """
        return None if self.has_moved_bodies else self.goal_views.q_shown

    @property
    def has_moved_bodies(self) -> bool:
        """Whether the goal was shown in another scene than the present one."""
        return self.goal_views.sights[0] is not self.sights[0]

    def _task_jacobian(self, L: Array, each: list[Array], J: dict[PairKey, Array]) -> Array:
        """Return L J (k, n, B) with sdot = L (J_c - J_o) qdot, block by block."""
        if self.has_single_motion:
            return multiply_batches(L, J[self.sights[0].key])
        rows = zip(each, self.parts, strict=True)
        return _stack_features(
            [multiply_batches(L_part, J[part.sights[0].key]) for L_part, part in rows]
        )

    @cached_property
    def has_single_motion(self) -> bool:
        """Whether all cameras have one motion relative to their targets, and so one twist."""
        return all(sight.moves_with(self.sights[0]) for sight in self.sights)

    @cached_property
    def s_goal(self) -> Array:
        """Features s (k, runs) at the goal; (k, 1) for a goal of numbers."""
        s = self.at_goal.s
        if self.goal_values is not None:
            if self.goal_values.shape != (len(s),):
                raise GoalError(
                    f"goal s: expected {len(s)} numbers for {self.names}, "
                    f"got {self.goal_values.size}"
                )
            return self.goal_values[:, None].copy()  # kernels are compiled for writeable arrays
        if not s.size or not np.isfinite(s).all():
            value = format_value(s[:, 0])
            raise GoalError(
                f"{self.names}: s at the goal must be finite, got {value}{self.reasons}"
            )
        return s

    @property
    def names(self) -> str:
        """Names of the features, as text."""
        return ", ".join(part.name for part in self.parts)

    @property
    def reasons(self) -> str:
        """Reasons why features may have no finite value at a goal, as text."""
        reasons = [getattr(part.feature, "singular", None) for part in self.parts]
        return "".join(f"; {reason}" for reason in dict.fromkeys(reasons) if reason)

    @property
    def k(self) -> int:
        """Number of features."""
        return sum(part.size for part in self.parts)

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each feature (k,)."""
        return tuple(part.feature.unit for part in self.parts for _ in range(part.size))

    @property
    def goal_pixels(self) -> Array:
        """Pixels of all marks at the goal: (N, 2), or (runs, N, 2)."""
        last = np.concatenate([self.goals[sight.key].pixels_last for sight in self.sights])
        pixels = move_runs_first(last) if self.runs > 1 else last[..., 0]
        return pixels if self.goal_values is None else np.full(pixels.shape, np.nan)

    def locate_marks(self, sight: CameraTarget) -> Array:
        """Return the pixels (N, 2, runs) of the marks of a pair at the goal; NaN if unknown."""
        if self.goal_values is None:
            return self.goals[sight.key].pixels_last
        return locate_goal_marks(sight, self.parts, self.s_goal[:, 0])

    @property
    def motions(self) -> int:
        """Number of different relative motions of cameras and targets."""
        apart: list[CameraTarget] = []
        for sight in self.sights:
            if not any(sight.moves_with(other) for other in apart):
                apart.append(sight)
        return len(apart)

    @cached_property
    def at_goal(self) -> FeatureState:
        """Features at the goal, with J at the configuration of the goal."""
        s = _stack_features([part.measure_goal(view) for part, view in self._goal_views])
        projections, columns = self._goal_projections, self.columns
        pairs = self.goal_views.sights
        J = {t.key: t.jacobian(projections[t.key], t.moves(columns)) for t in pairs}
        if isinstance(self.which, np.ndarray):
            each: list[Array] = []  # unused: all cameras move as one
            L = np.repeat(self.which[..., None], s.shape[1], axis=-1)
        else:
            each = self.L_goals
            L = _stack_features(
                [_convert_to_first_camera(L, A) for L, A in zip(each, self.adjoints, strict=True)]
            )
        return FeatureState(s, L, J[self.sights[0].key], self._task_jacobian(L, each, J))

    @cached_property
    def tolerances(self) -> Array:
        """Tolerance (k,) of each component, from its feature."""
        each = [np.full(p.size, as_positive(p.feature.tolerance, "tolerance")) for p in self.parts]
        return np.concatenate(each)

    @cached_property
    def weights(self) -> Array:
        """Weight (k, 1) of each component, from its block."""
        return np.concatenate([np.full(p.size, p.weight) for p in self.parts])[:, None]

    @cached_property
    def L_goals(self) -> list[Array]:
        """Interaction matrix of each block at the goal."""
        return [part.interaction(view) for part, view in self._goal_views]

    def depends(self) -> list[NDArray[np.bool_] | None]:
        """Return the marks that each block depends on, as `BoundBlock.depends`."""
        at_goal = self.pair_observations, self._goal_projections
        return [part.depends(part.all_at_goal(*at_goal)) for part in self.parts]

    def find_dependencies(self) -> list[tuple[BoundBlock, NDArray[np.bool_]]]:
        """Return each block with the marks that its components depend on at the goal.

        A goal of numbers has no image; a view from in front of the target then replaces it.
        Raises InputError if a feature has no value there.
        """
        observations = self.pair_observations
        if self.goal_values is not None:
            observations = {sight.key: sight.observe_from_front() for sight in self.sights}
        result = []
        for part in self.parts:
            marks = part.find_dependencies(part.all_at_goal(observations, self._goal_projections))
            if marks is None:
                raise InputError(f"{part.name} has no value at the goal, so no marks to weigh")
            result.append((part, marks))
        return result

    @property
    def _goal_views(self) -> Iterable[tuple[BoundBlock, Observation]]:
        """Each block with its observation at the goal."""
        return zip(self.parts, self._goal_observations, strict=True)

    @cached_property
    def _goal_observations(self) -> list[Observation]:
        """Observation of each block at the goal."""
        return [part.at_goal(self.pair_observations, self._goal_projections) for part in self.parts]

    @cached_property
    def pair_observations(self) -> dict[PairKey, Observation]:
        """Observation of each camera-target pair at the goal, with the chosen depth."""
        return {key: self._with_chosen_depth(key, goal) for key, goal in self.goals.items()}

    def _with_chosen_depth(self, key: PairKey, goal: Observation) -> Observation:
        """Return the observation at the goal with the chosen depth, and the plane of pictures."""
        depth = self.depths.at_goal(goal.depth_last)
        changed = replace_unchecked(goal, depth_last=make_read_only(depth))
        if key not in self.pictured_pairs:
            return changed
        plane = make_read_only(fit_inverse_depth(goal.points_last, depth))
        return replace_unchecked(changed, plane_last=plane)

    @property
    def pictured_pairs(self) -> frozenset[PairKey]:
        """Camera-target pairs with a feature of whole pictures."""
        return frozenset(part.sights[0].key for part in self.parts if part.uses_pictures)

    @property
    def marked_sights(self) -> tuple[CameraTarget, ...]:
        """Camera-target pairs with a feature of marks."""
        keys = {s.key for part in self.parts if not part.uses_pictures for s in part.sights}
        return tuple(sight for sight in self.sights if sight.key in keys)

    def draw_pictures(self, q: Array) -> dict[str, TakenPictures]:
        """Return the pictures at q (nq, B) of the cameras of features, in the believed scene."""
        runs = np.arange(q.shape[1])
        return {
            each.eye.name: TakenPictures(draw_pictures(each, q), runs)
            for each in self.sights
            if each.key in self.pictured_pairs
        }

    @cached_property
    def _goal_projections(self) -> dict[PairKey, Projection]:
        """Believed projections at the goal, in the scene in which it is shown."""
        return self._project_at_goal(self.goal_views.sights)

    def _project_at_goal(self, sights: Iterable[CameraTarget]) -> dict[PairKey, Projection]:
        """Return projections at the configuration of a shown goal, or at home for other goals."""
        q = self.goal_views.q_shown
        return {
            sight.key: sight.project(sight.home(self.runs) if q is None else q) for sight in sights
        }

    @cached_property
    def moves(self) -> dict[PairKey, BodyMoves]:
        """Motion of each camera relative to its target by the commanded velocities."""
        return {sight.key: sight.moves(self.columns) for sight in self.sights}

    @cached_property
    def own_moves(self) -> tuple[NDArray[np.int64], dict[PairKey, BodyMoves]]:
        """Prescribed velocities, and the motion of each camera relative to its target by them."""
        columns = make_read_only(np.flatnonzero(self.sights[0].scene.prescribed))
        return columns, {sight.key: sight.moves(columns) for sight in self.sights}

    @cached_property
    def adjoints(self) -> list[Array | None]:
        """Adjoint (6, 6, B) from the first camera's twist to the twist of each block's camera.

        None for a block of the first camera.
        """
        first = self.sights[0].key
        projections = self._goal_projections
        if self.has_moved_bodies:  # the law commands the cameras as they are mounted now
            projections = self._project_at_goal(self.sights)
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
    """Return L for the twist of the first camera, from L and the adjoint of its own camera."""
    if A is None:
        return L
    return multiply_batches(L, np.ascontiguousarray(np.broadcast_to(A, (6, 6, L.shape[2]))))


def _stack_features(arrays: Sequence[Array]) -> Array:
    """Return arrays stacked along the first axis."""
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)
