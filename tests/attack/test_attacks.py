"""The first cases of each class of attack; `python -m attack --minutes 60` tries many more."""

import pytest
from attack.harness import CLASSES, attacked

SLOW = (
    "cache_files",
    "full_disks",
    "run_files",
    "stops",
    "together",
)  # each case is a process of its own
CASES = {  # of each class
    **{"api_calls": 480, "cache_files": 1, "checkpoints": 40, "drives": 15, "full_disks": 2},
    **{"run_files": 20, "stops": 3, "studio": 8, "studio_requests": 8, "study_stores": 36},
    **{"together": 1, "toml_mutants": 100, "urdf_mutants": 120, "wishes": 15},
}
# classes with a part of the cases tried by default, and the others by `full`
LONG = {
    **{"api_calls": 24, "checkpoints": 20, "drives": 5, "study_stores": 12},
    **{"studio_requests": 8, "toml_mutants": 10, "urdf_mutants": 12, "wishes": 8},
}


def parts():
    """Yield the classes with the numbers of the cases that are tried."""
    for name in CLASSES:
        cases, every = range(CASES[name]), LONG.get(name, 1)
        slow = [pytest.mark.full] * (name in SLOW)
        yield pytest.param(name, cases[::every], marks=slow, id=name)
        if every > 1:
            rest = [case for case in cases if case % every]
            yield pytest.param(name, rest, marks=pytest.mark.full, id=f"{name}, rest")


@pytest.mark.parametrize(("name", "cases"), list(parts()))
def test_nothing_breaks(name, cases):
    """Every input is taken or refused; nothing crashes, hangs, is lost or escapes."""
    tally = attacked(name, cases)
    assert tally.tried == len(cases) and not tally.problems, str(tally)
