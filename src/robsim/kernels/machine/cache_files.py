"""The cache files of machine code. Their names contain a hash of all inputs of the compilation.

A file is a container of the compressed code, the name of the kernel, and a digest of the key of
its compilation. Files are renamed into place as a whole, so any number of processes may write to
the folder. Files of old sources and versions stay until a cleanup deletes them.
"""

import hashlib
import os
import pickle
import sys
import uuid
import zlib
from contextlib import suppress
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from robsim.container import MAGIC, pack_container, unpack_container
from robsim.kernels.machine.sources import digest_of_all


@cache
def find_version(package: str) -> str:
    """Return the version of a package that is not imported; "none" if it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return "none"


VERSIONS = (
    f"Numba {find_version('numba')}, llvmlite {find_version('llvmlite')}, "
    f"Python {sys.version_info.major}.{sys.version_info.minor}"
)
_BOUNDS = os.environ.get("NUMBA_BOUNDSCHECK", "")  # tests may check indices


def _user_cache_folder() -> Path:
    """Return `ROBSIM_CACHE_DIR`, or the default folder of the user's cache files."""
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


def read_object(name: str, key: tuple[Any, ...]) -> bytes | None:
    """Return saved machine code of bitcode; None if it is absent or damaged."""
    try:
        return _read_code(name, key)
    except (OSError, ValueError):
        return None


def write_object(name: str, key: tuple[Any, ...], code: bytes) -> None:
    """Save machine code of bitcode, if the folder is writable."""
    with suppress(OSError):
        _write_code(name, key, code)


def load_code(name: str, key: tuple[Any, ...]) -> Any:
    """Return the saved data, or None if the file does not exist or is not readable.

    Any exception means that the file is damaged or belongs to another kernel.
    """
    try:
        code = _read_code(name, key)
    except OSError:
        return None
    return pickle.loads(code)


def save_code(name: str, key: tuple[Any, ...], data: Any) -> None:
    """Write a file as a whole. Raise OSError if the folder is not writable."""
    from numba.core.serialize import dumps  # late: only Numba's code is pickled

    _write_code(name, key, dumps(data))


def _read_code(name: str, key: tuple[Any, ...]) -> bytes:
    content = (CACHE / code_file_name(name, key)).read_bytes()
    header, (code,) = unpack_container(BytesIO(content))
    if header != [name, _digest(key)]:
        raise ValueError("the file belongs to another kernel")
    return zlib.decompress(code.data)


def _write_code(name: str, key: tuple[Any, ...], code: bytes) -> None:
    packed = np.frombuffer(zlib.compress(code), np.uint8)
    with pack_container([name, _digest(key)], [packed]).getbuffer() as content:
        path = _write_draft(CACHE, content)
    try:
        path.replace(CACHE / code_file_name(name, key))
        SAVED.add(code_file_name(name, key))
    finally:
        path.unlink(missing_ok=True)


def _digest(key: tuple[Any, ...]) -> str:
    return hashlib.sha256(str(key).encode()).hexdigest()


def drop_code(name: str, key: tuple[Any, ...]) -> None:
    """Delete a damaged file."""
    with suppress(OSError):
        (CACHE / code_file_name(name, key)).unlink()


def is_cache_writable() -> bool:
    """Return whether the cache is writable, by writing a file: permissions are not sufficient."""
    try:
        _write_draft(CACHE, bytes(65536)).unlink()
    except OSError:
        return False
    return True


def _write_draft(folder: Path, content: bytes | memoryview) -> Path:
    """Write content to a new temporary file and return its path. An OSError leaves no file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{uuid.uuid4().hex}.tmp"
    try:
        path.write_bytes(content)
    except OSError:
        with suppress(OSError):
            path.unlink(missing_ok=True)
        raise
    return path
