"""The commands of a controller for recorded images and joint coordinates."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from itertools import repeat
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, ReplayWarning
from robsim.base.unit_warnings import find_user_stacklevel
from robsim.run.control.mark_input import MarkObservation
from robsim.run.control.standalone_controller import Controller
from robsim.run.experiment import Experiment
from robsim.run.log import NANO, Times
from robsim.servo.command import Signals

if TYPE_CHECKING:
    import xarray as xr

LOG_ATTRIBUTE = "recorded"  # attribute of a run: its log
LOG_INTRINSICS = "recorded_K_"  # followed by the name of a camera: its intrinsics in the log


def is_log_run(run: xr.Dataset) -> bool:
    """Return whether a run was made from a log, not simulated."""
    return LOG_ATTRIBUTE in run.attrs


class ImageTimes(NamedTuple):
    """The instants (T,) of a log and the times (T, N) of the images of marks, in nanoseconds."""

    instants: Times
    images: Times

    @property
    def ages(self) -> Array:
        """The ages (T, N) of the images in seconds, negative if an image is a little later."""
        return np.asarray((self.instants[:, None] - self.images) / NANO)

    @classmethod
    def of(cls, run: xr.Dataset) -> ImageTimes | None:
        """Return the clock of a run from a log, or None for a simulated run."""
        if "log_time" not in run:
            return None
        seconds = run["log_time"].values
        instants, ages = (
            np.rint(x * NANO).astype(np.int64) for x in (seconds, run["image_age"].values)
        )
        return cls(instants, instants[:, None] - ages)


class _LogController(Controller):
    """A controller that computes signals without the health of its commands."""

    def compute_period(self, observed: Iterable[MarkObservation], q: Array, t: float) -> Signals:
        """Return the signals of `decide` at the start of a period, for images with NaN as gaps.

        They are zero until enough marks have been seen.
        """
        self._clock.advance(t)
        self._q, now = self._joints(q), self._clock.now
        self._images.store_joints(self._q, now)
        self._images.store(observed, self._q, now)
        if self._images.are_known:
            self._perform(True, self._images.age(now))
        return self._standalone.outputs.read_signals(self._blocks)


def compute_signals(
    experiment: Experiment, q: Array, pixels: Array, clock: ImageTimes | None = None
) -> Signals:
    """Return the signals for coordinates (T, nq) and pixels (T, N, 2), one row per period.

    A mark with NaN pixels keeps its last observed pixels, as in `Controller.step`. The controller
    has instants at multiples of its period, and images of the ages in `clock`; an image that is
    held has one time. None means that all images are new.
    """
    controller = _LogController(experiment)
    times = controller.dt * np.arange(len(q), dtype=np.float64)
    stamps = _stamp_images(clock, times, pixels.shape[1])
    finite = np.where(np.isfinite(pixels), pixels, np.nan)
    images, first = [], 0
    for sight in controller.sights:
        own = slice(first, first := first + len(sight.target.marks))
        taken = zip(finite[:, own], stamps[:, own].min(axis=1).tolist(), strict=True)
        images.append([MarkObservation(sight, *each) for each in taken])
    observed = zip(*images, strict=True) if images else repeat((), len(q))
    rows = map(controller.compute_period, observed, q, times.tolist())
    return Signals(*map(np.array, zip(*rows, strict=True)))


def _stamp_images(clock: ImageTimes | None, times: Array, marks: int) -> Array:
    """Return the times (T, N) of images on the clock of a controller with instants (T,) in seconds.

    They are at most the instants, and increase where an image is new.
    """
    stamps = np.repeat(times[:, None], marks, axis=1)
    if clock is None:
        return stamps
    stamps -= np.maximum(clock.ages, 0.0)
    held = np.diff(clock.images, axis=0) == 0
    for i, is_held in enumerate(held, start=1):
        stamps[i] = np.where(
            is_held, stamps[i - 1], np.maximum(stamps[i], np.nextafter(stamps[i - 1], np.inf))
        )
    return stamps


def recompute_commands(run: xr.Dataset, experiment: Experiment) -> tuple[NDArray[np.int64], Array]:
    """Return the columns of the commanded velocities, and the commands (T, n).

    Raise InputError if the run was recorded with another scene.
    """
    controller = Controller(experiment)
    if run["coordinate"].values.tolist() != list(experiment.scene.coordinate_names):
        raise InputError("the scene of the recorded run differs from the scene of the experiment")
    names = run["velocity"].values.tolist()
    columns = np.array([names.index(name) for name in controller.velocity_names], dtype=np.int64)
    clock = ImageTimes.of(run)
    return columns, compute_signals(experiment, run["q"].values, run["pixels"].values, clock).qd


def replay_log_run(run: xr.Dataset) -> xr.Dataset:
    """Return a recorded run with recomputed commands for the same images and joints.

    A ReplayWarning gives the largest deviation of the recorded commands.
    """
    columns, qd = recompute_commands(run, Experiment.of(run))
    again = run.copy(deep=True)
    again["qd"].values[:, columns] = qd
    away = np.abs(again["qd"].values - run["qd"].values)
    if (away > 0).any():
        step, joint = np.unravel_index(int(np.argmax(away)), away.shape)
        name, seconds = run["velocity"].values[joint], run["time"].values[step]
        text = (
            f"the recorded commands differ from the controller's: {name} by up to "
            f"{away.max():.3g}, at {seconds:.6g} s"
        )
        warnings.warn(text, ReplayWarning, stacklevel=find_user_stacklevel())
    return again
