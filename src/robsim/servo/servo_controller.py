"""The controller of one servo task: features, error, law and shaping of the command."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array, last_view, length
from robsim.base.errors import InputError
from robsim.features import PixelPoints, Points
from robsim.kernels import features as kernels
from robsim.kernels.loop import CAMERA, JOINT, Command, Scheme
from robsim.servo.controller import Controller, Decision
from robsim.servo.feature_state import FeatureState
from robsim.servo.laws.broyden import Broyden, broyden_update
from robsim.servo.laws.feed_forward import EstimatedMotion, FeedForward, KnownMotion
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.laws.inverse import RCOND, Inverse, JacobianTranspose, rank
from robsim.servo.laws.law import CameraLaw, ControlState, JointLaw, Law
from robsim.servo.measurement import Measurement, recall, remember
from robsim.servo.regulated import Regulated
from robsim.servo.returned import returned
from robsim.servo.shaping.shaping import Shaping


class Basis(NamedTuple):
    """What the command of one servo task is based on: features, error and the state of the law."""

    features: FeatureState
    error: Array  # (k, B)
    state: ControlState  # which the law is given


@dataclass(frozen=True, eq=False)
class Servo(Controller):
    """The controller of one servo task, whose law drives e = s - s_goal to zero."""

    regulated: Regulated
    law: Law
    gain: float | AdaptiveGain
    inverse: Inverse
    feed_forward: FeedForward
    broyden: Broyden | None
    shaping: Shaping

    def assess(self, measurement: Measurement) -> Basis:
        """Return features, error, and the state that the law is given."""
        features = self.regulated.features(measurement)
        error = np.empty(features.s.shape)
        kernels.difference(features.s, self.s_goal, error)
        if self.broyden is not None:
            features = replace(features, task_jacobian=self._learnt(measurement, features))
        if features.hidden is not None:
            features, error = _without_hidden(features, error)
        return Basis(features, error, self._state(measurement, features, error))

    def decide(self, measurement: Measurement) -> Decision:
        """Return the command of the law, shaped, with what it is based on."""
        basis = self.assess(measurement)
        features, error, state = basis
        qd = self._commanded(state)
        if not self.shaping.idle:
            qd = self.shaping.shaped(measurement, qd, features.task_jacobian, error, features.J)
        return Decision(Command(features.s, error, qd, features.task_jacobian), features.J, basis)

    def note(self, measurement: Measurement, basis: Basis, qd: Array) -> None:
        """Remember what depth filter, feed-forward and Broyden need at the next instant."""
        features, memory = basis.features, measurement.memory
        known = isinstance(self.feed_forward, KnownMotion)
        if self.regulated.depths.filtered:
            own = self.regulated.twists(measurement, features) if known else {}
            for key, J in features.twists.items():
                self.regulated.depths.note(measurement, key, J, qd, own.get(key))
        if isinstance(self.feed_forward, EstimatedMotion):
            self.feed_forward.note(measurement, basis.state.task_jacobian_last, qd)
        if self.broyden is not None:
            drift = self.regulated.drift(measurement, features) if known else 0.0
            remember(memory, "task_jacobian", features.task_jacobian)
            remember(memory, "s", features.s + measurement.dt * drift)  # the joints add to that
            remember(memory, "qd", qd)

    def _state(
        self, measurement: Measurement, features: FeatureState, error: Array
    ) -> ControlState:
        """What the law is given: weighted, and with the motion of the target in the error."""
        L, task_jacobian, weighted = features.L, features.task_jacobian, error
        if self._is_weighted:
            weighted, L = self._weights * error, self._weights[:, None] * L
            task_jacobian = self._weights[:, None] * task_jacobian
        memory = measurement.memory.setdefault("law", {})
        given = (weighted, L, features.J, task_jacobian, 1.0, self.inverse, features.s)
        now = (measurement.q, measurement.time, measurement.dt, memory, self._one_motion)
        state = ControlState(*given, *now)
        gain = state.gain = self._gain(error, state)
        drift = self._drift(measurement, features, weighted)
        if drift is not None and features.hidden is not None:
            drift = np.where(features.hidden, 0.0, drift)
        if drift is not None:
            state.error_last = weighted + drift / (gain if isinstance(gain, float) else gain[:, 0])
        return state

    def _gain(self, error: Array, state: ControlState) -> Any:
        if isinstance(self.gain, float):
            return self.gain
        size = length(error) if self.gain.of == "error" else self._unit_speed(state)
        return self.gain.at(size)[:, None]

    def _unit_speed(self, state: ControlState) -> Array:
        """The largest joint velocity (B,) that the law commands at a gain of one."""
        asked = replace(state, memory=deepcopy(state.memory))  # the law will be asked again
        return np.asarray(np.abs(self._commanded(asked)).max(axis=0))

    def _drift(
        self, measurement: Measurement, features: FeatureState, error: Array
    ) -> Array | None:
        """Return the weighted de/dt (k, B) of what moves on its own; None without feed-forward."""
        if isinstance(self.feed_forward, EstimatedMotion):
            return self.feed_forward.of(measurement, error)
        if isinstance(self.feed_forward, KnownMotion):
            return self._weights * self.regulated.drift(measurement, features)
        return None

    def _learnt(self, measurement: Measurement, features: FeatureState) -> Array:
        """Return L J (k, n, B) as learnt by Broyden's rule."""
        assert self.broyden is not None
        if "task_jacobian" in measurement.memory:
            A, without, qd = (
                recall(measurement.memory, name) for name in ("task_jacobian", "s", "qd")
            )
            return broyden_update(A, features.s - without, qd * measurement.dt)
        if self.broyden.start is None:
            return features.task_jacobian
        wide = np.broadcast_to(self.broyden.start[..., None], features.task_jacobian.shape)
        return np.ascontiguousarray(wide)

    def _commanded(self, state: ControlState) -> Array:
        """Return velocities (n, B) from the law, which may be a user's."""
        wanted = (state.error_last.shape[1], self.columns.size)
        who = f"{type(self.law).__name__}.command"
        qd = returned(self.law.command(state), who, wanted)
        return np.array(last_view(qd), order="C")  # theirs may be used again

    @cached_property
    def _one_motion(self) -> bool:
        """Whether L J is the product of one L and one J, and not learnt."""
        return self.broyden is None and self.regulated.as_one

    @cached_property
    def _weights(self) -> Array:
        return self.regulated.weights

    @cached_property
    def _is_weighted(self) -> bool:
        return bool((self._weights != 1.0).any())

    @cached_property
    def compiled(self) -> Scheme | None:
        """The scheme for the compiled loop, if all is built in and the belief is the truth."""
        kinds: dict[type[Any], bool] = {Points: False, PixelPoints: True}
        laws: dict[type[Any], int] = {JointLaw: JOINT, CameraLaw: CAMERA}
        law, part = laws.get(type(self.law)), self.regulated.parts[0]
        whole = part.marks is None and part.components is None and part.weight == 1.0
        if not (
            law is not None
            and whole
            and len(self.regulated.parts) == 1
            and type(part.feature) in kinds
            and self.regulated.exact
            and isinstance(self.regulated.which, str)
            and isinstance(self.gain, float)
            and not self.regulated.depths.filtered
            and self.feed_forward is None
            and self.broyden is None
            and self.shaping.idle
        ):
            return None
        return Scheme(
            kinds[type(part.feature)],
            self.regulated.code,
            *self.regulated.depths.numbers(len(self.goal_pixels)),
            self.regulated.goals[self.sights[0].key].depth_last,
            self.s_goal,
            self.regulated.L_goal,
            law,
            self.law.length if isinstance(self.law, CameraLaw) else 1.0,
            self.gain,
            self.pace,
            *self.inverse.numbers,
            self.tolerance,
        )


