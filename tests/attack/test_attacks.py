"""The first cases of each class of attack; `python -m attack --minutes 60` tries many more."""

import pytest
from attack.harness import CLASSES, attacked

CASES = {  # of each class
    **{"api_calls": 480, "cache_files": 1, "checkpoints": 40, "drives": 15, "full_disks": 2},
    **{"run_files": 20, "stops": 3, "studio": 8, "studio_requests": 8, "study_stores": 36},
    **{"together": 1, "toml_mutants": 100, "urdf_mutants": 120, "wishes": 15},
}


@pytest.mark.full
@pytest.mark.parametrize("name", CLASSES)
def test_nothing_breaks(name):
    """Every input is taken or refused; nothing crashes, hangs, is lost or escapes."""
    tally = attacked(name, range(CASES[name]))
    assert tally.tried == CASES[name] and not tally.problems, str(tally)
