"""Digests of the sources of a kernel: its own file and all files that it imports."""

import hashlib
import re
import sys
from functools import cache
from importlib.util import resolve_name
from pathlib import Path

PACKAGE = "robsim.kernels"
COMPILER = f"{PACKAGE}.machine.compiler"  # the modules that generate code by Numba
_ROOT = Path(__file__).parents[1]
_IMPORT = re.compile(r"^\s*(?:from\s+([\w.]+)\s+)?import\s+(\([^)]*\)|[^\n]*)", re.MULTILINE)
_NAME = re.compile(r"[\w.]+")
_ELSEWHERE = {*sys.stdlib_module_names, "llvmlite", "numba", "numpy", "robsim"}


def _kernel_module_name(path: Path) -> str:
    parts = path.relative_to(_ROOT).with_suffix("").parts
    return ".".join([PACKAGE, *parts]).removesuffix(".__init__")


SOURCES = {_kernel_module_name(path): path.read_bytes() for path in sorted(_ROOT.rglob("*.py"))}


def digest_of_all() -> str:
    """Return a digest of the names and sources of all modules of kernels."""
    return _digest_sources(sorted(SOURCES))


@cache
def digest_of(module: str) -> str:
    """Return a digest of the sources of a module and of all its imports; "" without a source.

    Libraries are not part of the digest. The keys of the cache contain their versions.
    """
    return (
        _digest_sources(sorted(import_closure(module))) if _read_source(module) is not None else ""
    )


def import_closure(module: str) -> set[str]:
    """Return a module and all modules with a source that it imports directly or indirectly.

    Kernels import the modules of Numba's side by name, so these count for each module.
    """
    reached, waiting = set(), {module, *(each for each in SOURCES if each.startswith(COMPILER))}
    while waiting:
        reached |= waiting
        waiting = {name for each in waiting for name in imported_modules(each)} - reached
    return reached


@cache
def imported_modules(module: str) -> frozenset[str]:
    """Return the modules with a source that a module imports directly."""
    text = (_read_source(module) or b"").decode().replace("\\\n", " ")
    names = {
        name
        for origin, items in _IMPORT.findall(text)
        for name in _candidate_modules(origin, items)
    }
    package = getattr(sys.modules.get(module), "__package__", None) or PACKAGE
    absolute = {resolve_name(name, package) if name[0] == "." else name for name in names}
    return frozenset(name for name in absolute if _read_source(name) is not None)


def _candidate_modules(origin: str, items: str) -> list[str]:
    """Return the modules that an import may load: a and a.b for "from a import b"."""
    names = _NAME.findall(items)
    if not origin:
        return names
    parent = origin if origin.endswith(".") else f"{origin}."
    return [origin, *(parent + name for name in names)]


@cache
def _read_source(module: str) -> bytes | None:
    """Return the source of a kernel module or a user's module; None for all other modules."""
    if module in SOURCES or module.partition(".")[0] in _ELSEWHERE:
        return SOURCES.get(module)
    path = Path(getattr(sys.modules.get(module), "__file__", None) or "")
    return path.read_bytes() if path.suffix == ".py" and path.is_file() else None


def _digest_sources(modules: list[str]) -> str:
    digest = hashlib.sha256()
    for module in modules:
        digest.update(module.encode() + hashlib.sha256(_read_source(module) or b"").digest())
    return digest.hexdigest()[:20]
