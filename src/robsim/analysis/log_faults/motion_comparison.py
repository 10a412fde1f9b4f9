"""Hypotheses on the response of joints to commands, or of commands to images."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from robsim.analysis.explanation.text_format import format_number
from robsim.analysis.log_faults.hypothesis import Hypothesis
from robsim.analysis.log_faults.value_text import format_interval
from robsim.base.arrays import Array

LEAST_CHANGE = 0.03  # least change of a velocity, as a share, that is reported
SHORTEST_LAG = 1e-9  # seconds
LONGEST = 25  # longest first value of a delay or a lag, in periods
NEAR_WHOLE = 0.1  # distance of a factor from 0 or -1 below which the joint stands or is reversed


@dataclass(frozen=True)
class ResponseWords:
    """The kinds of faults of a response, and the words of its sentences."""

    factor: str  # kinds of faults
    delay: str
    lag: str
    swap: str
    every: str  # "the joints move with"
    single: str  # "the joint '{}' moves with"
    cause: str  # "the commanded velocities"


DRIVE_WORDS = ResponseWords(
    *("drive factor", "command delay", "drive lag", "swapped drives"),
    *("the joints move with", "the joint '{}' moves with", "the commanded velocities"),
)
COMMAND_WORDS = ResponseWords(
    *("command factor", "late commands", "command lag", "swapped commands"),
    *("the recorded commands are", "the recorded command of '{}' is"),
    "the commands of this controller for the same images and joints",
)


@dataclass(frozen=True, eq=False)
class HeldSignal:
    """A signal (T, n) that is held from each of its times (T,) to the next."""

    times: Array
    values: Array

    @cached_property
    def integral(self) -> Array:
        """The integral (T, n) from the first time to each time."""
        steps = np.diff(self.times)[:, None] * self.values[:-1]
        return np.concatenate([np.zeros((1, self.values.shape[1])), np.cumsum(steps, axis=0)])

    def integrate_until(self, times: Array, lag: Array) -> Array:
        """Return the integral (m, n) until some times of the signal after first-order lags (n,).

        With lag v' = u - v, the integral of v is the integral of u minus lag v.
        """
        inside = np.clip(times, self.times[0], None)
        at = np.clip(np.searchsorted(self.times, inside, side="right") - 1, 0, None)
        rest = (inside - self.times[at])[:, None]
        area = self.integral[at] + rest * self.values[at]
        if (lag > 0.0).any():
            tau = np.maximum(lag, SHORTEST_LAG)
            v, u = self._follow(tau)[at], self.values[at]
            area -= lag * (u + (v - u) * np.exp(-rest / tau))
        return np.asarray(area)

    def _follow(self, lag: Array) -> Array:
        """Return the signal (T, n) after first-order lags (n,), at rest before the first time.

        The recursion v[k + 1] = a v[k] + (1 - a) u[k] is evaluated by doubling: two maps of k
        steps are one map of 2 k steps.
        """
        a = np.exp(-np.diff(self.times)[:, None] / lag)
        v, step = (1.0 - a) * self.values[:-1], 1
        while step < len(v):
            v[step:] += a[step:] * v[:-step].copy()
            a[step:] *= a[:-step].copy()
            step *= 2
        return np.concatenate([np.zeros((1, v.shape[1])), v])

    def interpolate_at(self, times: Array) -> Array:
        """Return the values (m, n) at some times, linear between two values."""
        return np.stack([np.interp(times, self.times, each) for each in self.values.T], axis=1)


@dataclass(frozen=True, eq=False)
class ResponseComparison:
    """Commands (T, n) and a response (T, n) to them, and the hypotheses on their difference.

    The response is F u(t - delay) after a first-order lag, with a factor F for each joint. `lag`
    (n,) is declared in the experiment.
    """

    cause: HeldSignal
    observed: Array  # (m, n)
    respond: Callable[[Array, Array, Array], Array]  # from factors, delays and lags (n,) to (m, n)
    names: Sequence[str]
    units: Sequence[str]
    words: ResponseWords
    dt: float
    lag: Array

    @property
    def healthy(self) -> Hypothesis:
        """The hypothesis without a fault."""
        return Hypothesis("no fault", "", lambda values: self._respond(), lambda *_: "no fault")

    def list_hypotheses(self) -> Iterator[Hypothesis]:
        """Yield the healthy hypothesis and all faults."""
        every, words = np.ones(len(self.names)), self.words
        yield self.healthy
        yield self._make(words.factor, "", every, "factor")
        yield self._make(words.delay, "", every, "delay_s")
        yield self._make(words.lag, "", every, "lag_s")
        yield self._make(words.delay, "", every, "factor", "delay_s")
        yield self._make(words.lag, "", every, "factor", "lag_s")
        yield self._make(words.lag, "", every, "delay_s", "lag_s")
        for i, name in enumerate(self.names):
            yield self._make(words.factor, name, every * (np.arange(len(every)) == i), "factor")
            yield self._make(words.lag, name, every * (np.arange(len(every)) == i), "lag_s")
        for i, j in combinations(range(len(self.names)), 2):
            if self.units[i] == self.units[j]:
                yield self._make_swap(i, j)

    def _respond(
        self, factor: Array | float = 1.0, delay: float = 0.0, lag: Array | float = 0.0
    ) -> Array:
        ones = np.ones(len(self.names))
        return self.respond(factor * ones, delay * ones, np.maximum(self.lag + lag, 0.0))

    def _make(self, about: str, part: str, mask: Array, *numbers: str) -> Hypothesis:
        """Return the hypothesis of a factor, delay or lag of the joints in a mask (n,)."""

        def unpack(values: Array) -> dict[str, float]:
            return {
                "factor": 1.0,
                "delay_s": 0.0,
                "lag_s": 0.0,
                **dict(zip(numbers, values.tolist(), strict=True)),
            }

        def predict(values: Array) -> Array:
            n = unpack(values)
            return self._respond(1.0 + (n["factor"] - 1.0) * mask, n["delay_s"], n["lag_s"] * mask)

        def size(values: Array) -> float:
            n = unpack(values)
            return max(
                abs(n["factor"] - 1.0) / LEAST_CHANGE,
                abs(n["delay_s"]) / self.dt,
                abs(n["lag_s"]) / self.dt,
            )

        def describe(values: Array, half: Array) -> str:
            return self._describe(
                part, unpack(values), dict(zip(numbers, half.tolist(), strict=True))
            )

        grids = {
            "factor": [1.0] if len(numbers) > 1 else [1.0, 0.0, -1.0],
            "delay_s": [k * self.dt for k in range(LONGEST + 1)],
            "lag_s": [k * self.dt for k in (0.5, 1, 2, 4, 8, 16, 25)],
        }
        if len(numbers) > 1:
            grids = {name: each[:: 1 + len(each) // 6] for name, each in grids.items()}
        starts = (
            np.array(np.meshgrid(*(grids[each] for each in numbers))).reshape(len(numbers), -1).T
        )
        pair = len(numbers) > 1
        return Hypothesis(
            about, part, predict, describe, numbers, starts.tolist(), size, is_pair=pair
        )

    def _describe(self, part: str, n: dict[str, float], half: dict[str, float]) -> str:
        """Return the clause on a factor, a delay and a lag."""
        subject = self.words.single.format(part) if part else self.words.every
        factor = n["factor"]
        times = f"{format_interval(factor, half['factor'])} times " if "factor" in half else ""
        clause = f"{subject} {times}{self.words.cause}"
        if abs(n["delay_s"]) > 0.0:
            periods = f"{format_number(n['delay_s'] / self.dt)} periods"
            clause += f", {format_interval(n['delay_s'], half['delay_s'], 's')} late ({periods})"
        if "lag_s" in half:
            clause += f", with a lag of {format_interval(n['lag_s'], half['lag_s'], 's')}"
        if abs(factor + 1.0) < NEAR_WHOLE:
            clause += ": reversed"
        return clause

    def _make_swap(self, i: int, j: int) -> Hypothesis:
        """Return the hypothesis that two joints are swapped."""
        order = np.arange(len(self.names))
        order[[i, j]] = j, i

        def predict(values: Array) -> Array:
            return self._respond()[:, order]

        names = f"'{self.names[i]}' and '{self.names[j]}'"
        text = f"{names} are swapped between {self.words.cause} and their response"

        def correct(values: Array, commands: Array) -> Array:
            return commands[:, order]

        return Hypothesis(self.words.swap, names, predict, lambda *_: text, cost=1, correct=correct)


def compare_motion(
    times: Array,
    q: Array,
    commands: HeldSignal,
    names: Sequence[str],
    units: Sequence[str],
    dt: float,
    lag: float,
    window: int,
    most: int = 500,
) -> ResponseComparison:
    """Return the comparison of joints q (T, n) at times (T,) with commanded velocities.

    The signals are mean velocities over windows of some periods on the clock of the log.
    """
    last = len(times) - 1
    window = min(window, last)
    ends = np.unique(np.linspace(window, last, min(last - window + 1, most)).astype(int))
    begin, end = times[ends - window], times[ends]
    span = (end - begin)[:, None]

    def respond(factor: Array, delay: Array, lags: Array) -> Array:
        late = delay[0]
        both = commands.integrate_until(np.concatenate([begin, end]) - late, lags)
        return np.asarray(factor * (both[len(begin) :] - both[: len(begin)]) / span)

    observed = (q[ends] - q[ends - window]) / span
    return ResponseComparison(
        commands, observed, respond, names, units, DRIVE_WORDS, dt, np.full(len(names), lag)
    )


def compare_commands(
    times: Array,
    computed: Array,
    recorded: Array,
    names: Sequence[str],
    units: Sequence[str],
    dt: float,
) -> ResponseComparison:
    """Return the comparison of recorded commands (T, n) with commands that were computed."""
    signal = HeldSignal(times, computed)

    def respond(factor: Array, delay: Array, lags: Array) -> Array:
        return np.asarray(factor * signal.interpolate_at(times - delay[0]))

    return ResponseComparison(
        signal, recorded, respond, names, units, COMMAND_WORDS, dt, np.zeros(len(names))
    )
