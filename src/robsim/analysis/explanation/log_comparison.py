"""What explains a run that was recorded: how the robot differs from the simulator."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.text_format import (
    format_count,
    format_number,
    format_quantity,
    format_time,
)
from robsim.analysis.signal_fit import SignalFit, average_window, fit_signals
from robsim.base.arrays import Array, move_runs_last
from robsim.engine.outcome import Outcome
from robsim.run.experiment import Experiment
from robsim.run.log_commands import LOG_INTRINSICS, recompute_commands
from robsim.servo.camera_target import CameraTarget
from robsim.servo.task_controller import TaskController

if TYPE_CHECKING:
    import xarray as xr

ROUNDING = 1e-9  # of the largest command, below which it is rounding
WINDOW, FEWEST = 0.05, 25  # seconds and periods over which motion is compared
LARGE_OFFSET = 1.0  # pixels, by which marks are elsewhere than in the scene
OLD_IMAGE = 2.0  # periods, beyond which an image is old
K_NAMES = {(0, 0): "fx", (1, 1): "fy", (0, 2): "cx", (1, 2): "cy", (0, 1): "skew"}


@dataclass(frozen=True, eq=False)
class LogComparison:
    """A recorded run and the experiment that it is held against."""

    run: xr.Dataset
    case: Experiment

    @cached_property
    def controller(self) -> TaskController:
        """The task, bound to its scene."""
        bound: TaskController = self.case.task.bind(self.case.scene)
        return bound

    @property
    def has_commands(self) -> bool:
        """Whether commands were recorded."""
        return not str(self.run.attrs.get("commands", "none")).startswith("none")

    def findings(self) -> Iterator[Finding]:
        """Yield how commands, motion, images and lenses differ from those of the experiment."""
        if self.has_commands:
            yield from self._commands
            yield from self._motion()
        yield from self._places()
        yield from self._lenses()
        yield from self._ages()
        yield from self._unseen()

    def remarks(self) -> Iterator[str]:
        """Yield what is as in the experiment, or not known."""
        if not self.has_commands:
            yield f"Commands were not recorded: {self.run.attrs['commands']}."
        elif not self._commands:
            yield "The recorded commands are those of this controller for the same images."
        if self.has_commands and self._moved is not None and self._moved.is_same:
            yield f"The joints move as commanded, but for {100 * self._moved.rest:.2g} %."

    @cached_property
    def _commands(self) -> tuple[Finding, ...]:
        columns, made = recompute_commands(self.run, self.case)
        told = self.run["qd"].values[:, columns]
        found = fit_signals(made, told)
        if found.largest <= ROUNDING * np.abs(made).max(initial=0.0):
            return ()
        what = "The recorded commands are"
        of = "those of this controller for the same images and joints"
        return (Finding("commands", self._followed(found, what, of), asdict(found)),)

    @cached_property
    def _moved(self) -> SignalFit | None:
        """How the joints follow their commands; None where they do, or it cannot be said.

        Over windows: the clock of a log may tremble, and held joints then stand still for a period
        and go twice as far in the next.
        """
        run, dt = self.run, self.case.dt
        if run["coordinate"].values.tolist() != run["velocity"].values.tolist():
            return None  # of a joint whose coordinates do not change by its velocities
        told, moved = run["qd"].values[:-1], np.diff(run["q"].values, axis=0) / dt
        rounding = ROUNDING * np.abs(run["q"].values).max(initial=1.0) / dt
        if np.abs(moved - told).max(initial=0.0) <= rounding:
            return None
        periods = max(FEWEST, math.ceil(WINDOW / dt))
        return fit_signals(average_window(told, periods), average_window(moved, periods), lags=True)

    def _motion(self) -> Iterator[Finding]:
        found = self._moved
        if found is not None and not found.is_same:
            what, of = "The joints move with", "the velocities that were commanded"
            yield Finding("motion", self._followed(found, what, of), asdict(found))

    def _followed(self, found: SignalFit, what: str, of: str) -> str:
        if not found.rest < 0.5:
            return f"{what} something else than {of}: they differ by up to {format_number(found.largest)}."
        late = f", {format_count(found.periods, 'period')} late" if found.periods else ""
        seconds = f" ({format_number(found.periods * self.case.dt)} s)" if found.periods else ""
        if found.lag:
            seconds += f", with a lag of {format_number(found.lag * self.case.dt)} s"
        rest = f"; {100 * found.rest:.2g} % of them is left unexplained"
        left = rest if found.rest > ROUNDING else ""
        return f"{what} {format_number(found.scale)} times {of}{late}{seconds}{left}."

    def _places(self) -> Iterator[Finding]:
        q, first = move_runs_last(self.run["q"].values, 1), 0
        for sight in self.controller.sights:
            count = len(sight.target.marks)
            seen = self.run["pixels"].values[:, first : first + count]
            first += count
            away = (seen - np.moveaxis(sight.project(q).pixels, -1, 0)).reshape(-1, 2)
            away = away[np.isfinite(away).all(axis=1)]
            rms = float(np.sqrt((away**2).sum(axis=1).mean())) if len(away) else 0.0
            if rms > LARGE_OFFSET:
                yield _report_mark_offset(sight, rms, away.mean(axis=0))

    def _lenses(self) -> Iterator[Finding]:
        for name in dict.fromkeys(sight.eye.name for sight in self.controller.sights):
            given = self.run.attrs.get(f"{LOG_INTRINSICS}{name}")
            if given is None:
                continue
            K, own = np.reshape(given, (3, 3)), np.asarray(self.case.scene.camera(name).camera.K)
            differ = [
                f"{label} {format_number(K[at])} (in the scene {format_number(own[at])})"
                for at, label in K_NAMES.items()
                if abs(K[at] - own[at]) > 1e-6 * own[0, 0]
            ]
            if differ:
                text = f"In the log, camera '{name}' has {', '.join(differ)}."
                yield Finding("intrinsics", text)

    def _ages(self) -> Iterator[Finding]:
        ages, times = self.run["image_age"].values, self.run["time"].values
        if ages.size and ages.max() > OLD_IMAGE * self.case.dt:
            worst, at = float(ages.max()), float(times[np.argmax(ages.max(axis=1))])
            text = f"The image is up to {format_number(worst)} s old, at {format_number(at)} s."
            yield Finding("old images", text, {"age_s": worst})

    def _unseen(self) -> Iterator[Finding]:
        lost = np.isnan(self.run["pixels"].values).any(axis=2).mean(axis=0)
        if lost.size and lost.max() > 0:
            mark = int(np.argmax(lost))
            own = self.run["mark_target"].values[:mark].tolist()
            target = str(self.run["mark_target"].values[mark])
            text = (
                f"Mark {own.count(target)} of '{target}' is not seen for "
                f"{100 * lost[mark]:.3g} % of the time."
            )
            yield Finding("unseen marks", text, {"share": float(lost[mark])})

    def what(self) -> str:
        """Return a sentence that says how the log ended."""
        outcome, end = Outcome(int(self.run["outcome"])), format_time(float(self.run["end_time"]))
        if outcome is Outcome.OUT_OF_IMAGE:
            return f"{end} the log ends, and not all marks are seen."
        error = np.abs(self.run["error"].values[-1])
        if not error.size:
            return f"{end} the log ends."
        tolerances = self.controller.tolerances
        worst = int(np.argmax(error / tolerances))
        unit = str(self.run["feature_unit"].values[worst])
        size, small = (format_quantity(x[worst], unit) for x in (error, tolerances))
        how = "converged" if outcome is Outcome.CONVERGED else "before it has converged"
        return f"{end} the log ends {how}: the largest error is {size}, and the tolerance {small}."


def _report_mark_offset(sight: CameraTarget, rms: float, mean: Array) -> Finding:
    text = (
        f"'{sight.eye.name}' sees the marks of '{sight.target.name}' {format_number(rms)} px from where "
        f"the scene has them at the recorded joints, on average ({format_number(mean[0])}, "
        f"{format_number(mean[1])}): the lens, a pose or the target is another, or images are late."
    )
    return Finding("places", text, {"rms_px": rms, "column_px": mean[0], "row_px": mean[1]})
