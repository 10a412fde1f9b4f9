"""The facts of a repeated run from which imperfections state their part in it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.explanation import views
from robsim.analysis.leaves import weighs_robustly
from robsim.analysis.repeated import Repeated
from robsim.base.arrays import Array
from robsim.engine.outcome import Outcome
from robsim.world.imperfections.imperfection import Statement


@dataclass(frozen=True, eq=False)
class RepeatedFacts:
    """The facts of a run that was repeated, for `Imperfection.stated`."""

    again: Repeated

    @property
    def dt(self) -> float:
        """The control period in seconds."""
        return self.again.case.dt

    @property
    def gain(self) -> float:
        """The largest gain of the task, per second; NaN for a user's own kind of task."""
        return views.gain_of(self.again.case)

    @property
    def robust(self) -> bool:
        """Whether the task has robust weights."""
        return weighs_robustly(self.again.case.task)

    @property
    def columns(self) -> NDArray[np.int64]:
        """The numbers of the commanded velocities among those of the scene."""
        return self.again.loop.controller.columns

    @property
    def velocities(self) -> tuple[Array, Array]:
        """The commanded and the actual velocities (T, nv) of the scene."""
        periods = max(len(self.again.snapshots) - 1, 1)
        run = self.again.run
        return run["qd"].values[:periods], run["qd_actual"].values[:periods]

    def lasting(self, what: str) -> Statement:
        """Return the statement of what keeps the error from vanishing, with its final size."""
        again = self.again
        if again.outcome is not Outcome.TIME_LIMIT:
            return f"{what}.", {}
        sizes, tolerance = views.largest_errors(again), again.loop.controller.tolerance
        floor = float(np.median(sizes[-max(len(sizes) // 3, 1) :]))
        sentence = (
            f"{what}: the largest error stays at about {views.size(again, floor)}, and the "
            f"tolerance is {views.size(again, tolerance)}."
        )
        return sentence, {"floor": floor, "tolerance": tolerance}
