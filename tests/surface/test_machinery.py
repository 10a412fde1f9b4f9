"""The machinery of declarations, which reads, writes and finds values by name, does not grow."""

import importlib.util
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "tools" / "count_machinery.py"
MOST = 3899  # lines of code, without docstrings and comments; with tables of free names


def count_lines():
    spec = importlib.util.spec_from_file_location("count_machinery", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.machinery()


@pytest.mark.full
def test_the_machinery_does_not_grow():
    lines = count_lines()
    assert "declare/dotted_paths.py" in lines and "geometry/pose_table.py:PoseTable" in lines
    assert sum(lines.values()) <= MOST
