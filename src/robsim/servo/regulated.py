"""What a task regulates, bound to a scene: s, its goal, and how the joints move it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, frozen, last_view, positive, runs_last
from robsim.base.errors import GoalError, InputError
from robsim.features import Feature, Observation
from robsim.features.numeric import interaction
from robsim.kernels import features as kernels
from robsim.kernels.jacobian import Moves
from robsim.kernels.sight import Look
from robsim.servo.goals.goal import GoalView
from robsim.servo.instant import Instant
from robsim.servo.laws.depths import Depths
from robsim.servo.laws.interaction import Interaction
from robsim.servo.laws.inverse import product
from robsim.servo.returned import returned
from robsim.servo.sight import Key, Sight, relative


@dataclass(frozen=True, eq=False)
class Bound:
    """A part in a scene: its feature, measured by one camera or a pair."""

    feature: Feature
    sights: tuple[Sight, ...]  # as believed
    marks: NDArray[np.int64] | None
    components: NDArray[np.int64] | None
    weight: float
    k: int | None = None  # how many numbers its feature gives, once that is known

    @property
    def name(self) -> str:
        """Of the feature's class."""
        return type(self.feature).__name__

    def towards(self, goal: Observation) -> Bound:
        """The same, measured relative to what is seen at the goal, where the feature can."""
        towards = getattr(self.feature, "towards", None)
        if towards is None:
            return self
        feature = towards(goal)
        if not isinstance(feature, Feature):
            raise InputError(f"{self.name}.towards returned {feature!r:.80}, and no feature")
        return replace(self, feature=feature)

    def counted(self, goal: Observation) -> Bound:
        """The same, with the size that s has at the goal and must keep."""
        whole = replace(self, components=None)
        return replace(self, k=len(whole.measure(goal)))

    def observation(self, seen: dict[Key, Observation], looks: dict[Key, Look]) -> Observation:
        """What the feature is shown, where things stand as believed."""
        first, *others = (sight.key for sight in self.sights)
        one = seen[first]
        for second in others:  # at most one
            between = relative(looks[first].T_w_c, looks[second].T_w_c)
            one = replace(one, other=seen[second], between_last=between)
        return one if self.marks is None else one.some(self.marks)

    @property
    def size(self) -> int:
        """How many numbers are chosen."""
        return len(self.components) if self.components is not None else self.k or 0

    def measure(self, seen: Observation) -> Array:
        """S (k, B) of the chosen components."""
        return self._checked(self.feature.measure(seen), seen)

    def interaction(self, seen: Observation) -> Array:
        """L (k, 6, B) of the chosen components, for the first camera's twist."""
        return self._checked(interaction(self.feature, seen), seen, 6)

    def lost(self, blind: Observation) -> NDArray[np.bool_]:
        """(k, B) what is NaN where marks are, if not all is."""
        try:
            gone = np.isnan(self.measure(blind))
        except np.linalg.LinAlgError:  # of a user's feature: LAPACK takes no NaN for any run
            return np.zeros((self.size, blind.pixels_last.shape[-1]), dtype=np.bool_)
        return np.asarray(gone & ~gone.all(axis=0))

    def _checked(self, value: Any, seen: Observation, *tail: int) -> Array:
        """The chosen components of what a method returned, the run last; shapes must be right."""
        k = "k" if self.k is None else self.k
        wanted = (seen.pixels_last.shape[-1], k, *tail)
        array = returned(value, f"{self.name}: a method", wanted)
        return np.array(self._chosen(last_view(array)), order="C")  # theirs may be used again

    def _chosen(self, array: Array) -> Array:
        if self.components is None:
            return array
        if self.components.max() >= len(array):
            raise InputError(
                f"{self.name} has {len(array)} components, numbered from 0; "
                f"there is no {self.components.max()}"
            )
        return array[self.components]


@dataclass(frozen=True, eq=False)
class Measured:
    """One instant of what is regulated, the run last."""

    s: Array  # (k, B)
    L: Array  # (k, 6, B) for the twist of the first camera, where all cameras move as one
    J: Array  # (6, n, B) of the first camera against its target
    reach: Array  # (k, n, B) L J
    twists: dict[Key, Array]  # J of every sight
    looks: dict[Key, Look]  # what is where, as believed
    each: list[Array]  # L (k, 6, B) of every part for its own camera; none if L is a constant
    hidden: NDArray[np.bool_] | None = None  # (k, B) what is not seen now, and left out


