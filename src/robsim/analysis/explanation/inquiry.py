"""`Inquiry`: a run to be explained, with its diagnosis and trial runs with changes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from robsim.analysis.diagnosis import diagnosed
from robsim.analysis.explanation import views
from robsim.analysis.explanation.goal_search import Nearest, nearest_to_goal
from robsim.analysis.explanation.removal import Change, Trial, patient, tried
from robsim.analysis.explanation.wording import number
from robsim.analysis.repeated import Repeated
from robsim.base.arrays import Array
from robsim.engine.outcome import Outcome
from robsim.geometry.pose import Pose
from robsim.run.experiment import Experiment
from robsim.servo.command import Basis
from robsim.servo.servo_controller import Servo
from robsim.servo.sight import Sight

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Inquiry:
    """A repeated run, and whether it may be repeated with changes."""

    again: Repeated
    trials: bool

    @property
    def case(self) -> Experiment:
        """The case that made the run."""
        return self.again.case

    @property
    def outcome(self) -> Outcome:
        """The outcome of the run."""
        return self.again.outcome

    @cached_property
    def diagnosis(self) -> xr.Dataset:
        """The diagnosis at every instant."""
        return diagnosed(self.again)

    @cached_property
    def servo(self) -> Servo | None:
        """The controller; None unless it is that of one servo task."""
        return views.servo_of(self.again)

    @property
    def last(self) -> Basis | None:
        """What the last command is based on; None unless the run is of one servo task."""
        basis = self.again.decisions[-1].basis
        return basis if isinstance(basis, Basis) else None

    @cached_property
    def errors(self) -> Array:
        """The largest measured error max|e| (T,) at each instant."""
        return views.largest_errors(self.again)

    @cached_property
    def depths(self) -> Array:
        """The mean depth (T,) of the marks in metres."""
        return views.mean_depths(self.again)

    @property
    def sight(self) -> Sight:
        """The first camera and its target in the true scene."""
        return self.again.loop.controller.sights[0]

    @cached_property
    def goal_pose(self) -> Pose | None:
        """The intended pose T_c_o at the goal; None where the goal is made of numbers."""
        return views.goal_pose(self.again.loop.controller)

    @cached_property
    def nearest(self) -> Nearest | None:
        """The pose whose features are nearest to those of a goal that is given as numbers."""
        return nearest_to_goal(self.again)

    @cached_property
    def turn(self) -> Array | None:
        """The rotation vector (3,) from the goal to the start, in camera axes."""
        away = views.from_goal(self.again.loop.controller, self.case.start)
        return None if away is None else away.rotvec

    @property
    def end(self) -> float:
        """The time in seconds at which the run ended."""
        return (len(self.again.snapshots) - 1) * self.case.dt

    @property
    def tolerance(self) -> float:
        """The tolerance of the error."""
        return self.again.loop.controller.tolerance

    def value(self, name: str, t: int = -1) -> float:
        """Return one number of the diagnosis, by default at the end."""
        return float(self.diagnosis[name].values[t])

    def trial(self, change: Change) -> Trial | None:
        """Run the case with a change and enough time; None without trials."""
        return tried(change(self.patient)) if self.trials else None

    @property
    def patient(self) -> Experiment:
        """The case with a longer duration, estimated from the decay of the error."""
        return patient(self.case, self.arrival / self.end if self.end else 0.0)

    @property
    def falls(self) -> bool:
        """Whether the error is still falling at the end."""
        third = self.errors[-max(len(self.errors) // 3, 3) :]
        if self.decay > 0.2 * views.gain_of(self.case) and (np.diff(third) < 0).all():
            return True  # as fast as the gain allows
        return self.decay * len(third) * self.case.dt > 0.05 and bool(third[-1] < 1.2 * third.min())

    @property
    def arrival(self) -> float:
        """The time in seconds at which the error would fall below the tolerance; or NaN."""
        size = self.errors[-1]
        if not self.decay > 0 or not size > self.tolerance:
            return float("nan")
        return self.end + float(np.log(size / self.tolerance)) / self.decay

    def size(self, error: float) -> str:
        """Return an error as text with its unit."""
        return views.size(self.again, error)

    def with_unit(self, name: str, t: int = -1) -> str:
        """Return one number of the diagnosis with its unit, by default at the end."""
        unit = self.diagnosis[name].attrs["units"]
        value = number(self.value(name, t))
        return value if unit in ("1", "1/s") or "see" in unit else f"{value} {unit}"

    @cached_property
    def decay(self) -> float:
        """The rate per second at which the error fell in the last third, by least squares."""
        sizes = self.errors[-max(len(self.errors) // 3, 3) :]
        if len(sizes) < 2 or not (sizes > 0).all() or not np.isfinite(sizes).all():
            return float("nan")
        times = np.arange(len(sizes)) * self.case.dt
        return -float(np.polyfit(times, np.log(sizes), 1)[0])
