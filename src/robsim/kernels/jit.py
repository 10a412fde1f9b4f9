"""The decorator that compiles kernels, and the cache of their machine code.

Numba's file cache does not notice an edit in a callee of another file, so the folder's name
hashes every kernel source together with the versions that shape the code.
"""

import hashlib
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import llvmlite
import numba

config: Any = numba.config


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


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


_PYTHON = f"py{sys.version_info.major}{sys.version_info.minor}"  # in the names of Numba's files
KERNEL_HASH = _hash_of_sources()
CACHE = _user_cache() / KERNEL_HASH
_CACHED = _writable(CACHE)  # without a place to write, kernels compile anew in each process


def is_cold(name: str) -> bool:
    """Return whether a kernel such as "loop.stride" was never compiled by this Python."""
    return not (_CACHED and any(CACHE.rglob(f"{name}-*.{_PYTHON}.*.nbc")))


def kernel(function: Callable[..., Any], inline: str = "never") -> Callable[..., Any]:
    """Compile for run-last float64 arrays: no GIL, IEEE division, no fast-math, cached on disk."""
    usual, config.CACHE_DIR = config.CACHE_DIR, str(CACHE)
    options: Any = {"nogil": True, "error_model": "numpy", "cache": _CACHED, "inline": inline}
    compiled: Callable[..., Any]
    try:
        compiled = numba.njit(**options)(function)
    finally:
        config.CACHE_DIR = usual  # the user's own Numba functions keep their own cache
    return compiled


def part(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a kernel that is inlined into its callers, so that it is not compiled alone."""
    return kernel(function, inline="always")
