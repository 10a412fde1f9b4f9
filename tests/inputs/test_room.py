"""How much memory is free, by the limits of the machine, of a container and of the process."""

import sys

import pytest

from robsim.base import free_memory as module
from robsim.base.free_memory import OWN, UNKNOWN, get_free_memory

STAT = "anon 5\ninactive_file 300000000\ntotal_inactive_file 200000000\n"


@pytest.fixture
def system(monkeypatch, tmp_path):
    """A system without any limit, and with a folder for the files of the system."""

    def file(name, text):
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    monkeypatch.setattr(module, "_CGROUP", tmp_path / "cgroup")
    monkeypatch.setattr(module, "_PROCESS", tmp_path / "self")
    monkeypatch.setattr(module, "_MACHINE", tmp_path / "meminfo")
    monkeypatch.setattr(module.os, "sysconf", lambda name: 10**6, raising=False)
    return file


def test_the_least_that_any_limit_leaves_counts(system):
    assert get_free_memory() == 0.5e12 - OWN  # half of the total
    system("meminfo", "MemTotal: 16000000 kB\nMemAvailable: 8000000 kB\n")
    assert get_free_memory() == 8192e6 - OWN
    system("cgroup/memory/memory.limit_in_bytes", "6000000000\n")
    system("cgroup/memory/memory.usage_in_bytes", "1000000000\n")
    system("cgroup/memory/memory.stat", STAT)
    assert get_free_memory() == 5.2e9 - OWN
    system("self/cgroup", "0::/mine\n")
    for folder, limit in (("cgroup", "4000000000"), ("cgroup/mine", "max")):
        system(f"{folder}/memory.max", limit)
        system(f"{folder}/memory.current", "1000000000")
        system(f"{folder}/memory.stat", STAT)
    assert get_free_memory() == 5.2e9 - OWN  # the group of the process has no limit of its own
    system("cgroup/mine/memory.max", "2000000000\n")
    assert get_free_memory() == 1.3e9 - OWN
    system("cgroup/mine/memory.current", "9000000000\n")
    assert get_free_memory() == 0.0


def test_a_system_that_does_not_report_its_memory_has_a_few_gigabytes(system, monkeypatch):
    def unknown(name):
        raise ValueError("unrecognized configuration name")

    monkeypatch.setattr(module.os, "sysconf", unknown)
    assert get_free_memory() == UNKNOWN - OWN


@pytest.mark.skipif(sys.platform == "win32", reason="there are no such limits")
def test_the_limit_on_the_addresses_of_a_process_counts(system, monkeypatch):
    import resource

    system("self/statm", "1000 1 1 1 1 1 1\n")  # pages of the size that `system` sets
    monkeypatch.setattr(resource, "getrlimit", lambda which: (3_000_000_000, -1))
    assert get_free_memory() == 3e9 - 1000 * 10**6 - OWN
