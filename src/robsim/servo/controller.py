"""A task bound to a scene: what it measures, and the velocities that it commands."""

from __future__ import annotations

from abc import ABC, abstractmethod
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, last_view, length
from robsim.base.errors import InputError
from robsim.features import PixelPoints, Points
from robsim.kernels import features as kernels
from robsim.kernels.loop import CAMERA, JOINT, Command, Scheme
from robsim.servo.instant import Instant, recall, remember
from robsim.servo.laws.broyden import Broyden, broyden_update
from robsim.servo.laws.feed_forward import EstimatedMotion, FeedForward, KnownMotion
from robsim.servo.laws.gain import AdaptiveGain
from robsim.servo.laws.inverse import RCOND, Inverse, JacobianTranspose, rank
from robsim.servo.laws.law import CameraLaw, ControlState, JointLaw, Law
from robsim.servo.regulated import Measured, Regulated
from robsim.servo.returned import returned
from robsim.servo.shaping.shaping import Shaping
from robsim.servo.sight import Sight
from robsim.world.scene import Scene


class Decision(NamedTuple):
    """What a controller makes of an instant; `basis` is for its own `note`."""

    command: Command
    J: Array  # (6, n, B) of its frame: of a camera in its own axes, of another in the world's
    basis: Any


class Assessment(NamedTuple):
    """What a servo task makes of an instant before its law is asked."""

    measured: Measured
    error: Array  # (k, B)
    reach: Array  # (k, n, B) as modelled or learnt
    state: ControlState


@dataclass(frozen=True, eq=False)
class Controller(ABC):
    """Everything of a control loop that does not change while it runs."""

    scene: Scene  # the true one
    frame: str  # whose motion is recorded: its first camera, or what it moves where it has none
    sights: tuple[Sight, ...]  # cameras and targets as they are
    columns: NDArray[np.int64]  # the velocities that are commanded
    s_goal: Array  # (k, 1)
    units: tuple[str, ...]  # (k,)
    tolerances: Array  # (k,)
    goal_pixels: Array  # (N, 2) of all sights, NaN where no image is known
    pace: float  # the slowest rate at which the error is to decay, per second
    full_rank: int  # of L J where nothing is singular
    rcond: float

    @abstractmethod
    def decide(self, now: Instant) -> Decision:
        """What to do now."""

    @abstractmethod
    def note(self, now: Instant, basis: Any, qd: Array) -> None:
        """Remember that the velocities qd (n, B) were commanded in the end."""

    def busy(self, now: Instant) -> NDArray[np.bool_]:
        """(B,): which runs follow a plan that is not over, and are not judged by their error yet.

        It is asked after the decision at the same instant.
        """
        return np.zeros(now.runs, dtype=np.bool_)

    def control(self, now: Instant) -> Command:
        """The command at an instant; error and reach in units of one tolerance for all."""
        return self.decided(now).command

    def decided(self, now: Instant) -> Decision:
        """That command with what it is based on."""
        decision = self.decide(now)
        command = decision.command
        self.note(now, decision.basis, command.qd)
        if self._scale is None:
            return decision
        error, reach = command.error * self._scale, command.reach * self._scale[:, None]
        return decision._replace(command=command._replace(error=error, reach=reach))

    @property
    def k(self) -> int:
        """How many features."""
        return len(self.s_goal)

    @cached_property
    def moving(self) -> str:
        """The frame whose way is measured: the recorded one, or the target of a standing camera."""
        stands = self.sights and not self.sights[0].constants.moves
        return self.sights[0].target.name if stands else self.frame

    @property
    def tolerance(self) -> float:
        """That of the first feature, to which the others are scaled."""
        return float(self.tolerances[0])

    @property
    def compiled(self) -> Scheme | None:
        """The scheme for the compiled loop, if it can run this."""
        return None

    @cached_property
    def _scale(self) -> Array | None:
        scale = self.tolerance / self.tolerances
        return None if (scale == 1.0).all() else scale[:, None]


