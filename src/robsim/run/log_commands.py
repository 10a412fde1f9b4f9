"""What a controller commands of images and joints that were recorded."""

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

LOG_ATTRIBUTE = "recorded"  # the attribute of a run that says of which log it was made
LOG_INTRINSICS = "recorded_K_"  # with the name of a camera behind it: its intrinsics in the log


def is_log_run(run: xr.Dataset) -> bool:
    """Return whether a run was made of a log, and not simulated."""
    return LOG_ATTRIBUTE in run.attrs


def compute_decisions(
    experiment: Experiment, q: Array, pixels: Array, ages: Array | None = None
) -> list[Decision]:
    """Return what is decided of coordinates (T, nq) and pixels (T, N, 2), one period each.

    Marks that are NaN are held where they were seen last, as by `Controller.step`. The ages (T, N)
    of the images are in seconds; None: they are new.
    """
    controller = Controller(experiment)
    last = np.cumsum([len(sight.target.marks) for sight in controller.sights]).tolist()
    own = {s.key: slice(i, j) for s, i, j in zip(controller.sights, [0, *last], last, strict=False)}
    found = []
    for step, row in enumerate(q):
        t = step * controller.dt
        old = {key: 0.0 if ages is None else ages[step, some].max() for key, some in own.items()}
        seen = {key: Marks(pixels[step, some], t - old[key]) for key, some in own.items()}
        found.append(controller.decide(seen, row, t))
    return found


def recompute_commands(run: xr.Dataset, experiment: Experiment) -> tuple[NDArray[np.int64], Array]:
    """Return which velocities are commanded, and what the controller commands of them (T, n).

    InputError: the run is of another scene.
    """
    controller = Controller(experiment)
    if run["coordinate"].values.tolist() != list(experiment.scene.coordinate_names):
        raise InputError("the run was recorded of another scene than that of the experiment")
    names = run["velocity"].values.tolist()
    columns = np.array([names.index(name) for name in controller.velocity_names], dtype=np.int64)
    ages = run["image_age"].values if "image_age" in run else None
    made = compute_decisions(experiment, run["q"].values, run["pixels"].values, ages)
    return columns, np.array([each.command.qd[:, 0] for each in made])


def replay_log_run(run: xr.Dataset) -> xr.Dataset:
    """Return a recorded run with the commands of its controller for the same images and joints.

    A ReplayWarning says by how much the recorded ones differ.
    """
    columns, qd = recompute_commands(run, Experiment.of(run))
    again = run.copy(deep=True)
    again["qd"].values[:, columns] = qd
    away = np.abs(again["qd"].values - run["qd"].values)
    if (away > 0).any():
        step, joint = np.unravel_index(int(np.argmax(away)), away.shape)
        name, seconds = run["velocity"].values[joint], run["time"].values[step]
        text = (
            f"the recorded commands are not those of the controller: {name} is off by up to "
            f"{away.max():.3g}, at {seconds:.6g} s"
        )
        warnings.warn(text, ReplayWarning, stacklevel=find_user_stacklevel())
    return again
