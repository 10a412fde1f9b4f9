"""A run from a log: the recorded signals, resampled to control periods."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, euclidean_length, move_runs_last
from robsim.base.errors import FileError
from robsim.engine.loop import Loop
from robsim.engine.outcome import Outcome
from robsim.engine.recorder import Recorder
from robsim.files.flat_table import RunDataset
from robsim.run.control.standalone_controller import Controller
from robsim.run.end_variables import compute_moving_pose
from robsim.run.experiment import Experiment
from robsim.run.log import NANO, Log, Times, hold_marks
from robsim.run.log_commands import LOG_ATTRIBUTE, compute_decisions
from robsim.run.provenance import compute_whole_duration
from robsim.servo.command import Decision

LONGEST = 1_000_000  # largest number of periods, which take minutes
SILENCE = 600 * NANO  # longest gap between two joint states; a longer gap is a clock error
CONVERGED_AT = "converged_at"  # attribute of a log that converged: seconds until convergence
AGE = {"units": "s", "long_name": "age of the last image that was searched for a mark"}


def make_run_from_log(log: Log, experiment: Experiment) -> RunDataset:
    """Return the run of a log, with the variables of a simulated run and `image_age`.

    Each period has the last joints, images and commands before it (zero-order hold). The run begins
    when all joints and marks have been observed once; each mark then has its last observed pixels.
    The run ends with the last joint state. The experiment's controller computes features and
    errors. The outcome is CONVERGED, OUT_OF_IMAGE or RUNNING, according to the last instant; if the
    log has the phases of its controller, it is CONVERGED if and only if the last phase is.

    Raise FileError if the log is shorter than a period, too long, or has a long gap.
    """
    controller = Controller(experiment)
    times = _compute_period_times(log, experiment.dt)
    q, (pixels, ages) = log.joints.held(times), _sample_images(log, controller, times)
    seconds = compute_whole_duration(len(times) - 1, experiment.dt)
    log_experiment = replace(experiment, start=q[0], duration=seconds, record="all", first_run=0)
    decided = compute_decisions(log_experiment, q, pixels, ages)
    command_source, qd = _sample_commands(log, times, q, experiment)
    rates = np.empty((len(q), 0)) if log.rates is None else log.rates.held(times)
    s = np.array([each.command.s[:, 0] for each in decided])
    loop = log_experiment.loop()
    weights = [np.empty(0) if each.weights is None else each.weights[:, 0] for each in decided]
    small = _is_error_small(loop, decided)
    if log.activity is not None:
        small = log.activity.flag_convergence(times)
    _fill_recorder(loop, [q, qd, rates, s, pixels.reshape(len(q), -1), np.array(weights)], small)
    run = log_experiment.dataset(loop)
    if int(run["outcome"]) == Outcome.CONVERGED:
        run.attrs[CONVERGED_AT] = float(run["time"].values[_find_settling_period(small)])
    if log.activity is not None:
        run.update(log.activity.variables(times))
    run["image_age"] = (("time", "mark"), ages, AGE)
    run.attrs |= {
        LOG_ATTRIBUTE: log.source,
        "commands": command_source,
        "recorded_from": str(times[0]),
    }
    run.attrs |= dict(log.notes)
    return run


def _sample_images(log: Log, controller: Controller, times: Times) -> tuple[Array, Array]:
    """Return pixels (T, N, 2) and ages in seconds (T, N) of the marks of all cameras."""
    pixels, ages = [np.empty((len(times), 0, 2))], [np.empty((len(times), 0))]
    for sight in controller.sights:
        images = log.images[sight.key]
        pixels.append(hold_marks(images, times))
        age = images.ages(images.index(times), times)
        ages.append(np.repeat(age[:, None], len(sight.target.marks), axis=1))
    return np.concatenate(pixels, axis=1), np.concatenate(ages, axis=1)


def _compute_period_times(log: Log, dt: float) -> Times:
    """Return the times (T,) of the periods of a log, in nanoseconds."""
    seconds = (int(log.joints.times[-1]) - log.first) / NANO
    steps = math.floor(seconds / dt + 1e-6)
    if steps < 1:
        raise FileError(
            f"{log.source}: joints and all marks are known for {max(seconds, 0.0):g} s, "
            f"which is less than a period of {dt:g} s"
        )
    silent = np.flatnonzero(np.diff(log.joints.times) > SILENCE)
    if silent.size:
        before, after = log.joints.times[silent[0] : silent[0] + 2] / NANO
        raise FileError(f"{log.joints.what}: nothing between {before:.9g} s and {after:.9g} s")
    if steps > LONGEST:
        raise FileError(f"{log.source}: {steps} periods of {dt:g} s; at most {LONGEST} are read")
    times: Times = log.first + np.round(np.arange(steps + 1) * dt * NANO).astype(np.int64)
    return times


def _sample_commands(log: Log, times: Times, q: Array, experiment: Experiment) -> tuple[str, Array]:
    """Return the source of the commanded velocities as a text, and the velocities (T, nv)."""
    if log.commands is not None:
        return log.commands.what, log.commands.held(times)
    if log.rates is not None:
        return f"none; velocities are those of {log.rates.what}", log.rates.held(times)
    scene = experiment.scene
    qd = np.zeros((len(q), scene.nv))
    if scene.velocity_names != scene.coordinate_names:
        return "none; velocities are zero", qd
    qd[:-1] = np.diff(q, axis=0) / experiment.dt
    return "none; velocities are differences of the joints", qd


def _fill_recorder(loop: Loop, parts: list[Array], small: NDArray[np.bool_]) -> None:
    """Fill the record of a loop from a log, as a simulation would fill it."""
    series = np.concatenate(parts, axis=1)
    loop.recorder = Recorder(1, len(series) - 1, "all", tuple(part.shape[1] for part in parts))
    loop.recorder.table[0] = series
    outcome = _classify_log_end(loop, parts[4], bool(small[-1]))
    loop.hold = outcome is Outcome.CONVERGED and bool(small[:-1].any())
    ends = _measure_path_length(loop, parts[0]), -1.0, len(series) - 1, outcome
    loop.recorder.ends[0] = [*series[-1], *ends]


def _is_error_small(loop: Loop, decided: list[Decision]) -> NDArray[np.bool_]:
    """Return a mask (T,) of the periods with an error below the tolerance."""
    controller = loop.controller
    errors = [controller.scale_to_tolerances(each).command.error for each in decided]
    return np.array([np.abs(e).max(initial=0.0) < controller.tolerance for e in errors])


def _find_settling_period(small: NDArray[np.bool_]) -> int:
    """Return the first period of the last sequence with small errors."""
    return int(np.flatnonzero(~small).max(initial=-1)) + 1


def _classify_log_end(loop: Loop, pixels: Array, is_small: bool) -> Outcome:
    """Return the outcome of a log, according to its last instant."""
    controller = loop.controller
    sights = ((sight.key not in controller.optional_pairs, sight) for sight in controller.sights)
    needed = [must for must, sight in sights for _ in range(2 * len(sight.target.marks))]
    if (np.isnan(pixels[-1]) & np.array(needed, dtype=bool)).any():
        return Outcome.OUT_OF_IMAGE
    return Outcome.CONVERGED if is_small else Outcome.RUNNING


def _measure_path_length(loop: Loop, q: Array) -> float:
    """Return the path length of the moving frame in metres, as the sum of chords."""
    path = compute_moving_pose(loop.controller, move_runs_last(q, 1))[:, 3]
    return float(euclidean_length(np.diff(path, axis=1)).sum())
