"""Runs as ROS 2 bags."""

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
from robsim.logs.run_messages import TopicMessage, generate_messages
from robsim.run.experiment import Experiment
from robsim.run.log import NANO
from robsim.run.provenance import check_run
from robsim.run.run_checks import check_instance

PLUGINS = {"mcap": ".mcap", "sqlite3": ".db3"}
LATCHED = (topics.STATIC_FRAMES, topics.EXPERIMENT)  # what a late listener is given, too
LATEST = 2**31  # seconds that a stamp can hold
VERSION: Final = 8  # of the format of bags


def write_bag(
    run: xr.Dataset,
    path: str | os.PathLike[str],
    experiment: Experiment | None = None,
    *,
    storage: Literal["mcap", "sqlite3"] = "mcap",
    start: float = 0.0,
) -> Path:
    """Write a single run as a ROS 2 bag; it appears only once it is complete.

    A path that ends with .mcap or .db3 is one file; any other is a folder as `ros2 bag` has it,
    which must not exist. Stamps are those of the run, from `start` on (seconds). Topics:

    /joint_states        JointState: coordinates; velocities where they have the same names
    /joint_commands      JointState: the velocities that were commanded
    /CAMERA/detections   Detection2DArray: marks in pixels, called TARGET.NUMBER
    /CAMERA/camera_info  CameraInfo
    /tf, /tf_static      all frames of the scene, in "world"
    /robsim/experiment   String: the experiment as TOML, so that `read_bag` needs no other

    `experiment` is needed where the run cannot say it. `pip install 'robsim[ros]'`.

    InputError: no single run with its instants, or rosbags lacks; FileError: it cannot be written.

    >>> write_bag(3, "run.mcap")
    Traceback (most recent call last):
    ...
    robsim.base.errors.InputError: expected a run, a Dataset of simulate or open_run, got 3
    """
    one = _select_single_run(run)
    made = Experiment.of(one) if experiment is None else experiment
    check_instance(made, Experiment, "experiment")
    check_known(storage, PLUGINS, "no storage {}", "storages")
    first = as_float(start, "start (seconds)")
    if not 0.0 <= first < LATEST - float(one["time"].values[-1]):
        raise InputError(f"start: expected seconds since 1970, got {format_value(start)}")
    message_types.load_typestore()
    with convert_os_errors(path):
        return _write_bag(Path(path), storage, generate_messages(one, made, round(first * NANO)))


def _select_single_run(run: Any) -> xr.Dataset:
    """Return one run up to its end. InputError: several, a mission, or a summary."""
    check_run(run)
    if run.sizes.get("run", 1) != 1:
        raise InputError(f"a bag is of one run, and these are {run.sizes['run']}: run.isel(run=0)")
    one: xr.Dataset = run.squeeze("run") if "run" in run.dims else run
    if "time" not in one.dims or "q" not in one:
        raise InputError("only the end of this run was recorded: simulate it with record='all'")
    lived = np.isfinite(one["q"].values).all(axis=1)
    return one.isel(time=slice(0, int(lived.sum())))


def _write_bag(path: Path, storage: str, words: Iterator[TopicMessage]) -> Path:
    """Write a bag beside its place, and put it there."""
    alone = path.suffix in PLUGINS.values()
    if alone:
        storage = next(name for name, suffix in PLUGINS.items() if suffix == path.suffix)
    elif path.exists():
        raise FileError(f"{path} exists already; a bag is written into a new folder")
    path.parent.mkdir(parents=True, exist_ok=True)
    draft = Path(tempfile.mkdtemp(prefix=".robsim-", dir=path.parent))
    try:
        folder = draft / path.name
        _write_messages(folder, storage, words)
        if alone:
            return write_whole(path, (folder / f"{folder.name}{path.suffix}").read_bytes())
        folder.rename(path)
    finally:
        with suppress(OSError):
            shutil.rmtree(draft)
    return path


def _write_messages(folder: Path, storage: str, words: Iterator[TopicMessage]) -> None:
    from rosbags.rosbag2 import StoragePlugin, Writer

    store = message_types.load_typestore()
    plugin = StoragePlugin[storage.upper()]
    with Writer(folder, version=VERSION, storage_plugin=plugin) as writer:
        connections: dict[str, Any] = {}
        for topic, kind, time, message in words:
            if topic not in connections:
                how = [_latched_qos()] if topic in LATCHED else []
                connections[topic] = writer.add_connection(
                    topic, kind, typestore=store, offered_qos_profiles=how
                )
            writer.write(connections[topic], time, store.serialize_cdr(message, kind))


def _latched_qos() -> Any:
    """Return the quality of service of what is said once and kept for late listeners."""
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
