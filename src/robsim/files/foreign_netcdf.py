"""Run files without a seal, read in a separate process: HDF5 may hang or crash on them."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from robsim.base.errors import FileError

PATIENCE = 30.0  # time limit in seconds, plus as much for each GB
MEMORY = 4 << 30  # memory limit in bytes, plus 8 for each byte of the file
_CODE = (
    "import sys; sys.path[:] = sys.argv[2:]; from robsim.files import foreign_netcdf; "
    "foreign_netcdf.write_sealed_copy(sys.argv[1])"
)


def make_sealed_copy(path: str | os.PathLike[str]) -> bytes:
    """Return the content of a run file, with a seal; FileError if it is not a run."""
    patience = PATIENCE * (1.0 + os.path.getsize(path) / 1e9)
    command = [sys.executable, "-c", _CODE, os.path.abspath(path), *filter(None, sys.path)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=patience, check=False)
    except subprocess.TimeoutExpired:
        raise FileError(f"reading it took more than {patience:.0f} s") from None
    if done.returncode == 2:
        raise FileError(done.stdout.decode(errors="replace"))
    if done.returncode != 0:
        raise FileError(f"HDF5 could not read it, and ended with {done.returncode}")
    return done.stdout


def write_sealed_copy(path: str) -> None:
    """Write the sealed copy of a file to stdout; on failure write the reason and exit with 2."""
    from robsim.files.netcdf import seal_run

    _limit_memory(path)
    out = sys.stdout.buffer
    try:
        with seal_run(_load_foreign_dataset(path)).getbuffer() as content:
            out.write(content)
    except Exception as error:  # noqa: BLE001  any error of HDF5 and its readers
        out.write(f"{error!s:.500}".encode(errors="replace"))
        sys.exit(2)


def _limit_memory(path: str) -> None:
    with suppress(ImportError, OSError, ValueError):  # on systems without such a limit
        import resource

        most = MEMORY + 8 * os.path.getsize(path)
        resource.setrlimit(resource.RLIMIT_AS, (most, most))


def _load_foreign_dataset(path: str) -> Any:
    import xarray as xr

    _check_hdf5_content(Path(path))
    with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as data:
        return data.load()


def _check_hdf5_content(path: Path) -> None:
    """Raise ValueError unless a file has only numbers and texts, in all at most its own size."""
    import h5py

    left = path.stat().st_size
    with h5py.File(path, "r") as file:
        for name in file:
            if not isinstance(file.get(name, getlink=True), h5py.HardLink):
                raise ValueError(f"{name!s:.80} is a link")
            left -= _get_variable_size(name, file[name])
            if left < 0:
                raise ValueError("its variables are larger than the file")


def _get_variable_size(name: str, stored: Any) -> int:
    """Return the size of a variable in bytes; ValueError if a run cannot contain it."""
    import h5py

    if not isinstance(stored, h5py.Dataset):
        raise ValueError(f"{name!s:.80} is not a variable")
    if stored.external or stored.is_virtual:
        raise ValueError(f"{name!s:.80} is in another file")
    if stored.id.get_create_plist().get_nfilters():
        raise ValueError(f"{name!s:.80} is compressed")
    if stored.id.get_type().get_class() not in (h5py.h5t.INTEGER, h5py.h5t.FLOAT, h5py.h5t.STRING):
        raise ValueError(f"{name!s:.80} holds neither numbers nor texts")
    return int(stored.size) * int(stored.dtype.itemsize)
