"""A run in progress, and a run of a second scheme for comparison."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.engine.instant import Instant
from robsim.page.recording_builder import RecordingBuilder, RecordingInstants, find_task_belief
from robsim.plot.scene_motion import SceneMotion
from robsim.run.experiment import Experiment
from robsim.studio.control_values import build_changes
from robsim.studio.live_run import LiveRun

AHEAD = 2000  # steps that are simulated in advance to determine the size of the scene


class RunPair:
    """The run of an experiment, and the run of a second scheme if there is one.

    Both runs advance together, and have equally many instants.
    """

    def __init__(self, live: LiveRun, other: LiveRun | None = None) -> None:
        self.live, self.other = live, other
        if other is not None:
            count = min(len(live.instants), len(other.instants))
            for each in (live, other):
                del each.instants[:-count]

    @classmethod
    def of(cls, experiment: Experiment, second: Mapping[str, Any]) -> RunPair:
        """Return both runs at the start; the second scheme differs in `second` {name: value}."""
        return cls(
            LiveRun(experiment),
            LiveRun(build_second_experiment(experiment, second)) if second else None,
        )

    def continue_with(
        self, experiment: Experiment, second: Mapping[str, Any], q: Array | None = None
    ) -> RunPair:
        """Return runs of another experiment that continue these runs, or raise InputError.

        The first run continues from the coordinates q (nq,) if they are passed.
        """
        other = self.other and self.other.continue_with(build_second_experiment(experiment, second))
        return RunPair(self.live.continue_with(experiment, q), other)

    def start_again(self, experiment: Experiment, second: Mapping[str, Any]) -> RunPair:
        """Return runs of another experiment from its start, in place of runs at their start."""
        other = self.other and self.other.start_again(build_second_experiment(experiment, second))
        return RunPair(self.live.start_again(experiment), other)

    @property
    def idle(self) -> bool:
        """Whether neither run has more instants."""
        return self.live.idle and (self.other is None or self.other.idle)

    @property
    def end(self) -> Instant | None:
        """The instant that decided the outcome of the first run; None before."""
        return self.live.decision

    @property
    def end_of_second(self) -> Instant | None:
        """The instant that decided the outcome of the second run; None before, or without one."""
        return self.other.decision if self.other else None

    def step(self) -> None:
        """Advance both runs by one instant."""
        self.live.step()
        if self.other is not None:
            self.other.step()

    def forget(self, kept: int) -> None:
        """Delete all instants of both runs but the last ones."""
        for each in filter(None, (self.live, self.other)):
            each.forget(kept)

    def instants(self, start: int = 0) -> RecordingInstants:
        """Return the instants from number `start` on."""
        run, scene = self.live.variables(start), self.live.experiment.scene
        other = self.other
        second = (other.variables(start), other.experiment.scene) if other else None
        return RecordingInstants.of(run, scene, second, self.live.constraint_owners)

    def create_recording_builder(self, former: RecordingBuilder | None = None) -> RecordingBuilder:
        """Return the builder of recordings of both runs; `former` is the builder before a change.

        Without it, a simulation in advance determines the size of the shown scene.
        """
        experiment, second = self.live.experiment, None
        q = self._look_ahead(self.live, former)
        if self.other is not None:
            q, q_other = _pad_to_equal_length(q, self._look_ahead(self.other, former))
            second = SceneMotion.of(self.other.experiment.scene, q_other)
        motion = SceneMotion.of(experiment.scene, q, second)
        belief = find_task_belief(experiment)
        return RecordingBuilder(
            motion, self.live.template, belief, experiment.task, live=True, former=former
        )

    @staticmethod
    def _look_ahead(run: LiveRun, former: RecordingBuilder | None) -> Array:
        """Return the coordinates (T, nq) of a whole run, or of its start and the present."""
        if former is None:
            return _simulate_ahead(run.experiment)
        scene, start = run.experiment.scene, run.experiment.start
        first = scene.coordinates(scene.home if start is None else start, limits=False)
        return np.stack([np.atleast_2d(first)[0], run.now.q])


def build_second_experiment(experiment: Experiment, second: Mapping[str, Any]) -> Experiment:
    """Return the experiment of the second scheme, with the changes `second` of `Experiment.at`.

    Raise InputError if the experiment lacks a value that differs.
    """
    controls = {each.path: each for each in experiment.controls()}
    try:
        return experiment.at(build_changes(controls, second))
    except InputError as error:
        lacking = [name for name in second if name not in controls]
        if not lacking:
            raise
        names = ", ".join(lacking)
        raise InputError(
            f"the second scheme differs in {names}, which this experiment lacks: {error}"
        ) from None


def _simulate_ahead(experiment: Experiment) -> Array:
    """Return the future coordinates (T, nq) of an experiment."""
    seconds = min(experiment.duration, AHEAD * experiment.dt)
    q = experiment.run(duration=seconds, record="all")["q"].values
    return np.asarray(q[np.isfinite(q).all(axis=1)])


def _pad_to_equal_length(*each: Array) -> list[Array]:
    """Return arrays (T, n) with equal T; the last row of a shorter array is repeated."""
    most = max(map(len, each))
    return [np.concatenate([q, np.repeat(q[-1:], most - len(q), axis=0)]) for q in each]
