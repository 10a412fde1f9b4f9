"""The files of machine code, in a folder whose name hashes all that shapes it.

A file holds a digest of the rest, the key for which the code was compiled, and the code. It
appears whole or not at all, under a name of its own: any number of processes may write here.
"""

import hashlib
import os
import pickle
import sys
import uuid
from pathlib import Path
from typing import Any

import llvmlite
import numba
from numba.core.serialize import dumps

VERSIONS = (
    f"Numba {numba.__version__}, llvmlite {llvmlite.__version__}, "
    f"Python {sys.version_info.major}.{sys.version_info.minor}"
)
_DIGEST = 32  # bytes of SHA-256


def _hash_of_sources() -> str:
    digest = hashlib.sha256(f"numba {numba.__version__} llvmlite {llvmlite.__version__}".encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode() + source.read_bytes())
    return digest.hexdigest()[:16]


def _user_cache() -> Path:
    """Return `ROBSIM_CACHE_DIR`, or the usual folder for a user's cache files."""
    if os.environ.get("ROBSIM_CACHE_DIR"):
        return Path(os.environ["ROBSIM_CACHE_DIR"])
    fallback = "AppData/Local" if sys.platform == "win32" else ".cache"
    root = os.environ.get("LOCALAPPDATA" if sys.platform == "win32" else "XDG_CACHE_HOME")
    return Path(root or os.path.expanduser(f"~/{fallback}")) / "robsim"


KERNEL_HASH = _hash_of_sources()
CACHE = _user_cache() / KERNEL_HASH
SAVED: set[str] = set()  # the names of files that this process has written


def file_name(name: str, key: tuple[Any, ...]) -> str:
    """Return the name of the file for a kernel and its key."""
    digest = hashlib.sha256(f"{VERSIONS} {key}".encode()).hexdigest()[:20]
    return f"{name}.{digest}.nbc"


def load(folder: Path, name: str, key: tuple[Any, ...]) -> Any:
    """Return what was saved; None if there is no such file, or not whole, or of another key."""
    try:
        content = (folder / file_name(name, key)).read_bytes()
    except OSError:
        return None
    rest = content[_DIGEST:]
    if hashlib.sha256(rest).digest() != content[:_DIGEST]:
        return None
    saved, data = pickle.loads(rest)
    return pickle.loads(data) if saved == key else None


def save(folder: Path, name: str, key: tuple[Any, ...], data: Any) -> None:
    """Write a file at once; OSError where that cannot be."""
    rest: bytes = dumps((key, dumps(data)))
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{uuid.uuid4().hex}.tmp"
    try:
        path.write_bytes(hashlib.sha256(rest).digest() + rest)
        path.replace(folder / file_name(name, key))
        SAVED.add(file_name(name, key))
    finally:
        path.unlink(missing_ok=True)


def writable() -> bool:
    """Return whether machine code can be kept."""
    try:
        CACHE.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(CACHE, os.W_OK)
