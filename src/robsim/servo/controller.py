"""A task bound to a scene: what it measures, and the velocities that it commands."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np

from robsim.arrays import Array, last_view
from robsim.errors import InputError
from robsim.features.feature import Feature, Observation
from robsim.servo.goal import GoalView
from robsim.servo.inverse import Inverse, product, rank
from robsim.servo.law import Law, State
from robsim.servo.sight import Look, Sight

Interaction = Literal["current", "desired", "mean"]
Depth = Literal["true", "goal"] | float


class Command(NamedTuple):
    """One instant of control, the run last."""

    s: Array  # (k, B)
    error: Array  # (k, B)
    qd: Array  # (n, B) of the commanded joints
    reach: Array  # (k, n, B) L J: how the commanded joints move the features


@dataclass(frozen=True)
class Controller:
    """Everything of a servo loop that does not change while it runs."""

    truth: Sight
    belief: Sight
    feature: Feature
    interaction: Interaction
    depth: Depth
    depth_scale: float
    law: Law
    gain: float
    inverse: Inverse
    tolerance: float
    goal: GoalView

    def control(self, q: Array, look: Look, pixels: Array) -> Command:
        """Command for coordinates q (nq, B), what there is, and pixels (N, 2, B) as measured."""
        believed = look if self.belief is self.truth else self.belief.look(q)
        seen = self._observe(pixels, look.depth)
        s = self._run_last(self.feature.measure(seen), seen, self.s_goal.shape)
        L, J = self._interaction(seen), self.belief.jacobian(believed)
        state = State(s - self._goal_column, L, J, product(L, J), self.gain, self.inverse)
        qd = self._run_last(self.law.command(state), seen, J.shape[1:2])
        return Command(s, state.error_last, qd, state.reach_last)

    @cached_property
    def s_goal(self) -> Array:
        """(k,)."""
        s = np.asarray(self.feature.measure(self._at_goal), dtype=np.float64)
        if s.ndim != 2 or s.shape[0] != 1 or not s.size or not np.isfinite(s).all():
            raise InputError(
                f"{type(self.feature).__name__}.measure at the goal must return finite numbers of "
                f"shape (1, k), got {s!r:.80} of shape {s.shape}"
            )
        goal: Array = s[0]
        return goal

    @cached_property
    def _goal_column(self) -> Array:
        return self.s_goal[:, None]

    @cached_property
    def L_goal(self) -> Array:
        """(k, 6, 1)."""
        seen = self._at_goal
        return self._run_last(self.feature.interaction(seen), seen, (self.s_goal.size, 6))

    @cached_property
    def k(self) -> int:
        """How many features."""
        return self.s_goal.size

    @cached_property
    def full_rank(self) -> int:
        """Rank of L J at the goal where it was shown; else the most that its shape allows."""
        n = self.belief.columns.size
        if self.goal.q is None:
            return min(self.k, 6, n)
        J = self.belief.jacobian(self.belief.look(self.goal.q))
        return int(rank(product(self.L_goal, J))[0])

    @cached_property
    def _at_goal(self) -> Observation:
        return self._observe(self.goal.pixels, self.goal.depth)

    def _observe(self, pixels: Array, Z: Array) -> Observation:
        """What the controller makes of an image: its own intrinsics, its own idea of depth."""
        if self.depth == "goal":
            Z = np.repeat(self.goal.depth, pixels.shape[-1], axis=1)
        elif self.depth != "true":
            Z = np.full_like(Z, self.depth)
        if self.depth_scale != 1.0:
            Z = Z * self.depth_scale
        return Observation.of(pixels, Z, self.belief.eye.camera)

    def _interaction(self, seen: Observation) -> Array:
        """L (k, 6, B): now, at the goal, or the mean of both."""
        if self.interaction == "desired":
            return np.repeat(self.L_goal, seen.pixels_last.shape[-1], axis=2)
        L = self._run_last(self.feature.interaction(seen), seen, (self.k, 6))
        return L if self.interaction == "current" else 0.5 * (L + self.L_goal)

    def _run_last(self, value: Any, seen: Observation, shape: tuple[int, ...]) -> Array:
        """What a feature or law returned, in the kernels' layout; its shape must be right."""
        array = np.asarray(value, dtype=np.float64)
        wanted = (seen.pixels_last.shape[-1], *shape)
        if array.shape != wanted:
            raise InputError(
                f"{type(self.feature).__name__} or {type(self.law).__name__}: a method returned "
                f"shape {array.shape} where {wanted} is needed; see robsim.testing"
            )
        return np.ascontiguousarray(last_view(array))
