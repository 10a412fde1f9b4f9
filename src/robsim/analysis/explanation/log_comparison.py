"""Findings on a recorded run: differences between the robot and its simulation."""

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
from robsim.run.control.drive_command import PHASES
from robsim.run.experiment import Experiment
from robsim.run.log_commands import LOG_INTRINSICS, recompute_commands
from robsim.servo.camera_target import CameraTarget
from robsim.servo.task_controller import TaskController

if TYPE_CHECKING:
    import xarray as xr

ROUNDING = 1e-9  # share of the largest command below which a difference is rounding
WINDOW, FEWEST = 0.05, 25  # averaging window of motion, in seconds, and its least periods
LARGE_OFFSET = 1.0  # rms distance in pixels above which marks differ from the scene
OLD_IMAGE = 2.0  # age in periods above which an image is old
_HELD = ("holding", "stopped")  # phases in which the robot may not move
K_NAMES = {(0, 0): "fx", (1, 1): "fy", (0, 2): "cx", (1, 2): "cy", (0, 1): "skew"}


@dataclass(frozen=True, eq=False)
class LogComparison:
    """A recorded run, and the experiment that it is compared with."""

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
        """Yield the differences of commands, motion, images and lenses from the experiment."""
        if self.has_commands:
            yield from self._command_findings
            yield from self._report_motion()
        yield from self._report_mark_offsets()
        yield from self._report_intrinsics()
        yield from self._report_image_age()
        yield from self._report_missing_marks()

    def remarks(self) -> Iterator[str]:
        """Yield the quantities that agree with the experiment, or are unknown."""
        if not self.has_commands:
            yield f"Commands were not recorded: {self.run.attrs['commands']}."
        elif not self._command_findings:
            yield "The recorded commands are the commands of this controller for the same images."
        if self.has_commands and self._motion_fit is not None and self._motion_fit.is_same:
            yield f"The joints move as commanded, but for {100 * self._motion_fit.rest:.2g} %."
        yield from self._describe_alignment()

    def _describe_alignment(self) -> Iterator[str]:
        """Yield a sentence on the instants at which the log has no new measurement, if any."""
        counts = {
            "joints are interpolated": self.run.attrs.get("interpolated_joints", 0),
            "images are held": self.run.attrs.get("held_images", 0),
            "commands are held": self.run.attrs.get("held_commands", 0),
        }
        texts = [f"{what} at {count}" for what, count in counts.items() if count]
        if texts:
            yield f"Of {self.run.sizes['time']} instants, {', '.join(texts)}."

    @cached_property
    def _command_findings(self) -> tuple[Finding, ...]:
        """The difference between the recorded commands and the commands of the controller."""
        columns, computed = recompute_commands(self.run, self.case)
        recorded = self.run["qd"].values[:, columns]
        fit = fit_signals(computed, recorded)
        if fit.largest <= ROUNDING * np.abs(computed).max(initial=0.0):
            return ()
        subject = "The recorded commands are"
        reference = "the commands of this controller for the same images and joints"
        return (Finding("commands", self._describe_fit(fit, subject, reference), asdict(fit)),)

    @cached_property
    def _motion_fit(self) -> SignalFit | None:
        """The fit of the joint motion by the commands; None if they agree, or cannot be compared.

        Velocities are displacements over the periods of the log's own clock, averaged over windows.
        """
        run, dt = self.run, self.case.dt
        if run["coordinate"].values.tolist() != run["velocity"].values.tolist():
            return None  # coordinates of some joint are not integrals of its velocities
        commanded, moved = run["qd"].values[:-1], np.diff(run["q"].values, axis=0) / dt
        periods = np.diff(run["log_time"].values)[:, None] / dt
        rounding = ROUNDING * np.abs(run["q"].values).max(initial=1.0) / dt
        if np.abs(moved / periods - commanded).max(initial=0.0) <= rounding:
            return None
        width = max(FEWEST, math.ceil(WINDOW / dt))
        mean_periods = 1.0 + average_window(periods - 1.0, width)
        velocities = average_window(moved, width) / mean_periods
        return fit_signals(average_window(commanded, width), velocities, lags=True)

    def _report_motion(self) -> Iterator[Finding]:
        """Yield the difference between the joint motion and the commands."""
        fit = self._motion_fit
        if fit is not None and not fit.is_same:
            subject, reference = "The joints move with", "the velocities that were commanded"
            yield Finding("motion", self._describe_fit(fit, subject, reference), asdict(fit))

    def _describe_fit(self, fit: SignalFit, subject: str, reference: str) -> str:
        """Return a sentence on the fit of one signal by another."""
        if not fit.rest < 0.5:
            largest = format_number(fit.largest)
            return f"{subject} other values than {reference}: they differ by up to {largest}."
        delay = f", {format_count(fit.periods, 'period')} late" if fit.periods else ""
        seconds = f" ({format_number(fit.periods * self.case.dt)} s)" if fit.periods else ""
        if fit.lag:
            seconds += f", with a lag of {format_number(fit.lag * self.case.dt)} s"
        rest = f"; {100 * fit.rest:.2g} % of them is unexplained"
        remainder = rest if fit.rest > ROUNDING else ""
        return f"{subject} {format_number(fit.scale)} times {reference}{delay}{seconds}{remainder}."

    def _report_mark_offsets(self) -> Iterator[Finding]:
        """Yield the cameras with marks away from their projections in the scene."""
        q, first = move_runs_last(self.run["q"].values, 1), 0
        for sight in self.controller.sights:
            count = len(sight.target.marks)
            pixels = self.run["pixels"].values[:, first : first + count]
            first += count
            offsets = (pixels - np.moveaxis(sight.project(q).pixels, -1, 0)).reshape(-1, 2)
            offsets = offsets[np.isfinite(offsets).all(axis=1)]
            rms = float(np.sqrt((offsets**2).sum(axis=1).mean())) if len(offsets) else 0.0
            if rms > LARGE_OFFSET:
                yield _report_mark_offset(sight, rms, offsets.mean(axis=0))

    def _report_intrinsics(self) -> Iterator[Finding]:
        """Yield the cameras with intrinsics that differ between log and scene."""
        for name in dict.fromkeys(sight.eye.name for sight in self.controller.sights):
            recorded = self.run.attrs.get(f"{LOG_INTRINSICS}{name}")
            if recorded is None:
                continue
            K, scene_K = (
                np.reshape(recorded, (3, 3)),
                np.asarray(self.case.scene.camera(name).camera.K),
            )
            differences = [
                f"{label} {format_number(K[at])} (in the scene {format_number(scene_K[at])})"
                for at, label in K_NAMES.items()
                if abs(K[at] - scene_K[at]) > 1e-6 * scene_K[0, 0]
            ]
            if differences:
                text = f"In the log, camera '{name}' has {', '.join(differences)}."
                yield Finding("intrinsics", text)

    def _report_image_age(self) -> Iterator[Finding]:
        """Yield the age of the oldest image if it is old."""
        ages, times = self.run["image_age"].values, self.run["time"].values
        if ages.size and ages.max() > OLD_IMAGE * self.case.dt:
            worst, at = float(ages.max()), float(times[np.argmax(ages.max(axis=1))])
            text = f"The image is up to {format_number(worst)} s old, at {format_number(at)} s."
            yield Finding("old images", text, {"age_s": worst})

    def _report_missing_marks(self) -> Iterator[Finding]:
        """Yield the mark that is missing most often."""
        missing = np.isnan(self.run["pixels"].values).any(axis=2).mean(axis=0)
        if missing.size and missing.max() > 0:
            mark = int(np.argmax(missing))
            targets = self.run["mark_target"].values[:mark].tolist()
            target = str(self.run["mark_target"].values[mark])
            text = (
                f"Mark {targets.count(target)} of '{target}' is not seen for "
                f"{100 * missing[mark]:.3g} % of the time."
            )
            yield Finding("unseen marks", text, {"share": float(missing[mark])})

    def describe_end(self) -> str:
        """Return a sentence on the end of the log."""
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
        ending = f"{end} the log ends {how}{self._describe_hold()}"
        return f"{ending}: the largest error is {size}, and the tolerance {small}."

    def _describe_hold(self) -> str:
        """Return a clause on the last phase if the controller held the robot, else ""."""
        if "phase" not in self.run or PHASES[int(self.run["phase"][-1])] not in _HELD:
            return ""
        return f", while the robot is held ({self.run['limits'].values[-1] or 'fault'})"


def _report_mark_offset(sight: CameraTarget, rms: float, mean: Array) -> Finding:
    """Return the finding on marks away from their projections in the scene."""
    camera, target = sight.eye.name, sight.target.name
    offset = f"({format_number(mean[0])}, {format_number(mean[1])})"
    text = (
        f"'{camera}' sees the marks of '{target}' {format_number(rms)} px from their projections "
        f"in the scene at the recorded joints, on average {offset}: the lens, a pose or the target "
        "differs, or images are late."
    )
    return Finding("places", text, {"rms_px": rms, "column_px": mean[0], "row_px": mean[1]})