@dataclass(frozen=True, eq=False)
class Regulated:
    """All parts of a task with their goal, and the velocities that are commanded."""

    parts: tuple[Bound, ...]
    sights: tuple[Sight, ...]  # as believed, each once; the first is the reference
    exact: bool  # whether the belief is the truth
    columns: NDArray[np.int64]
    depths: Depths
    which: Interaction | Array  # or one constant L (k, 6)
    goals: dict[Key, GoalView]
    q_goal: Array | None  # (nq, 1) where it was shown
    given: Array | None  # (k,) features at the goal, where they are given as numbers

    def at_its_goal(self) -> Regulated:
        """The same, its features measured relative to the goal where it is seen and they can."""
        parts = zip(self.parts, self._goal_views, strict=True)
        bound = [part.towards(v) if self.given is None else part for part, v in parts]
        views = zip(bound, self._goal_views, strict=True)
        return replace(self, parts=tuple(part.counted(view) for part, view in views))

    def measured(self, now: Instant) -> Measured:
        """What the controller makes of an instant."""
        as_is = self.exact and now.prompt
        looks = now.looks if as_is else {s.key: s.look(now.q) for s in self.sights}
        seen = {}
        for sight in self.sights:
            key, look = sight.key, looks[sight.key]
            T_c_o = relative(look.T_w_c, look.T_w_o)
            seen[key] = _observed(sight, now.pixels[key], T_c_o)
            seen[key].depth_last = self.depths.of(seen[key], now, key, self.goals[key].depth)
        measured = self._measured(seen, looks)
        if now.hidden:
            return replace(measured, hidden=self._hidden(now, seen, looks))
        return measured

    def _hidden(
        self, now: Instant, seen: dict[Key, Observation], looks: dict[Key, Look]
    ) -> NDArray[np.bool_]:
        """(k, B): the numbers that depend on hidden marks, where others of their feature do not.

        These are found by hiding the marks: what becomes NaN depends on them.
        """
        blind = {}
        for sight in self.sights:
            key, hidden = sight.key, now.hidden[sight.key]
            pixels = np.where(hidden[:, None], np.nan, now.pixels[key])
            depth = np.where(hidden, np.nan, seen[key].depth_last)
            blind[key] = Observation.of(pixels, depth, sight.eye.camera)
            blind[key].model, blind[key].guess_last = seen[key].model, seen[key].guess_last
        views = [part.observation(blind, looks) for part in self.parts]
        return np.concatenate([p.lost(view) for p, view in zip(self.parts, views, strict=True)])

    def _measured(self, seen: dict[Key, Observation], looks: dict[Key, Look]) -> Measured:
        views = [part.observation(seen, looks) for part in self.parts]
        s = _stacked([part.measure(view) for part, view in zip(self.parts, views, strict=True)])
        J = {t.key: t.jacobian(looks[t.key], self._moves[t.key]) for t in self.sights}
        first = J[self.sights[0].key]
        if isinstance(self.which, np.ndarray):
            each: list[Array] = []  # all cameras move as one
            L = np.repeat(self.which[..., None], s.shape[1], axis=-1)
        else:
            each = [self._interaction(i, view) for i, view in enumerate(views)]
            L = _stacked([_to_first(L, A) for L, A in zip(each, self._adjoints, strict=True)])
        return Measured(s, L, first, self._reach(L, each, J), J, looks, each)

    def _reach(self, L: Array, each: list[Array], J: dict[Key, Array]) -> Array:
        """L J (k, n, B): sdot = L (J_c - J_o) qdot, camera by camera where they move apart."""
        if self.as_one:
            return product(L, J[self.sights[0].key])
        rows = zip(each, self.parts, strict=True)
        return _stacked([product(L_part, J[part.sights[0].key]) for L_part, part in rows])

    def drift(self, now: Instant, measured: Measured) -> Array:
        """(k, B) sdot by what moves on its own, as far as the controller knows of it."""
        return self._reach(measured.L, measured.each, self.twists(now, measured))[:, 0]

    def twists(self, now: Instant, measured: Measured) -> dict[Key, Array]:
        """(6, 1, B) of every camera against its target, by what moves on its own."""
        columns, moves = self._own_moves
        rates = np.empty((columns.size, 1, now.runs))
        rates[:] = self.sights[0].scene.drift(now.time)[columns, None, None]
        J = {s.key: s.jacobian(measured.looks[s.key], moves[s.key]) for s in self.sights}
        return {key: product(each, rates) for key, each in J.items()}

    def _interaction(self, i: int, view: Observation) -> Array:
        """L (k, 6, B) of one part: now, at the goal, or the mean of both."""
        L = self.parts[i].interaction(view)
        if isinstance(self.which, str) and self.which != "current":
            kernels.choose_interaction(self.code, self._L_goals[i], L)
        return L

    @property
    def code(self) -> int:
        """Which interaction matrix, for the kernels."""
        return get_args(Interaction).index(self.which)

    @cached_property
    def as_one(self) -> bool:
        """Whether all cameras move as one against all targets: one twist moves everything."""
        return all(sight.moves_with(self.sights[0]) for sight in self.sights)

    @cached_property
    def s_goal(self) -> Array:
        """(k, 1)."""
        s = self.at_goal.s
        if self.given is not None:
            if self.given.shape != (len(s),):
                raise GoalError(
                    f"goal s: expected {len(s)} numbers for {self.names}, got {self.given.size}"
                )
            return self.given[:, None].copy()  # writeable, as s is: kernels are compiled for it
        if not s.size or not np.isfinite(s).all():
            raise GoalError(
                f"{self.names}: s at the goal must be finite, got {s[:, 0]!r:.80}{self.reasons}"
            )
        return s

    @property
    def names(self) -> str:
        """Of the features."""
        return ", ".join(part.name for part in self.parts)

    @property
    def reasons(self) -> str:
        """Why features can have no finite value at a goal, as the features say."""
        said = [getattr(part.feature, "singular", None) for part in self.parts]
        return "".join(f"; {reason}" for reason in dict.fromkeys(said) if reason)

    @property
    def k(self) -> int:
        """How many features."""
        return sum(part.size for part in self.parts)

    @property
    def units(self) -> tuple[str, ...]:
        """(k,)."""
        return tuple(part.feature.unit for part in self.parts for _ in range(part.size))

    @property
    def goal_pixels(self) -> Array:
        """(N, 2) of all sights."""
        pixels = np.concatenate([self.goals[sight.key].pixels for sight in self.sights])[..., 0]
        return pixels if self.given is None else np.full(pixels.shape, np.nan)

    @property
    def motions(self) -> int:
        """How many motions of a camera against a target are different from one another."""
        apart: list[Sight] = []
        for sight in self.sights:
            if not any(sight.moves_with(other) for other in apart):
                apart.append(sight)
        return len(apart)

    @property
    def L_goal(self) -> Array:
        """(k, 6, 1) of the only part."""
        return self._L_goals[0]

    @cached_property
    def at_goal(self) -> Measured:
        """What is measured there, one run; J of the joints where the goal was shown."""
        return self._measured(self._goal_seen, self._goal_looks)

    @cached_property
    def tolerances(self) -> Array:
        """(k,): the feature's own for each component."""
        each = [np.full(p.size, positive(p.feature.tolerance, "tolerance")) for p in self.parts]
        return np.concatenate(each)

    @cached_property
    def weights(self) -> Array:
        """(k, 1)."""
        return np.concatenate([np.full(p.size, p.weight) for p in self.parts])[:, None]

    @cached_property
    def _L_goals(self) -> list[Array]:
        views = zip(self.parts, self._goal_views, strict=True)
        return [part.interaction(view) for part, view in views]

    @cached_property
    def _goal_views(self) -> list[Observation]:
        """What the feature of each part is shown at the goal, one run."""
        return [part.observation(self._goal_seen, self._goal_looks) for part in self.parts]

    @cached_property
    def _goal_seen(self) -> dict[Key, Observation]:
        seen = {}
        for sight in self.sights:
            goal = self.goals[sight.key]
            seen[sight.key] = _observed(sight, goal.pixels, goal.T_c_o)
            seen[sight.key].depth_last = self.depths.at_goal(goal.depth)
        return seen

    @cached_property
    def _goal_looks(self) -> dict[Key, Look]:
        """What is where, as believed, where the goal was shown; at home where it was computed."""
        q = self.q_goal
        return {
            sight.key: sight.look(runs_last(sight.scene.home, 1) if q is None else q)
            for sight in self.sights
        }

    @cached_property
    def _moves(self) -> dict[Key, Moves]:
        return {sight.key: sight.moves(self.columns) for sight in self.sights}

    @cached_property
    def _own_moves(self) -> tuple[NDArray[np.int64], dict[Key, Moves]]:
        """The velocities that nobody commands, and how they move each camera and target."""
        columns = frozen(np.flatnonzero(self.sights[0].scene.prescribed))
        return columns, {sight.key: sight.moves(columns) for sight in self.sights}

    @cached_property
    def _adjoints(self) -> list[Array | None]:
        """Of each part (6, 6): its camera's twist from that of the first; None where it is it."""
        first = self.sights[0].key
        looks = self._goal_looks
        return [
            None
            if part.sights[0].key == first
            else adjoint(relative(looks[part.sights[0].key].T_w_c, looks[first].T_w_c))
            for part in self.parts
        ]


def adjoint(T_a_b: Array) -> Array:
    """A (6, 6) with V_a = A V_b for one body's twist, from T_a_b (3, 4, 1).

    v_a = R v_b + p x (R omega_b), omega_a = R omega_b.
    """
    R, (x, y, z) = T_a_b[:, :3, 0], T_a_b[:, 3, 0]
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.block([[R, cross @ R], [np.zeros((3, 3)), R]])


def _to_first(L: Array, A: Array | None) -> Array:
    if A is None:
        return L
    return product(L, np.ascontiguousarray(np.broadcast_to(A[..., None], (6, 6, L.shape[2]))))


def _observed(sight: Sight, pixels: Array, T_c_o: Array) -> Observation:
    """What the controller makes of an image, with its own intrinsics; the depth is to be set."""
    seen = Observation.of(pixels, np.empty(0), sight.eye.camera)
    seen.model, seen.guess_last = sight.target.marks, T_c_o
    return seen


def _stacked(arrays: Sequence[Array]) -> Array:
    return arrays[0] if len(arrays) == 1 else np.concatenate(arrays)
