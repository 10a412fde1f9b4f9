"""Conversion of runs to ROS 2 bags."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

import numpy as np
import xarray as xr

from robsim.base.arrays import as_float
from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import InputError, check_known, format_value
from robsim.logs import message_types
from robsim.logs.bag_draft import PLUGINS, BagDraft
from robsim.logs.run_messages import generate_messages
from robsim.run.experiment import Experiment
from robsim.run.log import NANO
from robsim.run.provenance import check_run
from robsim.run.run_checks import check_instance


def write_bag(
    run: xr.Dataset,
    path: str | os.PathLike[str],
    experiment: Experiment | None = None,
    *,
    storage: Literal["mcap", "sqlite3"] = "mcap",
    start: float = 0.0,
) -> Path:
    """Write a single run as a ROS 2 bag, and return its path.

    If the path ends with .mcap or .db3, the bag is a single file. Any other path is a new folder in
    the format of `ros2 bag`. A bag that is not complete does not appear at the path. The function
    needs the extra `ros` (rosbags). The topics are

    - /joint_states, JointState: coordinates, with velocities if they have the same names,
    - /joint_commands, JointState: commanded velocities, or torques as efforts,
    - /CAMERA/detections, Detection2DArray: marks in pixels, with the ids TARGET.NUMBER,
    - /CAMERA/camera_info, CameraInfo: intrinsics and distortion,
    - /tf and /tf_static, TFMessage: poses of all frames of the scene in the frame "world",
    - /robsim/experiment, String: the experiment as TOML, which `read_bag` reads.

    Parameters
    ----------
    run : xarray.Dataset
        Single run with all its instants.
    path : path_like
        File or folder to write.
    experiment : Experiment, optional
        Experiment of the run, needed if the run does not contain it.
    storage : {"mcap", "sqlite3"}, default "mcap"
        Storage format of a folder.
    start : float, default 0
        Time of the first instant in seconds since 1970.

    Returns
    -------
    Path
        Path of the bag.

    Raises
    ------
    InputError
        If `run` is not a single run with its instants, or rosbags is not installed.
    FileError
        If the bag cannot be written.

    Examples
    --------
    >>> write_bag(3, "run.mcap")
    Traceback (most recent call last):
    ...
    robsim.base.errors.InputError: expected a run, ...
    """
    single_run = _select_single_run(run)
    source = Experiment.of(single_run) if experiment is None else experiment
    check_instance(source, Experiment, "experiment")
    check_known(storage, PLUGINS, "no storage {}", "storages")
    first = as_float(start, "start (seconds)")
    if not 0.0 <= first < message_types.LATEST - float(single_run["time"].values[-1]):
        raise InputError(f"start: expected seconds since 1970, got {format_value(start)}")
    message_types.load_typestore()
    target = Path(path)
    with convert_os_errors(path), BagDraft(target, storage) as draft:
        for each in generate_messages(single_run, source, round(first * NANO)):
            draft.topics.write(*each)
    return target


def _select_single_run(run: xr.Dataset) -> xr.Dataset:
    """Return a single run up to its end; raise InputError for several runs or a summary."""
    check_run(run)
    if run.sizes.get("run", 1) != 1:
        raise InputError(
            f"a bag stores a single run, got {run.sizes['run']}: select one by run.isel(run=0)"
        )
    single_run: xr.Dataset = run.squeeze("run") if "run" in run.dims else run
    if "time" not in single_run.dims or "q" not in single_run:
        raise InputError("only the end of this run was recorded: simulate it with record='all'")
    before_end = np.isfinite(single_run["q"].values).all(axis=1)
    return single_run.isel(time=slice(0, int(before_end.sum())))
