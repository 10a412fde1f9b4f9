"""A run that goes on, and beside it that of a second scheme."""

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
from robsim.studio.live_run import LiveRun

AHEAD = 2000  # steps that are looked ahead, to see what will move


class RunPair:
    """The run of an experiment, and that of a second one, instant by instant.

    Nothing of a pair is changed but that both take another step.
    """

    def __init__(self, live: LiveRun, other: LiveRun | None = None) -> None:
        self.live, self.other = live, other
        if other is not None:
            count = min(len(live.instants), len(other.instants))
            for each in (live, other):
                del each.instants[:-count]

    @classmethod
    def of(cls, experiment: Experiment, second: Mapping[str, Any]) -> RunPair:
        """Return both at the start; `second` is the value in which the second one differs."""
        return cls(
            LiveRun(experiment),
            LiveRun(build_second_experiment(experiment, second)) if second else None,
        )

    def changed(self, experiment: Experiment, second: Mapping[str, Any]) -> RunPair:
        """Return what goes on from here as runs of another experiment. InputError: it cannot."""
        other = self.other and self.other.changed(build_second_experiment(experiment, second))
        return RunPair(self.live.changed(experiment), other)

    @property
    def ended(self) -> bool:
        """Whether nothing more is to come of either."""
        return self.live.ended and (self.other is None or self.other.ended)

    @property
    def end(self) -> Instant | None:
        """The instant at which the first one ended, if it has."""
        return self.live.end

    @property
    def end_of_second(self) -> Instant | None:
        """The instant at which the second one ended, if there is one, and it has."""
        return self.other.end if self.other else None

    def step(self) -> None:
        """Let both take another step."""
        self.live.step()
        if self.other is not None:
            self.other.step()

    def forget(self) -> None:
        """Keep no instant but the last one."""
        for each in filter(None, (self.live, self.other)):
            each.forget()

    def instants(self, start: int = 0) -> RecordingInstants:
        """Return the instants from a number on."""
        table, scene = self.live.table(start), self.live.experiment.scene
        if self.other is None:
            return RecordingInstants.of(table, scene)
        return RecordingInstants.of(
            table, scene, (self.other.table(start), self.other.experiment.scene)
        )

    def filmed(self, depth: float | None = None) -> RecordingBuilder:
        """Return what is shown; what will move is found by a look ahead."""
        experiment, second = self.live.experiment, None
        q = _simulate_ahead(experiment)
        if self.other is not None:
            q, q_other = _pad_to_equal_length(q, _simulate_ahead(self.other.experiment))
            second = SceneMotion.of(self.other.experiment.scene, q_other)
        moving = SceneMotion.of(experiment.scene, q, second)
        return RecordingBuilder(moving, self.live.forms, find_task_belief(experiment), depth)


def build_second_experiment(experiment: Experiment, second: Mapping[str, Any]) -> Experiment:
    """Return the experiment of the second scheme. InputError: there is no such value."""
    controls = {each.path: each for each in experiment.controls()}
    (name, value), *_ = second.items()
    if name not in controls:
        raise InputError(f"the second scheme differs in {name}, which there would be no more")
    return experiment.at(controls[name].changes(value))


def _simulate_ahead(experiment: Experiment) -> Array:
    """Return the coordinates (T, nq) to which an experiment comes."""
    seconds = min(experiment.duration, AHEAD * experiment.dt)
    q = experiment.run(duration=seconds, record="all")["q"].values
    return np.asarray(q[np.isfinite(q).all(axis=1)])


def _pad_to_equal_length(*each: Array) -> list[Array]:
    """Return arrays (T, n) of the same T: the shorter ones stay at their last row."""
    most = max(map(len, each))
    return [np.concatenate([q, np.repeat(q[-1:], most - len(q), axis=0)]) for q in each]
