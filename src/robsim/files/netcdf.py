"""Runs as NetCDF-4 files, saved and opened."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import xarray as xr

from robsim.base.errors import FileError, InputError, said
from robsim.files.table import Run

TITLES = ("RobSim run", "RobSim mission")


def save_run(run: xr.Dataset, path: str | os.PathLike[str]) -> Path:
    """Write a run as NetCDF-4; the file appears only once it is complete.

    FileError: it cannot be written there.

    >>> from robsim import load_scenario
    >>> from robsim.files import examples
    >>> run = load_scenario(examples.path("visp_tutorial")).run(duration=0.4)
    >>> open_run(save_run(run, "run.nc")).identical(run)
    True
    """
    if not isinstance(run, xr.Dataset):
        raise InputError(f"expected a run, a Dataset of simulate, got {said(run)}")
    try:
        target = Path(path)
        if not target.name:
            raise IsADirectoryError("it is a folder")
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent, prefix=".robsim-") as folder:
            draft = Path(folder) / target.name
            run.to_netcdf(draft, engine="h5netcdf")
            draft.replace(target)
    except (OSError, TypeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FileError(f"cannot write {path}: {reason}") from None
    return target


def open_run(path: str | os.PathLike[str]) -> xr.Dataset:
    """Return a run that `save_run` wrote. FileError: missing, or not a run.

    >>> open_run("nothing.nc")
    Traceback (most recent call last):
    ...
    robsim.base.errors.FileError: no file nothing.nc
    """
    try:
        exists = Path(path).is_file()
    except (OSError, TypeError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FileError(f"cannot read {path}: {reason}") from None
    if not exists:
        raise FileError(f"no file {path}")
    try:
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as data:
            run = Run(data.load().data_vars, data.coords, data.attrs)
    except (OSError, RuntimeError, KeyError, TypeError, ValueError) as error:
        raise FileError(f"{path} is not a NetCDF-4 file: {error}") from None
    if run.attrs.get("title") not in TITLES:
        raise FileError(f"{path} is not a run that RobSim saved")
    return run
