"""Run files: NetCDF-4 files with a checksum."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import numpy as np
import xarray as xr

from robsim.base.arrays import as_bool
from robsim.base.atomic_files import check_suffix, convert_os_errors, write_whole
from robsim.base.errors import FileError, InputError, format_value
from robsim.base.file_content import check_regular_file, open_regular_file
from robsim.container import ContainerError, append_seal, read_header
from robsim.files import run_index
from robsim.files.flat_table import RunDataset
from robsim.files.foreign_netcdf import make_sealed_copy
from robsim.files.run_schema import TITLES, check_run_content

EXPECTED = "a run, a NetCDF-4 file"
SIGNATURE = b"\x89HDF\r\n\x1a\n"
READERS = {
    **dict.fromkeys((".mcap", ".db3", ".zstd"), "rs.logs.read_bag(path)"),
    **dict.fromkeys((".csv", ".parquet"), "rs.logs.read_log(path, experiment)"),
}
TRUST = "open_run(path, unsealed=True), or robsim explain --unsealed, reads it without a check"


def save_run(run: xr.Dataset, path: str | os.PathLike[str]) -> Path:
    """Save a run as a NetCDF-4 file with a checksum.

    Other programs can read the file as NetCDF-4. It appears under its name only when it is
    complete.

    Parameters
    ----------
    run : xarray.Dataset
        Run of `simulate` or `Experiment.run`, or the `run` of a mission or of one of its legs.
    path : str or path
        File name that ends in .nc. Missing folders are created.

    Returns
    -------
    pathlib.Path
        The path.

    Raises
    ------
    FileError
        If the name has another suffix, the file cannot be written, or `open_run` would reject it.

    Examples
    --------
    >>> from robsim import load_scenario
    >>> from robsim.files import examples
    >>> run = load_scenario(examples.path("visp_tutorial")).run(duration=0.4)
    >>> open_run(save_run(run, "run.nc")).identical(run)
    True
    """
    if not isinstance(run, xr.Dataset):
        raise InputError(f"expected a run, a Dataset of simulate, got {format_value(run)}")
    check_suffix(path, (".nc",), "a run; robsim.logs.to_table makes a table of it")
    with convert_os_errors(path), seal_run(run).getbuffer() as content:
        return write_whole(path, content)


def open_run(path: str | os.PathLike[str], *, unsealed: bool = False) -> RunDataset:
    """Return a run from a file of `save_run`, after a check of its checksum.

    Parameters
    ----------
    path : str or path
        File name.
    unsealed : bool, default False
        Whether to accept a file without a valid checksum: a file of an earlier version or of
        another program, or one that was changed.

    Returns
    -------
    xarray.Dataset
        The run.

    Raises
    ------
    FileError
        If the file is missing, changed, or not a run.

    Examples
    --------
    >>> open_run("nothing.nc")
    Traceback (most recent call last):
    ...
    robsim.base.errors.FileError: nothing.nc: no such file
    """
    as_bool(unsealed, "unsealed")
    check_regular_file(path, EXPECTED)
    run = _read_foreign_file(path) if unsealed else _read_sealed_file(path)
    try:
        check_run_content(run)
    except ValueError as problem:
        raise FileError(f"{path} is not a run that RobSim saved: {problem}") from None
    return run


def seal_run(run: xr.Dataset) -> BytesIO:
    """Return the content of a run file; ValueError or TypeError if it cannot be written."""
    if run.attrs.get("title") in TITLES:
        check_run_content(run)
    entries = [run_index.IndexEntry.of(name, variable) for name, variable in run.variables.items()]
    content = BytesIO()
    entries = list(_write_netcdf(run, entries, content))
    run_index.check_entry_sizes(entries, content.getbuffer().nbytes)
    append_seal(content, run_index.write_index(entries, run))
    return content


def _write_netcdf(
    run: xr.Dataset, entries: list[run_index.IndexEntry], content: BytesIO
) -> Iterator[run_index.IndexEntry]:
    """Write NetCDF-4 in memory, because HDF5 crashes on a full disk; yield entries with offsets.

    ValueError is raised if HDF5 stores a variable in another form.
    """
    import h5py

    from robsim.files.netcdf_layout import write_variables

    with h5py.File(content, "w", track_order=True) as file:
        versions = f"version=2,h5py={h5py.version.version},hdf5={h5py.version.hdf5_version}"
        file.attrs["_NCProperties"] = np.bytes_(versions)
        stored = write_variables(run, file)
        for entry in entries:
            place = stored[entry.name]
            if entry.bytes not in (0, place.get_storage_size()):
                raise ValueError(f"{entry.name}: not written in one piece")
            yield replace(entry, offset=place.get_offset() or 0)


def _read_sealed_file(path: str | os.PathLike[str]) -> RunDataset:
    """Return the Dataset of a file with a checksum."""
    with convert_os_errors(path, "read"), open_regular_file(path, EXPECTED) as file:
        try:
            return _read_dataset(file)
        except ContainerError as error:
            if error.is_incomplete and not _is_netcdf(file):
                raise _make_no_run_error(path) from None
            raise FileError(f"{path} {error}; {TRUST}") from None


def _read_dataset(file: BinaryIO) -> RunDataset:
    """Return the Dataset of an open file; ContainerError if it has no valid seal."""
    size, header = read_header(file)
    try:
        entries, coordinates, attributes = run_index.read_index(header, size)
        variables = {each.name: each.variable(file) for each in entries}
        coordinate_variables = {name: variables.pop(name) for name in coordinates}
        return RunDataset(variables, coordinate_variables, attributes)
    except (ValueError, TypeError, KeyError, OverflowError) as error:
        raise ContainerError(f"has a seal that does not describe a run: {error!s:.200}") from None


def _read_foreign_file(path: str | os.PathLike[str]) -> RunDataset:
    """Return the Dataset of a file from an untrusted source."""
    with convert_os_errors(path, "read"), open_regular_file(path, EXPECTED) as file:
        if not _is_netcdf(file):
            raise _make_no_run_error(path)
    try:
        return _read_dataset(BytesIO(make_sealed_copy(path)))
    except FileError as error:
        raise FileError(f"{path} cannot be read as a run: {error}") from None


def _make_no_run_error(path: str | os.PathLike[str]) -> FileError:
    """Return the error about a file that is not a run; for a log it names the reader."""
    suffix, hint = Path(path).suffix.lower(), ""
    if suffix == ".toml":
        return FileError(
            f"{path} is not a run but a TOML file: simulate it (robsim run {path}), and give the "
            "run.nc of its results"
        )
    if suffix in READERS:
        hint = f"; {READERS[suffix]} makes a run of such a log, and save_run its run.nc"
    return FileError(f"{path} is not a NetCDF-4 file{hint}")


def _is_netcdf(file: BinaryIO) -> bool:
    file.seek(0)
    return file.read(len(SIGNATURE)) == SIGNATURE
