"""A run from a log: the recorded signals at the instants of control."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, euclidean_length, move_runs_last
from robsim.base.errors import InputError
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.engine.recorder import Recorder
from robsim.files.flat_table import RunDataset
from robsim.run.control.standalone_controller import Controller
from robsim.run.end_variables import compute_moving_pose
from robsim.run.experiment import Experiment
from robsim.run.log import NANO, Log, Times, find_first_complete, hold_marks
from robsim.run.log_alignment import (
    LogInstants,
    find_instants,
    index_commands,
    index_images,
    interpolate_stream,
)
from robsim.run.log_commands import LOG_ATTRIBUTE, ImageTimes, compute_signals
from robsim.run.provenance import compute_whole_duration

CONVERGED_AT = "converged_at"  # attribute of a log that converged: seconds until convergence
LONG_NAMES = {
    "log_time": "time of the joints on the clock of the log",
    "image_age": "age of the last image that was searched for a mark, at log_time",
    "command_age": "age of the command at log_time, negative if it came later",
}
INTERPOLATED = "whether joints were interpolated, because none was measured within half a period"


def make_run_from_log(log: Log, experiment: Experiment) -> RunDataset:
    """Return the run of a log, with the variables of a simulated run and the clock of the log.

    The run has an instant for each period (see `find_instants`), with the joints, images and
    commands of this instant. At the first instant each mark has its last observed pixels. The
    experiment's controller computes features and errors. The outcome is CONVERGED, OUT_OF_IMAGE or
    RUNNING, according to the last instant; if the log has the phases of its controller, it is
    CONVERGED if and only if the last phase is.

    Raise FileError if the log is shorter than a period, too long, or has a long gap, and InputError
    if the task has features of pictures, which a log lacks.
    """
    controller = Controller(experiment)
    if controller.pictured_cameras:
        names = ", ".join(controller.pictured_cameras)
        raise InputError(f"the task uses pictures of {names}; a log has none")
    samples = _LogSamples(log, controller, find_instants(log, experiment.dt))
    q, (pixels, image_times) = samples.joints(), samples.images()
    seconds = compute_whole_duration(len(q) - 1, experiment.dt)
    log_experiment = replace(experiment, start=q[0], duration=seconds, record="all", first_run=0)
    clock = ImageTimes(samples.clock, image_times)
    computed = compute_signals(log_experiment, q, pixels, clock)
    command_source, qd = samples.commands(q)
    loop = log_experiment.loop()
    small = (
        _is_error_small(loop, computed.error, pixels)
        if log.activity is None
        else log.activity.flag_convergence(samples.clock)
    )
    marks = pixels.reshape(len(q), -1)
    signals = [q, qd, samples.rates(), computed.s, marks, computed.weights]
    _fill_recorder(loop, signals, small)
    run = log_experiment.dataset(loop)
    if int(run["outcome"]) == Outcome.CONVERGED:
        run.attrs[CONVERGED_AT] = float(run["time"].values[_find_settling_period(small)])
    if log.activity is not None:
        run.update(log.activity.variables(samples.clock))
    samples.store_clock(run, clock)
    run.attrs |= {LOG_ATTRIBUTE: log.source, "commands": command_source} | dict(log.notes)
    return run


@dataclass(frozen=True, eq=False)
class _LogSamples:
    """The signals of a log at its instants (T,)."""

    log: Log
    controller: Controller
    instants: LogInstants

    @property
    def clock(self) -> Times:
        """The instants (T,) on the clock of the log, in nanoseconds."""
        return self.instants.times

    def joints(self) -> Array:
        """Return the coordinates (T, nq)."""

        def between(a: Array, b: Array, share: Array) -> Array:
            return move_runs_last(self.controller.scene.tree.between(a.T, b.T, share), 1)

        return interpolate_stream(self.log.joints, self.instants, between)

    def rates(self) -> Array:
        """Return the measured velocities (T, nv), or (T, 0) without any."""
        if self.log.rates is None:
            return np.empty((len(self.clock), 0))
        return interpolate_stream(self.log.rates, self.instants)

    def images(self) -> tuple[Array, Times]:
        """Return the pixels (T, N, 2) of the marks of all cameras, and the image times (T, N)."""
        count = len(self.clock)
        pixels, times = [np.empty((count, 0, 2))], [np.empty((count, 0), dtype=np.int64)]
        for sight in self.controller.sights:
            images = self.log.images[sight.key]
            index = index_images(images, self.instants)
            index = np.maximum(index, find_first_complete(images))  # rounding of the mean phase
            pixels.append(hold_marks(images, index))
            taken = images.capture_times[index, None]
            times.append(np.repeat(taken, len(sight.target.marks), axis=1))
        return np.concatenate(pixels, axis=1), np.concatenate(times, axis=1)

    def commands(self, q: Array) -> tuple[str, Array]:
        """Return the source of the commanded velocities as a text, and their values (T, nv).

        Velocities before the first command are zero. Without commands they are the measured
        velocities or the differences of the joints.
        """
        log, scene = self.log, self.controller.scene
        if log.commands is not None:
            return log.commands.what, log.commands.take(self.command_index)
        if log.rates is not None:
            return f"none; velocities are those of {log.rates.what}", self.rates()
        qd = np.zeros((len(q), scene.nv))
        if scene.velocity_names != scene.coordinate_names:
            return "none; velocities are zero", qd
        periods = self.controller.dt + np.diff(self.instants.offsets)
        qd[:-1] = np.diff(q, axis=0) / periods[:, None]
        return "none; velocities are differences of the joints", qd

    @cached_property
    def command_index(self) -> NDArray[np.int64]:
        """The index (T,) of the command at each instant, or (0,) without commands."""
        if self.log.commands is None:
            return np.empty(0, dtype=np.int64)
        return index_commands(self.log.commands, self.instants)

    def store_clock(self, run: RunDataset, images: ImageTimes) -> None:
        """Store the clock of the log, the ages of the samples, and the counts of held samples."""
        times = {
            "log_time": run["time"].values + self.instants.offsets,
            "image_age": images.ages,
            "command_age": self._command_ages(),
        }
        for name, seconds in times.items():
            if len(seconds):
                dimensions = ("time", "mark")[: seconds.ndim]
                run[name] = dimensions, seconds, {"units": "s", "long_name": LONG_NAMES[name]}
        run["interpolated"] = "time", ~self.instants.measured, {"long_name": INTERPOLATED}
        is_held = (np.diff(images.images, axis=0) == 0).any(axis=1)
        run.attrs |= {
            "recorded_from": str(self.instants.nominal[0]),
            "interpolated_joints": int((~self.instants.measured).sum()),
            "held_images": int(is_held.sum()),
            "held_commands": int((np.diff(self.command_index, prepend=-1) == 0).sum()),
        }

    def _command_ages(self) -> Array:
        """Return the ages (T,) of the commands in seconds, NaN before the first command."""
        if self.log.commands is None:
            return np.empty(0)
        ages = (self.clock - self.log.commands.times[self.command_index]) / NANO
        return np.where(self.command_index < 0, np.nan, ages)


def _fill_recorder(loop: Loop, parts: list[Array], small: NDArray[np.bool_]) -> None:
    """Fill the record of a loop from a log, as a simulation would fill it."""
    series = np.concatenate(parts, axis=1)
    widths = (
        *(part.shape[1] for part in parts),
        *(0,) * 6,
    )  # no pictures, no constraints, no drives
    loop.recorder = Recorder(1, len(series) - 1, "all", widths)
    loop.recorder.table[0] = series
    outcome = Outcome.OUT_OF_IMAGE if _lacks_marks(loop, parts[4][-1]) else Outcome.RUNNING
    outcome = Outcome.CONVERGED if small[-1] else outcome
    loop.hold = outcome is Outcome.CONVERGED and bool(small[:-1].any())
    ends = _measure_path_length(loop, parts[0]), -1.0, len(series) - 1, outcome
    loop.recorder.ends[0] = [*series[-1], *ends]


def _is_error_small(loop: Loop, errors: Array, pixels: Array) -> NDArray[np.bool_]:
    """Return a mask (T,) of the periods with errors (T, k) below the tolerances.

    In the last period no mark of the pixels (T, N, 2) may be missing.
    """
    controller = loop.controller
    scaled = errors * controller.tolerance_scale
    small = np.abs(scaled).max(axis=1, initial=0.0) < controller.tolerance
    small[-1] &= not _lacks_marks(loop, pixels[-1])
    return np.asarray(small)


def _find_settling_period(small: NDArray[np.bool_]) -> int:
    """Return the first period of the last sequence with small errors."""
    return int(np.flatnonzero(~small).max(initial=-1)) + 1


def _lacks_marks(loop: Loop, pixels: Array) -> bool:
    """Return whether marks that must not leave the image are missing in pixels (N, 2) or (2 N,)."""
    controller = loop.controller
    sights = ((sight.key not in controller.optional_pairs, sight) for sight in controller.sights)
    needed = [must for must, sight in sights for _ in range(2 * len(sight.target.marks))]
    return bool((np.isnan(pixels.ravel()) & np.array(needed, dtype=bool)).any())


def _measure_path_length(loop: Loop, q: Array) -> float:
    """Return the path length of the moving frame in metres, as the sum of chords."""
    path = compute_moving_pose(loop.controller, move_runs_last(q, 1))[:, 3]
    return float(euclidean_length(np.diff(path, axis=1)).sum())
