"""Findings on a recorded run: differences between the robot and its simulation."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.explanation.findings import Finding
from robsim.analysis.explanation.text_format import format_number, format_quantity, format_time
from robsim.analysis.log_faults.camera_hypotheses import (
    list_camera_hypotheses,
    list_target_hypotheses,
)
from robsim.analysis.log_faults.fault_choice import FaultChoice, choose_fault
from robsim.analysis.log_faults.fault_report import report_fault
from robsim.analysis.log_faults.image_comparison import ImageComparison
from robsim.analysis.log_faults.image_times import list_time_hypotheses
from robsim.analysis.log_faults.joint_hypotheses import list_joint_hypotheses
from robsim.analysis.log_faults.log_images import JointTrack, collect_image_series
from robsim.analysis.log_faults.lost_frames import FrameCount
from robsim.analysis.log_faults.motion_comparison import (
    HeldSignal,
    ResponseComparison,
    compare_commands,
    compare_motion,
)
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
WINDOW, FEWEST_PERIODS = 0.2, 5  # averaging window of motion in s, and its least periods
PIXEL_FLOOR = 0.1  # standard deviation in pixels of errors of interpolation between joint states
SPEED_FLOOR = 0.01  # the same of velocities, as a share of their rms
UNEXPLAINED = 1.0  # rms residual of pixels, beyond twice the noise, with another fault
BORDER = 0.05  # share of the image at its border, where a target may leave it
_HELD = ("holding", "stopped")  # phases in which the robot may not move
FEWEST_IMAGES = 5  # images below which no fault is fitted
WRONG_DATA = (
    "image times",
    "swapped axes",
    "swapped marks",
    "swapped pixels",
    "swapped joints",
    "reversed reading",
)
K_NAMES = {(0, 0): "fx", (1, 1): "fy", (0, 2): "cx", (1, 2): "cy", (0, 1): "skew"}


@dataclass(frozen=True, eq=False)
class LogComparison:
    """A recorded run, and the experiment that it is compared with.

    Three comparisons each have at most one fault: the images with the scene at the measured joints,
    the motion of the joints with the commands, and the commands with the commands of the
    controller. A fault of the log itself, such as swapped joints, also changes the later
    comparisons, and is corrected in them.
    """

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
        """Yield the faults of images, joints, motion and commands, and lost or old images."""
        if self._image_choice:
            yield from self._report_image_fault(self._image_choice)
        if self._motion_fault:
            yield report_fault(self._motion_fault, "velocities", self._format_speed)
        if self._command_fault:
            yield report_fault(self._command_fault, "commands", self._format_speed)
        yield from self._report_intrinsics()
        for each in self._frames:
            yield from each.findings()
            if not self._has_wrong_times:
                yield from each.report_age()

    def remarks(self) -> Iterator[str]:
        """Yield the quantities that agree with the experiment, or are unknown."""
        if not self.has_commands:
            yield f"Commands were not recorded: {self.run.attrs['commands']}."
        else:
            yield from self._describe_commands()
        if self._motion and not self._motion_fault:
            rms = self._motion.healthy.rms / max(self._command_speed, 1e-300)
            yield f"The joints move as commanded, but for {100 * rms:.2g} %."
        yield from self._describe_images()
        for each in self._frames:
            if each.is_usual and each.share > 0.0:
                yield each.describe()
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

    def _describe_images(self) -> Iterator[str]:
        """Yield a sentence on the images if they have no fault."""
        if self._image_choice and not self._image_fault:
            rms = _format_pixels(self._image_choice.healthy.rms)
            yield f"The pixels deviate by {rms} (rms) from the projections in the scene."

    def _describe_commands(self) -> Iterator[str]:
        """Yield a sentence on the commands if they have no fault."""
        if self._commands is None:
            yield "The recorded commands are the commands of this controller for the same images."
        elif self._has_wrong_data:
            yield "The commands are not compared: the controller had other data than the log."
        elif not self._command_fault:
            rms = self._commands.healthy.rms / max(self._command_speed, 1e-300)
            yield (
                "The recorded commands are the commands of this controller for the same images, "
                f"but for {100 * rms:.2g} %."
            )

    # ---- images ----

    @cached_property
    def _times(self) -> Array:
        """The instants (T,) on the clock of the log, in seconds."""
        times: Array = self.run["log_time"].values
        return times

    @cached_property
    def _images(self) -> ImageComparison | None:
        """The images beside their prediction; None with too few images."""
        sights = self.controller.sights
        track = JointTrack(self.case.scene.tree, self._times, self.run["q"].values)
        series = collect_image_series(self.run, track, sights)
        few = min((len(each.times) for each in series), default=0) < FEWEST_IMAGES
        return None if few else ImageComparison(series)

    @cached_property
    def _image_choice(self) -> FaultChoice | None:
        """The choice among the faults of cameras, targets, measured joints and image times."""
        images = self._images
        if images is None:
            return None
        cameras, targets = zip(*(each.sight.key for each in images.series), strict=True)
        hypotheses = [images.healthy]
        for camera in dict.fromkeys(cameras):
            hypotheses += list_camera_hypotheses(images, camera)
            latency = self.case.sensing.latency
            hypotheses += list_time_hypotheses(images, camera, self.case.dt, latency)
        for target in dict.fromkeys(targets):
            hypotheses += list_target_hypotheses(images, target)
        hypotheses += list_joint_hypotheses(images)
        return choose_fault(hypotheses, images.observed, PIXEL_FLOOR)

    @property
    def _image_fault(self) -> FaultChoice | None:
        """The choice among the faults of images if there is a fault."""
        choice = self._image_choice
        return choice if choice and choice.has_fault else None

    @property
    def _has_wrong_times(self) -> bool:
        """Whether the times of images are wrong."""
        fault = self._image_fault
        return fault is not None and "image times" in fault.best.hypothesis.about

    @property
    def _has_wrong_data(self) -> bool:
        """Whether the images or joints of the log are wrong, and perhaps not of the controller."""
        fault = self._image_fault
        return fault is not None and fault.best.hypothesis.about in WRONG_DATA

    def _report_image_fault(self, choice: FaultChoice) -> Iterator[Finding]:
        """Yield the fault of the images, or a distance of the marks that no fault explains."""
        rms, noise = choice.best.rms, choice.best.estimate_noise()
        if choice.has_fault:
            finding, rest = report_fault(choice, "pixels", _format_pixels), ""
            if rms > UNEXPLAINED + 2.0 * noise:
                rest = f" Their noise is {_format_pixels(noise)}: there is another fault."
            yield replace(finding, sentence=finding.sentence + rest)
        elif rms > UNEXPLAINED + 2.0 * noise:
            away = _format_pixels(choice.healthy.rms)
            text = (
                f"The pixels of the marks deviate by {away} (rms) from their projections in the "
                "scene at the recorded joints, and no single fault explains it."
            )
            yield Finding("places", text, {"rms": choice.healthy.rms})

    # ---- commands ----

    @cached_property
    def _computed_commands(self) -> tuple[NDArray[np.int64], Array]:
        """The velocities that the controller commands, and its commands (T, n) for the log."""
        return recompute_commands(self.run, self.case)

    @cached_property
    def _commands(self) -> FaultChoice | None:
        """The choice among the faults of commands; None if they agree to rounding."""
        columns, computed = self._computed_commands
        recorded = self.run["qd"].values[:, columns].copy()
        if np.abs(recorded - computed).max(initial=0.0) <= ROUNDING * np.abs(computed).max(
            initial=0.0
        ):
            return None
        recorded[~recorded.any(axis=1)] = np.nan  # the controller holds the robot
        names, units = self._name_velocities(columns)
        comparison = compare_commands(self._times, computed, recorded, names, units, self.case.dt)
        if not np.isfinite(comparison.observed).any():
            return None  # the controller holds the robot all the time
        return self._choose_response(comparison, self._command_speed)

    @property
    def _command_fault(self) -> FaultChoice | None:
        """The choice among the faults of commands if there is a fault."""
        choice = self._commands if self.has_commands else None
        return choice if choice and choice.has_fault and not self._has_wrong_data else None

    @property
    def _command_speed(self) -> float:
        """The rms of the recorded commands."""
        return float(np.sqrt(np.mean(self.run["qd"].values ** 2)))

    def _name_velocities(self, columns: NDArray[np.int64]) -> tuple[list[str], list[str]]:
        """Return the names and units of some velocities."""
        scene = self.case.scene
        names, units = scene.velocity_names, scene.velocity_units
        return [names[i] for i in columns], [units[i] for i in columns]

    def _format_speed(self, rms: float) -> str:
        """Return a residual of velocities as a share of the rms command."""
        return f"{100 * max(rms / self._command_speed, SPEED_FLOOR):.2g} %"

    @staticmethod
    def _choose_response(comparison: ResponseComparison, speed: float) -> FaultChoice:
        """Return the choice among the faults of a response."""
        hypotheses = list(comparison.list_hypotheses())
        return choose_fault(hypotheses, comparison.observed, max(SPEED_FLOOR * speed, 1e-12))

    # ---- motion ----

    @property
    def _compares_motion(self) -> bool:
        """Whether the commands are velocities, which the motion should follow."""
        return not self.run["qd"].attrs.get("units", "").startswith("N")

    @cached_property
    def _motion(self) -> FaultChoice | None:
        """The choice among the faults of the motion; None if it cannot be compared."""
        run = self.run
        if not self.has_commands or self._command_speed == 0.0:
            return None
        if not self._compares_motion:
            return None
        if run["coordinate"].values.tolist() != run["velocity"].values.tolist():
            return None  # coordinates of some joint are not integrals of its velocities
        choice, fault = self._compare_motion(run["q"].values, run["qd"].values), self._image_fault
        if not choice.has_fault:
            return choice
        q, commands = run["q"].values, run["qd"].values.copy()
        if fault and fault.best.hypothesis.correct:
            q = fault.best.hypothesis.correct(fault.best.values, q)
        if (other := self._command_fault) and other.best.hypothesis.correct:
            columns, _ = self._computed_commands
            commands[:, columns] = other.best.hypothesis.correct(
                other.best.values, commands[:, columns]
            )
        return self._compare_motion(q, commands)

    def _compare_motion(self, q: Array, qd: Array) -> FaultChoice:
        """Return the choice among the faults of the motion of joints q (T, n) by commands."""
        moving = qd.any(axis=0) | (np.ptp(q, axis=0) > 0.0)
        columns: NDArray[np.int64] = np.flatnonzero(moving)
        names, units = self._name_velocities(columns)
        signal = HeldSignal(
            *_sort_commands(self._times - self.run["command_age"].values, qd[:, columns])
        )
        window = max(FEWEST_PERIODS, math.ceil(WINDOW / self.case.dt))
        comparison = compare_motion(
            *(self._times, q[:, columns], signal, names, units),
            *(self.case.dt, self.case.actuation.lag, window),
        )
        return self._choose_response(comparison, self._command_speed)

    @property
    def _motion_fault(self) -> FaultChoice | None:
        """The choice among the faults of the motion if there is a fault."""
        choice = self._motion
        return choice if choice and choice.has_fault else None

    # ---- images that are lost or old, and the lens in the log ----

    @cached_property
    def _frames(self) -> list[FrameCount]:
        """The counts of the images of each camera and target."""
        counts, first, sensing = [], 0, self.case.sensing
        for sight in self.controller.sights:
            marks = slice(first, first + len(sight.target.marks))
            ages = self.run["image_age"].values[:, first]
            pixels, q = self.run["pixels"].values[:, marks], self.run["q"].values
            inside = self._find_inside(sight)
            declared = self.case.dt, sensing.period or 0.0, sensing.latency, sensing.dropped
            counts.append(FrameCount(sight, self._times - ages, ages, pixels, q, inside, *declared))
            first = marks.stop
        return counts

    def _find_inside(self, sight: CameraTarget) -> NDArray[np.bool_]:
        """Return the mask (T,) of the instants with a target well inside the image by the scene."""
        count, size = self.run.sizes["time"], sight.eye.camera.size
        if size is None:
            return np.ones(count, dtype=bool)
        choice = self._image_choice
        border = BORDER * max(size) + (choice.healthy.rms if choice else 0.0)
        pixels = sight.project(move_runs_last(self.run["q"].values, 1)).pixels
        inside = (pixels > border) & (pixels < np.array(size)[:, None] - border)
        return np.asarray(inside.all(axis=(0, 1)))

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


def _format_pixels(rms: float) -> str:
    """Return a residual of pixels as a text."""
    return f"{format_number(rms)} px" if rms > PIXEL_FLOOR else f"less than {PIXEL_FLOOR} px"


def _sort_commands(times: Array, commands: Array) -> tuple[Array, Array]:
    """Return commands (n, nv) once each with increasing times (n,), from held commands (T, nv)."""
    times, rows = np.unique(times, return_index=True)
    return times, commands[rows]
