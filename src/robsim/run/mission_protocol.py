"""The protocol of tasks that consist of whole runs."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable

from robsim.run.mission_run import MissionRun


@runtime_checkable
class SelfSimulatingTask(Protocol):
    """Interface of a task that simulates itself, such as a mission."""

    # Any: an `Experiment`, whose module imports this one, and other arguments of `Experiment.run`
    def simulated(self, experiment: Any, **how: Any) -> MissionRun:
        """Return the run of an experiment with this task; `how` as in `Experiment.run`."""

    def checked(self, experiment: Any, *, view: bool = True) -> None:
        """Raise InputError for errors that can be detected before a run.

        `view` is as in `Experiment.check`.
        """
