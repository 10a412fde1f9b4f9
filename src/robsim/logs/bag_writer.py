"""Conversion of runs to ROS 2 bags."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import xarray as xr

from robsim.base.arrays import as_float
from robsim.base.atomic_files import convert_os_errors, write_whole
from robsim.base.errors import FileError, InputError, check_known, format_value
from robsim.logs import message_types, topics
from robsim.logs.mcap_checksums import add_mcap_checksums
from robsim.logs.run_messages import TopicMessage, generate_messages
from robsim.run.experiment import Experiment
from robsim.run.log import NANO
from robsim.run.provenance import check_run
from robsim.run.run_checks import check_instance

PLUGINS = {"mcap": ".mcap", "sqlite3": ".db3"}
LATCHED = (topics.STATIC_FRAMES, topics.EXPERIMENT)  # topics kept for late subscribers
VERSION: Final = 8  # of the bag format


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
    with convert_os_errors(path):
        return _write_bag(
            Path(path), storage, generate_messages(single_run, source, round(first * NANO))
        )


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


def _write_bag(path: Path, storage: str, outbound: Iterator[TopicMessage]) -> Path:
    """Write a bag to a temporary folder and move it to its path."""
    is_file = path.suffix in PLUGINS.values()
    if is_file:
        storage = next(name for name, suffix in PLUGINS.items() if suffix == path.suffix)
    elif path.exists():
        raise FileError(f"{path} exists already; a bag needs a new folder")
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = Path(tempfile.mkdtemp(prefix=".robsim-", dir=path.parent))
    try:
        folder = draft / path.name
        _write_messages(folder, storage, outbound)
        if storage == "mcap":
            add_mcap_checksums(folder / f"{folder.name}.mcap")
        if is_file:
            return write_whole(path, (folder / f"{folder.name}{path.suffix}").read_bytes())
        folder.rename(path)
    finally:
        with suppress(OSError):
            shutil.rmtree(draft)
    return path


def _write_messages(folder: Path, storage: str, outbound: Iterator[TopicMessage]) -> None:
    """Write messages into a new folder."""
    from rosbags.rosbag2 import StoragePlugin, Writer

    store = message_types.load_typestore()
    plugin = StoragePlugin[storage.upper()]
    with Writer(folder, version=VERSION, storage_plugin=plugin) as writer:
        connections: dict[str, Any] = {}
        for topic, kind, time, message in outbound:
            if topic not in connections:
                profiles = [_latched_qos()] if topic in LATCHED else []
                connections[topic] = writer.add_connection(
                    topic, kind, typestore=store, offered_qos_profiles=profiles
                )
            writer.write(connections[topic], time, store.serialize_cdr(message, kind))


def _latched_qos() -> Any:
    """Return the quality of service of a topic with a message for late subscribers."""
    from rosbags import interfaces as of

    never = of.QosTime(2147483647, 4294967295)
    return of.Qos(
        of.QosHistory.KEEP_LAST,
        1,
        of.QosReliability.RELIABLE,
        of.QosDurability.TRANSIENT_LOCAL,
        never,
        never,
        of.QosLiveliness.AUTOMATIC,
        never,
        False,
    )
