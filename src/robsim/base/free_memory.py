"""How much memory there is for results, of the machine and of the limits on a process."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

UNKNOWN = 4e9  # bytes, where the system does not tell
OWN = 2e8  # bytes, of what is still to be imported
_CGROUP = Path("/sys/fs/cgroup")
_PROCESS, _MACHINE = Path("/proc/self"), Path("/proc/meminfo")


def get_free_memory() -> float:
    """Return how many bytes this process may still take: the least that any limit leaves."""
    return max(min(_get_memory_limits(), default=UNKNOWN) - OWN, 0.0)


def _get_memory_limits() -> Iterator[float]:
    for each in (
        _get_process_limit,
        _get_cgroup_limit,
        _get_cgroup_v1_limit,
        _get_available_memory,
    ):
        with suppress(ImportError, OSError, ValueError, KeyError, AttributeError):
            yield each()


def _get_process_limit() -> float:
    """Return what RLIMIT_AS leaves; a ValueError where there is no such limit."""
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        raise ValueError("no limit")
    pages = int((_PROCESS / "statm").read_text().split()[0])
    return limit - float(pages * resource.getpagesize())


def _get_cgroup_limit() -> float:
    """Return what the limit of a container leaves (cgroup v2); pages of files can be given up."""
    group = _CGROUP / _read_cgroup_name("0::").lstrip("/")
    group = group if (group / "memory.max").exists() else _CGROUP
    return _subtract_used(group, "max", "current", "inactive_file")


def _get_cgroup_v1_limit() -> float:
    """Return what the limit of a container leaves (cgroup v1)."""
    return _subtract_used(
        _CGROUP / "memory", "limit_in_bytes", "usage_in_bytes", "total_inactive_file"
    )


def _subtract_used(group: Path, most: str, now: str, files: str) -> float:
    limit, used = (float((group / f"memory.{name}").read_text()) for name in (most, now))
    return limit - used + _read_number(group / "memory.stat", files)  # the limit "max" is no number


def _get_available_memory() -> float:
    """Return what is available, or where the system does not tell half of what there is."""
    with suppress(OSError, KeyError):
        return 1024.0 * _read_number(_MACHINE, "MemAvailable:")
    return 0.5 * os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def _read_cgroup_name(kind: str) -> str:
    lines = (_PROCESS / "cgroup").read_text().splitlines()
    return next((line[len(kind) :] for line in lines if line.startswith(kind)), "")


def _read_number(path: Path, name: str) -> float:
    """Return the number that stands behind a name in a file of lines."""
    return float(dict(line.split()[:2] for line in path.read_text().splitlines())[name])
