"""The activity of the controller of a log: its phase, active limits and faults over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.errors import FileError, suggest_names
from robsim.run.control.drive_command import PHASES

CONVERGED = PHASES.index("converged")
PHASE = {
    "flag_values": np.arange(len(PHASES), dtype=np.int8),
    "flag_meanings": " ".join(PHASES),
    "long_name": "activity of the controller",
}
LIMITS = {"long_name": "limits that changed the command, or reasons to hold the robot"}
FAULT = {"long_name": "error in the data of the controller"}


@dataclass(frozen=True, eq=False)
class LogActivity:
    """Phase, limits and fault of a controller at its calls (n,), with times in nanoseconds."""

    times: NDArray[np.int64]
    phases: NDArray[np.int8]  # numbers of the phases
    limits: NDArray[np.str_]
    faults: NDArray[np.str_]

    def index(self, times: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the index of the last call until each time; 0 before the first call."""
        after = np.searchsorted(self.times, times, side="right")
        return np.asarray(np.maximum(after - 1, 0))

    def flag_convergence(self, times: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return a mask (T,) of the periods in which the controller has converged.

        The last period has the phase of the last call.
        """
        converged = np.asarray(self.phases[self.index(times)] == CONVERGED)
        converged[-1] = self.phases[-1] == CONVERGED
        return converged

    def variables(
        self, times: NDArray[np.int64]
    ) -> dict[str, tuple[str, NDArray[Any], dict[str, Any]]]:
        """Return the variables `phase`, `limits` and `fault` of a run with the given instants."""
        calls = self.index(times)
        return {
            "phase": ("time", self.phases[calls], PHASE),
            "limits": ("time", self.limits[calls], LIMITS),
            "fault": ("time", self.faults[calls], FAULT),
        }


def number_phases(names: Sequence[str]) -> NDArray[np.int8]:
    """Return the numbers (n,) of phases; raise FileError for a name that is no phase."""
    for name in dict.fromkeys(names):
        if name not in PHASES:
            hint = suggest_names(name, PHASES, "phases")
            raise FileError(f"no phase '{name:.80}'; {hint}")
    return np.array([PHASES.index(name) for name in names], dtype=np.int8)
