"""The files of machine code, whose names hash all that shapes it.

A file is a container of the code, with the name of the kernel and the key for which it was
compiled. It appears whole or not at all, under a name of its own: any number of processes may
write here. Files of old sources and versions stay beside the others until they are aged.
"""

import hashlib
import os
import pickle
import sys
import uuid
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba.core.serialize import dumps

from robsim.container import MAGIC, pack_container, unpack_container
from robsim.kernels.machine.sources import digest_of_all

VERSIONS = (
    f"Numba {numba.__version__}, llvmlite {llvmlite.__version__}, "
    f"Python {sys.version_info.major}.{sys.version_info.minor}"
)
_BOUNDS: Any = vars(numba.config)["BOUNDSCHECK"]  # indices may be looked at, for a test


def _user_cache_folder() -> Path:
    """Return `ROBSIM_CACHE_DIR`, or the usual folder for a user's cache files."""
    if os.environ.get("ROBSIM_CACHE_DIR"):
        return Path(os.environ["ROBSIM_CACHE_DIR"])
    fallback = "AppData/Local" if sys.platform == "win32" else ".cache"
    root = os.environ.get("LOCALAPPDATA" if sys.platform == "win32" else "XDG_CACHE_HOME")
    return Path(root or os.path.expanduser(f"~/{fallback}")) / "robsim"


KERNEL_HASH = hashlib.sha256(f"{VERSIONS} {_BOUNDS} {digest_of_all()}".encode()).hexdigest()[:16]
USER_CACHE = _user_cache_folder()
CACHE = USER_CACHE / "kernels"
SAVED: set[str] = set()  # the names of files that this process has written


def code_file_name(name: str, key: tuple[Any, ...]) -> str:
    """Return the name of the file for a kernel and its key."""
    digest = hashlib.sha256(f"{VERSIONS} {_BOUNDS} {MAGIC!r} {key}".encode()).hexdigest()[:20]
    return f"{name}.{digest}.nbc"


def load_code(folder: Path, name: str, key: tuple[Any, ...]) -> Any:
    """Return what was saved; None if there is no such file, or it cannot be read.

    An error of any kind says that it is damaged, or that of another kernel.
    """
    try:
        content = (folder / code_file_name(name, key)).read_bytes()
    except OSError:
        return None
    header, (code,) = unpack_container(BytesIO(content))
    if header != [name, str(key)]:
        raise ValueError("of another kernel")
    return pickle.loads(code.data)


def save_code(folder: Path, name: str, key: tuple[Any, ...], data: Any) -> None:
    """Write a file at once; OSError where that cannot be."""
    code = np.frombuffer(dumps(data), np.uint8)
    path = _write_draft(folder, pack_container([name, str(key)], [code]).getbuffer())
    try:
        path.replace(folder / code_file_name(name, key))
        SAVED.add(code_file_name(name, key))
    finally:
        path.unlink(missing_ok=True)


def drop_code(folder: Path, name: str, key: tuple[Any, ...]) -> None:
    """Delete a damaged file of the user's; what came with the package stays as it is."""
    if folder == CACHE:
        with suppress(OSError):
            (folder / code_file_name(name, key)).unlink()


def is_cache_writable() -> bool:
    """Return whether machine code can be kept, as trying tells: permissions do not tell all."""
    try:
        _write_draft(CACHE, bytes(65536)).unlink()
    except OSError:
        return False
    return True


def _write_draft(folder: Path, content: bytes | memoryview) -> Path:
    """Write a file that is not yet one of ours; OSError leaves nothing."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{uuid.uuid4().hex}.tmp"
    try:
        path.write_bytes(content)
    except OSError:
        with suppress(OSError):
            path.unlink(missing_ok=True)
        raise
    return path
