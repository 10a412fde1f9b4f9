"""The commands of a controller for recorded images and joint coordinates."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, ReplayWarning
from robsim.base.unit_warnings import find_user_stacklevel
from robsim.run.control.mark_input import Marks
from robsim.run.control.standalone_controller import Controller
from robsim.run.experiment import Experiment
from robsim.servo.command import Decision

if TYPE_CHECKING:
    import xarray as xr

LOG_ATTRIBUTE = "recorded"  # attribute of a run: its log
LOG_INTRINSICS = "recorded_K_"  # followed by the name of a camera: its intrinsics in the log


def is_log_run(run: xr.Dataset) -> bool:
    """Return whether a run was made from a log, not simulated."""
    return LOG_ATTRIBUTE in run.attrs


def compute_decisions(
    experiment: Experiment, q: Array, pixels: Array, ages: Array | None = None
) -> list[Decision]:
    """Return the decisions for coordinates (T, nq) and pixels (T, N, 2), one per period.

    A mark with NaN pixels keeps its last observed pixels, as in `Controller.step`. `ages` (T, N)
    are the ages of the images in seconds; None means that all images are new.
    """
    controller = Controller(experiment)
    last = np.cumsum([len(sight.target.marks) for sight in controller.sights]).tolist()
    own = {s.key: slice(i, j) for s, i, j in zip(controller.sights, [0, *last], last, strict=False)}
    decided = []
    for step, row in enumerate(q):
        t = step * controller.dt
        old = {key: 0.0 if ages is None else ages[step, some].max() for key, some in own.items()}
        seen = {key: Marks(pixels[step, some], t - old[key]) for key, some in own.items()}
        decided.append(controller.decide(seen, row, t))
    return decided


def recompute_commands(run: xr.Dataset, experiment: Experiment) -> tuple[NDArray[np.int64], Array]:
    """Return the columns of the commanded velocities, and the commands (T, n).

    Raise InputError if the run was recorded with another scene.
    """
    controller = Controller(experiment)
    if run["coordinate"].values.tolist() != list(experiment.scene.coordinate_names):
        raise InputError("the scene of the recorded run differs from the scene of the experiment")
    names = run["velocity"].values.tolist()
    columns = np.array([names.index(name) for name in controller.velocity_names], dtype=np.int64)
    ages = run["image_age"].values if "image_age" in run else None
    decided = compute_decisions(experiment, run["q"].values, run["pixels"].values, ages)
    return columns, np.array([each.command.qd[:, 0] for each in decided])


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
