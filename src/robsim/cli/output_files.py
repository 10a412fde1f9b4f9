"""Files and folders of results, locked by one process and overwritten only on request."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import FileError
from robsim.base.folder_lock import lock_folder

CHECKPOINT = "checkpoint"  # file from which an interrupted run continues
BAG_METADATA = "metadata.yaml"  # file in the folder of a complete bag
BAG_SUFFIXES = {".mcap", ".db3"}


@contextmanager
def claim_results_folder(
    output: Path | None, name: str, force: bool, files: Sequence[str]
) -> Iterator[Path]:
    """Yield a locked folder for files of these names: `output`, or a new folder `name`.

    If the command fails before it has written a file, the folder is removed.

    Raise FileError if another process writes to the folder, or if the files exist and may not be
    overwritten.
    """
    folder = output or _create_new_folder(name)
    with convert_os_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    try:
        with lock_folder(folder):
            existing = [name for name in files if path_exists(folder / name)]
            if existing and not force:
                resume = "continue with --resume, " if CHECKPOINT in existing else ""
                raise FileError(
                    f"{folder} has {', '.join(existing)} already; {resume}choose another folder "
                    "with -o, or --force"
                )
            yield folder
    except BaseException:
        with suppress(OSError):
            folder.rmdir()  # fails unless it is empty
        raise


def _create_new_folder(name: str) -> Path:
    """Create and return the first of the folders name, name-2, name-3, ... that does not exist."""
    for i in count(1):
        folder = Path(name if i == 1 else f"{name}-{i}")
        with convert_os_errors(folder), suppress(FileExistsError):
            folder.mkdir()
            return folder
    raise AssertionError


def choose_output_file(output: Path | None, name: str, force: bool) -> Path:
    """Return the path of a file to write: `output`, or the file `name` in the folder `output`.

    Raise FileError if the file exists, unless `force`.
    """
    target = output or Path(name)
    target = target / name if path_exists(target) and target.is_dir() else target
    if path_exists(target) and not force:
        raise FileError(f"{target} exists; overwrite it with --force")
    return target


def find_run_file(path: Path) -> Path:
    """Return the path of the run in a folder of results; return other paths unchanged."""
    is_folder = path_exists(path) and path.is_dir() and not is_bag(path)
    return path / "run.nc" if is_folder else path


def is_bag(path: Path) -> bool:
    """Return whether a path is a bag of ROS 2, by its name or the files of its folder."""
    if BAG_SUFFIXES & set(path.suffixes):
        return True
    with convert_os_errors(path):
        files = list(path.iterdir()) if path_exists(path) and path.is_dir() else []
    return any(BAG_SUFFIXES & set(file.suffixes) or file.name == BAG_METADATA for file in files)


def path_exists(path: Path) -> bool:
    """Return whether a file or folder exists."""
    with convert_os_errors(path):  # a name may be too long
        return path.exists()


def remove_file(path: Path) -> None:
    """Remove a file of earlier results, if it exists."""
    with convert_os_errors(path):
        path.unlink(missing_ok=True)