def _without_hidden(features: FeatureState, error: Array) -> tuple[FeatureState, Array]:
    """Return features and error in which hidden components are zero, and so are their rows."""
    hidden = features.hidden
    assert hidden is not None
    L, task_jacobian = (
        np.where(hidden[:, None], 0.0, array) for array in (features.L, features.task_jacobian)
    )
    seen = replace(features, L=L, task_jacobian=task_jacobian)
    return seen, np.where(hidden, 0.0, error)


def pace(regulated: Regulated, gain: float | AdaptiveGain, inverse: Inverse) -> float:
    """Return the slowest rate at which the error decays: the smallest gain, per second.

    With the transpose that is times the smallest sigma^2 of L J at the goal.
    """
    least = gain if isinstance(gain, float) else gain.least
    if not isinstance(inverse, JacobianTranspose):
        return least
    task_jacobian = regulated.at_goal.task_jacobian[..., 0]
    if not task_jacobian.any() or not np.isfinite(task_jacobian).all():
        raise InputError(
            "the transpose needs L J at the goal, and there it is zero or not finite (of a goal "
            "given as numbers, at home): use another inverse"
        )
    sigma = np.linalg.svd(task_jacobian, compute_uv=False)
    return least * float(sigma[sigma > RCOND * sigma[0]].min() ** 2)


def rank_at_goal(regulated: Regulated) -> int:
    """Return the rank of L J at the goal where it was shown; else the most that is possible."""
    goal = regulated.at_goal
    if regulated.q_goal is None:
        return int(min(*goal.task_jacobian.shape[:2], 6 * regulated.motions))
    return int(rank(goal.task_jacobian)[0])


def rcond_of(inverse: Inverse) -> float:
    """Return the share of the largest singular value below which rank counts as lost."""
    return inverse.numbers[2] or RCOND
