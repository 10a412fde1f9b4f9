"""Files and folders that commands write: checked to be writable, never overwritten unasked."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from robsim.base.errors import FileError


def free_folder(name: str) -> Path:
    """Return the first of name, name-2, name-3, ... that does not exist."""
    candidates = (Path(name if i == 1 else f"{name}-{i}") for i in range(1, 10_000))
    return next(folder for folder in candidates if not exists(folder))


def folder_for(folder: Path, force: bool, files: Sequence[str]) -> Path:
    """Create the folder and return it, once it is found to be writable."""
    taken = [name for name in files if exists(folder / name)]
    if taken and not force:
        raise FileError(
            f"{folder} has {', '.join(taken)} already; choose another folder with -o, or --force"
        )
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder


def free_file(output: Path | None, name: str, force: bool) -> Path:
    """Return the path for a file of this name: `output`, or a file in that folder."""
    target = output or Path(name)
    target = target / name if exists(target) and target.is_dir() else target
    if exists(target) and not force:
        raise FileError(f"{target} exists; --force writes over it")
    return target


def write(path: Path, text: str) -> None:
    """Write a text to a file, and create the folders that it needs."""
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


@contextmanager
def writing(path: Path) -> Iterator[Path]:
    """Raise FileError, which names the path, where the system refuses to write."""
    try:
        yield path
    except OSError as error:
        raise FileError(f"cannot write {path}: {error.strerror or error}") from None


def exists(path: Path) -> bool:
    """Return whether there is such a file or folder."""
    with writing(path):  # a name may be too long even to ask
        return path.exists()
