"""The free memory of the machine, within the limits of the process."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

UNKNOWN = 4e9  # bytes, if the system does not report its memory
OWN = 2e8  # bytes reserved for later imports
_CGROUP = Path("/sys/fs/cgroup")
_PROCESS, _MACHINE = Path("/proc/self"), Path("/proc/meminfo")


def get_free_memory() -> float:
    """Return the free memory of this process in bytes, the least of all limits."""
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
    """Return the free memory within RLIMIT_AS; ValueError if there is no such limit."""
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        raise ValueError("no limit")
    return float(limit - get_address_space())


def get_address_space() -> int:
    """Return the address space of this process in bytes; OSError if the system has no /proc."""
    pages = int((_PROCESS / "statm").read_text().split()[0])
    return pages * os.sysconf("SC_PAGE_SIZE")


def _get_cgroup_limit() -> float:
    """Return the free memory within a container (cgroup v2), including the file cache."""
    group = _CGROUP / _read_cgroup_name("0::").lstrip("/")
    group = group if (group / "memory.max").exists() else _CGROUP
    return _subtract_used(group, "max", "current", "inactive_file")


def _get_cgroup_v1_limit() -> float:
    """Return the free memory within a container (cgroup v1)."""
    return _subtract_used(
        _CGROUP / "memory", "limit_in_bytes", "usage_in_bytes", "total_inactive_file"
    )


def _subtract_used(group: Path, most: str, now: str, files: str) -> float:
    limit, used = (float((group / f"memory.{name}").read_text()) for name in (most, now))
    return limit - used + _read_number(group / "memory.stat", files)  # ValueError for limit "max"


def _get_available_memory() -> float:
    """Return the available memory in bytes, or half of the total if it is not reported."""
    with suppress(OSError, KeyError):
        return 1024.0 * _read_number(_MACHINE, "MemAvailable:")
    return 0.5 * os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")


def _read_cgroup_name(kind: str) -> str:
    lines = (_PROCESS / "cgroup").read_text().splitlines()
    return next((line[len(kind) :] for line in lines if line.startswith(kind)), "")


def _read_number(path: Path, name: str) -> float:
    """Return the number after a name in a file of lines."""
    return float(dict(line.split()[:2] for line in path.read_text().splitlines())[name])
