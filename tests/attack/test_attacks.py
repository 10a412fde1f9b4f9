"""The first cases of each class of attack; `python -m attack --minutes 60` tries many more."""

import importlib

import pytest
from attack.harness import CLASSES, attacked

SLOW = (
    "cache_files",
    "full_disks",
    "run_files",
    "stops",
    "together",
)  # whose cases are processes of their own
LONG = ("toml_mutants", "urdf_mutants", "wishes")  # half of whose cases are `full`


def parts():
    """Yield the classes with the part of their cases that is tried."""
    for name in CLASSES:
        slow = [pytest.mark.full] * (name in SLOW)
        yield pytest.param(name, slice(0, None, 1 + (name in LONG)), marks=slow, id=name)
        if name in LONG:
            yield pytest.param(name, slice(1, None, 2), marks=pytest.mark.full, id=f"{name}, rest")


@pytest.mark.parametrize(("name", "part"), list(parts()))
def test_nothing_breaks(name, part):
    """Every input is taken or refused; nothing crashes, hangs, is lost or escapes."""
    cases = range(importlib.import_module(f"attack.{name}").CASES)[part]
    tally = attacked(name, cases)
    assert tally.tried == len(cases) and not tally.problems, str(tally)