@dataclass(frozen=True, eq=False)
class Servo(Controller):
    """The controller of one task: it drives e = s - s_goal to zero by a law."""

    regulated: Regulated
    law: Law
    gain: float | AdaptiveGain
    inverse: Inverse
    feed_forward: FeedForward
    broyden: Broyden | None
    shaping: Shaping

    def assess(self, now: Instant) -> Assessment:
        """Features, error, and what the law is to be told."""
        measured = self.regulated.measured(now)
        error = np.empty(measured.s.shape)
        kernels.difference(measured.s, self.s_goal, error)
        reach = measured.reach if self.broyden is None else self._learnt(now, measured)
        if measured.hidden is not None:
            measured, error, reach = _left_out(measured, error, reach)
        return Assessment(measured, error, reach, self._state(now, measured, error, reach))

    def decide(self, now: Instant) -> Decision:
        """Assessment, law, shaping."""
        basis = self.assess(now)
        measured, error, reach, state = basis
        qd = self._commanded(state)
        if not self.shaping.idle:
            qd = self.shaping.shaped(now, qd, reach, error, measured.J)
        return Decision(Command(measured.s, error, qd, reach), measured.J, basis)

    def note(self, now: Instant, basis: Assessment, qd: Array) -> None:
        """What depth filter, feed-forward and Broyden need at the next instant."""
        measured, known = basis.measured, isinstance(self.feed_forward, KnownMotion)
        if self.regulated.depths.filtered:
            own = self.regulated.twists(now, measured) if known else {}
            for key, J in measured.twists.items():
                self.regulated.depths.note(now, key, J, qd, own.get(key))
        if isinstance(self.feed_forward, EstimatedMotion):
            self.feed_forward.note(now, basis.state.reach_last, qd)
        if self.broyden is not None:
            drift = self.regulated.drift(now, measured) if known else 0.0
            remember(now.memory, "reach", basis.reach)
            remember(now.memory, "s", measured.s + now.dt * drift)  # what the joints do not cause
            remember(now.memory, "qd", qd)

    def _state(self, now: Instant, measured: Measured, error: Array, reach: Array) -> ControlState:
        """What the law is given: weighted, and with the motion of the target in the error."""
        L, weighted = measured.L, error
        if self._is_weighted:
            weighted, L = self._weights * error, self._weights[:, None] * L
            reach = self._weights[:, None] * reach
        memory = now.memory.setdefault("law", {})
        given = (weighted, L, measured.J, reach, 1.0, self.inverse, measured.s)
        state = ControlState(*given, now.q, now.time, now.dt, memory)
        gain = state.gain = self._gain(error, state)
        drift = self._drift(now, measured, weighted)
        if drift is not None and measured.hidden is not None:
            drift = np.where(measured.hidden, 0.0, drift)
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

    def _drift(self, now: Instant, measured: Measured, error: Array) -> Array | None:
        """(k, B) de/dt of what moves on its own, weighted."""
        if isinstance(self.feed_forward, EstimatedMotion):
            return self.feed_forward.of(now, error)
        if isinstance(self.feed_forward, KnownMotion):
            return self._weights * self.regulated.drift(now, measured)
        return None

    def _learnt(self, now: Instant, measured: Measured) -> Array:
        """L J (k, n, B) by Broyden's rule."""
        assert self.broyden is not None
        if "reach" in now.memory:
            A, without, qd = (recall(now.memory, name) for name in ("reach", "s", "qd"))
            return broyden_update(A, measured.s - without, qd * now.dt)
        if self.broyden.start is None:
            return measured.reach
        wide = np.broadcast_to(self.broyden.start[..., None], measured.reach.shape)
        return np.ascontiguousarray(wide)

    def _commanded(self, state: ControlState) -> Array:
        """(n, B) from the law, which may be the user's."""
        wanted = (state.error_last.shape[1], self.columns.size)
        who = f"{type(self.law).__name__}.command"
        qd = returned(self.law.command(state), who, wanted)
        return np.array(last_view(qd), order="C")  # theirs may be used again

    @cached_property
    def _weights(self) -> Array:
        return self.regulated.weights

    @cached_property
    def _is_weighted(self) -> bool:
        return bool((self._weights != 1.0).any())

    @property
    def compiled(self) -> Scheme | None:
        """The scheme, if all its parts are built in and belief is truth."""
        kinds, laws = {Points: False, PixelPoints: True}, {JointLaw: JOINT, CameraLaw: CAMERA}
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
            self.regulated.goals[self.sights[0].key].depth,
            self.s_goal,
            self.regulated.L_goal,
            law,
            self.law.length if isinstance(self.law, CameraLaw) else 1.0,
            self.gain,
            self.pace,
            *self.inverse.numbers,
            self.tolerance,
        )


def _left_out(measured: Measured, error: Array, reach: Array) -> tuple[Measured, Array, Array]:
    """What is hidden has no error, and nothing moves it."""
    hidden = measured.hidden
    assert hidden is not None
    L, reach = (np.where(hidden[:, None], 0.0, array) for array in (measured.L, reach))
    return replace(measured, L=L), np.where(hidden, 0.0, error), reach


def pace(regulated: Regulated, gain: float | AdaptiveGain, inverse: Inverse) -> float:
    """The smallest gain; with the transpose, times the smallest sigma^2 of L J at the goal."""
    least = gain if isinstance(gain, float) else gain.least
    if not isinstance(inverse, JacobianTranspose):
        return least
    reach = regulated.at_goal.reach[..., 0]
    if not reach.any() or not np.isfinite(reach).all():
        raise InputError(
            "the transpose needs L J at the goal, and there it is zero or not finite (of a goal "
            "given as numbers, at home): use another inverse"
        )
    sigma = np.linalg.svd(reach, compute_uv=False)
    return least * float(sigma[sigma > RCOND * sigma[0]].min() ** 2)


def rank_at_goal(regulated: Regulated) -> int:
    """Rank of L J at the goal where it was shown; else the most that its shape allows."""
    goal = regulated.at_goal
    if regulated.q_goal is None:
        return int(min(*goal.reach.shape[:2], 6 * regulated.motions))
    return int(rank(goal.reach)[0])


def rcond_of(inverse: Inverse) -> float:
    """What counts as a lost rank."""
    return inverse.numbers[2] or RCOND
