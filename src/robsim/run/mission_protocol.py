"""Tasks that are made of whole runs."""

from __future__ import annotations

from typing import Any, Protocol, runtime_checkable


@runtime_checkable
class SelfSimulatingTask(Protocol):
    """What stands in an experiment like a task, but simulates itself: a mission."""

    def simulated(self, experiment: Any, **how: Any) -> Any:
        """Return the run of an experiment whose task this is; `how` as in `Experiment.run`."""

    def checked(self, experiment: Any, *, view: bool = True) -> None:
        """Raise InputError for what can be known before; `view` as in `Experiment.check`."""
