"""The first cases of each class of attack; `python -m attack --minutes 60` tries many more."""

import importlib

import pytest
from attack.harness import CLASSES, attacked

SLOW = (
    "cache_files",
    "full_disks",
    "run_files",
    "together",
)  # whose cases are processes of their own
MARKED = [pytest.param(name, marks=[pytest.mark.full] * (name in SLOW)) for name in CLASSES]


@pytest.mark.parametrize("name", MARKED)
def test_nothing_breaks(name):
    """Every input is taken or refused; nothing crashes, hangs, is lost or escapes."""
    cases = importlib.import_module(f"attack.{name}").CASES
    tally = attacked(name, range(cases))
    assert tally.tried == cases and not tally.problems, str(tally)
