"""A run that is asked about: repeated, diagnosed, and repeated again with changes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from robsim.analysis.case import Case, Repeated
from robsim.analysis.diagnosis import diagnosed
from robsim.analysis.explanation import views
from robsim.analysis.explanation.goal_search import Nearest, nearest_to_goal
from robsim.analysis.explanation.removal import Change, Trial, patient, tried
from robsim.analysis.explanation.wording import number
from robsim.base.arrays import Array
from robsim.geometry.pose import Pose
from robsim.run.outcome import Outcome
from robsim.servo.servo_controller import Basis, Servo
from robsim.servo.sight import Sight

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class Inquiry:
    """A repeated run, and whether it may be repeated with changes."""

    again: Repeated
    experiments: bool

    @property
    def case(self) -> Case:
        """What made the run."""
        return self.again.case

    @property
    def outcome(self) -> Outcome:
        """How it ended."""
        return self.again.outcome

    @cached_property
    def diagnosis(self) -> xr.Dataset:
        """Of every instant."""
        return diagnosed(self.again)

    @cached_property
    def servo(self) -> Servo | None:
        """The controller, if it is that of one servo task."""
        return views.servo_of(self.again)

    @property
    def last(self) -> Basis | None:
        """What the last command is based on, if it is that of one servo task."""
        basis = self.again.decisions[-1].basis
        return basis if isinstance(basis, Basis) else None

    @cached_property
    def errors(self) -> Array:
        """(T,) max|e| as measured."""
        return views.largest_errors(self.again)

    @cached_property
    def depths(self) -> Array:
        """(T,) mean depth of the marks in metres."""
        return views.mean_depths(self.again)

    @property
    def sight(self) -> Sight:
        """The first camera and its target, as they are."""
        return self.again.loop.controller.sights[0]

    @cached_property
    def goal_pose(self) -> Pose | None:
        """T_c_o at the goal, as it was meant."""
        return views.goal_pose(self.again.loop.controller)

    @cached_property
    def nearest(self) -> Nearest | None:
        """The pose whose features are nearest to those of a goal that is given as numbers."""
        return nearest_to_goal(self.again)

    @cached_property
    def turn(self) -> Array | None:
        """Rotation vector (3,) from the goal to the start, in camera axes."""
        away = views.from_goal(self.again.loop.controller, self.case.q0)
        return None if away is None else away.rotvec

    @property
    def end(self) -> float:
        """When the run ended, seconds."""
        return (len(self.again.snapshots) - 1) * self.case.dt

    @property
    def tolerance(self) -> float:
        """Of the error."""
        return self.again.loop.controller.tolerance

    def value(self, name: str, t: int = -1) -> float:
        """One number of the diagnosis, by default at the end."""
        return float(self.diagnosis[name].values[t])

    def trial(self, change: Change) -> Trial | None:
        """The run with a change and time to end; None without experiments."""
        return tried(change(self.patient)) if self.experiments else None

    @property
    def patient(self) -> Case:
        """With time to end, as long as the decay of the error lets it expect."""
        return patient(self.case, self.arrival / self.end if self.end else 0.0)

    @property
    def falls(self) -> bool:
        """Whether the error is still on its way at the end."""
        third = self.errors[-max(len(self.errors) // 3, 3) :]
        if self.decay > 0.2 * views.gain_of(self.case) and (np.diff(third) < 0).all():
            return True  # as fast as the gain lets it, however slow
        return self.decay * len(third) * self.case.dt > 0.05 and bool(third[-1] < 1.2 * third.min())

    @property
    def arrival(self) -> float:
        """When the error will be below the tolerance if it goes on to fall as at the end."""
        size = self.errors[-1]
        if not self.decay > 0 or not size > self.tolerance:
            return float("nan")
        return self.end + float(np.log(size / self.tolerance)) / self.decay

    def size(self, error: float) -> str:
        """An error with its unit."""
        return views.size(self.again, error)

    def with_unit(self, name: str, t: int = -1) -> str:
        """One number of the diagnosis with its unit, by default at the end."""
        unit = self.diagnosis[name].attrs["units"]
        value = number(self.value(name, t))
        return value if unit in ("1", "1/s") or "see" in unit else f"{value} {unit}"

    @cached_property
    def decay(self) -> float:
        """Rate per second at which the error fell in the last third, by least squares; or NaN."""
        sizes = self.errors[-max(len(self.errors) // 3, 3) :]
        if len(sizes) < 2 or not (sizes > 0).all() or not np.isfinite(sizes).all():
            return float("nan")
        times = np.arange(len(sizes)) * self.case.dt
        return -float(np.polyfit(times, np.log(sizes), 1)[0])
