"""Files and folders that commands write: claimed by one process, never overwritten unasked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from robsim.base.claim import claimed
from robsim.base.errors import FileError
from robsim.base.output import refused

CHECKPOINT = "checkpoint"  # from which a run goes on that was stopped


@contextmanager
def results_folder(
    output: Path | None, name: str, force: bool, files: Sequence[str]
) -> Iterator[Path]:
    """Yield the folder for files of these names, made and claimed: `output`, or a new one.

    Where a command fails before it has written anything, the folder goes.

    FileError: another process writes there, or the files are there already and not to be replaced.
    """
    folder = output or _new(name)
    with refused(folder):
        folder.mkdir(parents=True, exist_ok=True)
    try:
        with claimed(folder):
            taken = [name for name in files if exists(folder / name)]
            if taken and not force:
                go_on = "go on with --resume, " if CHECKPOINT in taken else ""
                raise FileError(
                    f"{folder} has {', '.join(taken)} already; {go_on}choose another folder with "
                    "-o, or --force"
                )
            yield folder
    except BaseException:
        with suppress(OSError):
            folder.rmdir()  # if it is empty: nothing was simulated
        raise


def _new(name: str) -> Path:
    """Make the first of the folders name, name-2, name-3, ... that nobody else has made."""
    for i in count(1):
        folder = Path(name if i == 1 else f"{name}-{i}")
        with refused(folder), suppress(FileExistsError):
            folder.mkdir()
            return folder
    raise AssertionError


def free_file(output: Path | None, name: str, force: bool) -> Path:
    """Return the path for a file of this name: `output`, or a file in that folder."""
    target = output or Path(name)
    target = target / name if exists(target) and target.is_dir() else target
    if exists(target) and not force:
        raise FileError(f"{target} exists; --force writes over it")
    return target


def run_file(path: Path) -> Path:
    """Return the file of the run in a folder of results; any other path as it is."""
    return path / "run.nc" if exists(path) and path.is_dir() else path


def exists(path: Path) -> bool:
    """Return whether there is such a file or folder."""
    with refused(path):  # a name may be too long even to ask
        return path.exists()


def remove(path: Path) -> None:
    """Remove a file, if it is there, that does not belong to what was written beside it."""
    with refused(path):
        path.unlink(missing_ok=True)
