"""The secret by which a user's own files are told from others: a file beside the kernels."""

from __future__ import annotations

import os
import secrets
import uuid
from contextlib import suppress
from pathlib import Path

from robsim.base.output import refused
from robsim.kernels.machine.store import USER_CACHE

NAME = "checkpoint.key"
SIZE = 32  # bytes


def secret(folder: Path = USER_CACHE) -> bytes:
    """Return the secret of this user on this machine, made when it is first asked for.

    FileError: it cannot be kept.
    """
    path = folder / NAME
    with refused(path, "keep"):
        known = _known(path)
        if known is None:
            folder.mkdir(parents=True, exist_ok=True)
            _make(path)
            known = path.read_bytes()
        return known


def _known(path: Path) -> bytes | None:
    """Return what is kept; None if there is nothing, or others could have read or changed it."""
    try:
        with open(path, "rb") as file:
            mode, found = os.fstat(file.fileno()).st_mode, file.read(SIZE + 1)
    except FileNotFoundError:
        return None
    own = os.name == "nt" or mode & 0o077 == 0
    if own and len(found) == SIZE:
        return found
    path.unlink()
    return None


def _make(path: Path) -> None:
    """Write a new secret whole, unless another process was faster."""
    draft = path.parent / f"{uuid.uuid4().hex}.tmp"
    number = os.open(draft, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600)
    try:
        with open(number, "wb") as file:
            file.write(secrets.token_bytes(SIZE))
        with suppress(FileExistsError):
            os.link(draft, path)
    finally:
        draft.unlink(missing_ok=True)
