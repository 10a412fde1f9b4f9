"""Every example and every scenario that is shipped runs, without a warning."""

import runpy
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

import robsim as rs

pytestmark = pytest.mark.full
EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.py"))

NEEDS = {"bag_there_and_back": "rosbags"}


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    yield
    plt.close("all")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_and_prints_its_findings(path, capsys, monkeypatch):
    pytest.importorskip(NEEDS.get(path.stem, "robsim"))
    monkeypatch.syspath_prepend(path.parent)  # as Python does for a script
    runpy.run_path(str(path), run_name="__main__")
    out, err = capsys.readouterr()
    assert err == "" and (out or list(Path().iterdir()))


@pytest.mark.parametrize("name", rs.examples.names())
def test_a_scenario_is_copied_checked_and_run(name, called):
    file = f"{name}.toml"
    for command in (["examples", name], ["check", file], ["run", file]):
        status, out, err = called(*command)
        assert status == 0 and out, err
    (run,) = Path().glob(f"{name}-*/run.nc")
    assert rs.open_run(run).attrs["scenario"]
