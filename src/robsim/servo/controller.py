"""A task bound to a scene: what it measures, and the velocities that it commands."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from robsim.arrays import Array, last_view
from robsim.errors import InputError
from robsim.features import Feature, Observation, PixelPoints, Points
from robsim.features.numeric import interaction
from robsim.kernels import features as kernels
from robsim.kernels.loop import CAMERA, JOINT, Command, Scheme
from robsim.kernels.sight import Look
from robsim.servo.goal import GoalView
from robsim.servo.inverse import Inverse, product, rank
from robsim.servo.law import CameraLaw, JointLaw, Law, State
from robsim.servo.sight import Sight

Interaction = Literal["current", "desired", "mean"]
Depth = Literal["true", "goal"] | float


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
        s = self._array(self.feature.measure(self._at_goal))
        if s.ndim != 2 or s.shape[0] != 1 or not s.size or not np.isfinite(s).all():
            raise InputError(
                f"{type(self.feature).__name__}.measure at the goal must return finite numbers of "
                f"shape (1, k), got {s!r:.80} of shape {s.shape}"
            )
        goal: Array = s[0]
        return goal

    @cached_property
    def _goal_column(self) -> Array:
        return np.ascontiguousarray(self.s_goal[:, None])

    @cached_property
    def L_goal(self) -> Array:
        """(k, 6, 1)."""
        seen = self._at_goal
        return self._run_last(interaction(self.feature, seen), seen, (self.s_goal.size, 6))

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
        depth = np.empty(Z.shape)
        kernels.choose_depth(*self._depth, self.goal.depth, Z, depth)
        return Observation.of(pixels, depth, self.belief.eye.camera)

    def _interaction(self, seen: Observation) -> Array:
        """L (k, 6, B): now, at the goal, or the mean of both."""
        L = self._run_last(interaction(self.feature, seen), seen, (self.k, 6))
        if self.interaction != "current":
            L = L.copy()  # it may be the user's own array
            kernels.choose_interaction(self._which, self.L_goal, L)
        return L

    @property
    def _which(self) -> int:
        return get_args(Interaction).index(self.interaction)  # the order of the kernels

    @property
    def _depth(self) -> tuple[int, float, float]:
        """(which, metres, scale) for the kernels."""
        if self.depth == "true":
            return kernels.TRUE, 0.0, self.depth_scale
        if self.depth == "goal":
            return kernels.GOAL, 0.0, self.depth_scale
        return kernels.CONSTANT, self.depth, self.depth_scale

    @cached_property
    def compiled(self) -> Scheme | None:
        """The scheme for the compiled loop, if all its parts are built in and belief is truth."""
        features = {Points: False, PixelPoints: True}
        laws = {JointLaw: JOINT, CameraLaw: CAMERA}
        law = laws.get(type(self.law))
        if type(self.feature) not in features or law is None or self.belief is not self.truth:
            return None
        length = self.law.length if isinstance(self.law, CameraLaw) else 1.0
        return Scheme(
            features[type(self.feature)],
            self._which,
            *self._depth,
            self.goal.depth,
            self._goal_column,
            self.L_goal,
            law,
            length,
            self.gain,
            *self.inverse.numbers,
            self.tolerance,
        )

    def _run_last(self, value: Any, seen: Observation, shape: tuple[int, ...]) -> Array:
        """What a feature or law returned, in the kernels' layout; its shape must be right."""
        array = self._array(value)
        wanted = (seen.pixels_last.shape[-1], *shape)
        if array.shape != wanted:
            raise InputError(
                f"{self._whose}: a method returned shape {array.shape} where {wanted} is needed; "
                "see robsim.testing"
            )
        return np.ascontiguousarray(last_view(array))

    def _array(self, value: Any) -> Array:
        try:
            return np.asarray(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise InputError(
                f"{self._whose}: a method returned {value!r:.80} where numbers are needed; "
                "see robsim.testing"
            ) from None

    @property
    def _whose(self) -> str:
        return f"{type(self.feature).__name__} or {type(self.law).__name__}"
