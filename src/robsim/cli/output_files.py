"""Files and folders that commands write: claimed by one process, never overwritten unasked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import FileError
from robsim.base.folder_lock import lock_folder

CHECKPOINT = "checkpoint"  # from which a run goes on that was stopped


@contextmanager
def claim_results_folder(
    output: Path | None, name: str, force: bool, files: Sequence[str]
) -> Iterator[Path]:
    """Yield the folder for files of these names, made and claimed: `output`, or a new one.

    Where a command fails before it has written anything, the folder goes.

    FileError: another process writes there, or the files are there already and not to be replaced.
    """
    folder = output or _create_new_folder(name)
    with convert_os_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    try:
        with lock_folder(folder):
            taken = [name for name in files if path_exists(folder / name)]
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


def _create_new_folder(name: str) -> Path:
    """Make the first of the folders name, name-2, name-3, ... that nobody else has made."""
    for i in count(1):
        folder = Path(name if i == 1 else f"{name}-{i}")
        with convert_os_errors(folder), suppress(FileExistsError):
            folder.mkdir()
            return folder
    raise AssertionError


def choose_output_file(output: Path | None, name: str, force: bool) -> Path:
    """Return the path for a file of this name: `output`, or a file in that folder."""
    target = output or Path(name)
    target = target / name if path_exists(target) and target.is_dir() else target
    if path_exists(target) and not force:
        raise FileError(f"{target} exists; --force writes over it")
    return target


def find_run_file(path: Path) -> Path:
    """Return the file of the run in a folder of results; any other path as it is."""
    return path / "run.nc" if path_exists(path) and path.is_dir() else path


def path_exists(path: Path) -> bool:
    """Return whether there is such a file or folder."""
    with convert_os_errors(path):  # a name may be too long even to ask
        return path.exists()


def remove_file(path: Path) -> None:
    """Remove a file, if it is there, that does not belong to what was written beside it."""
    with convert_os_errors(path):
        path.unlink(missing_ok=True)
