"""`robsim compare`: schemes from files and from values, its files and its refusals."""

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from stopping import stop_at_the_second

import robsim as rs
from robsim import examples

TURN = """
schema = 1
title = "A turn"
robots = [{ model = "free_camera" }]
objects = [{ name = "dots", marks = ["0, 0, 1 m", "20, 0, 100 cm", "0, 20, 100 cm", "20, 20, 100 cm"] }]
cameras = [{ name = "eye", on = "free_camera.body", focal = 500, size = [640, 480] }]
task = { kind = "ibvs", tolerance = 1e-3 }
start = { position = "0, 0, -20 cm", rotvec = "0, 0, 0.5 rad" }
run = { dt = "40 ms", duration = "8 s" }
"""  # noqa: E501


@pytest.fixture
def robsim(tmp_path, monkeypatch, called):
    """`robsim ARGUMENTS` in this process, in a folder with a scenario: (status, out, err)."""
    monkeypatch.chdir(tmp_path)
    Path("turn.toml").write_text(TURN, encoding="utf-8")

    return called


def files(folder):
    return sorted(path.name for path in Path(folder).iterdir())


def test_values_of_one_key_become_schemes(robsim):
    vary = "task.interaction=current,desired,mean"
    status, out, err = robsim("compare", "turn.toml", "--vary", vary)
    assert (status, err) == (0, "")
    assert files("robsim-compare") == [
        *("comparison.csv", "comparison.nc", "comparison.png"),
        *("current.nc", "desired.nc", "mean.nc"),
    ]
    lines = out.splitlines()
    assert [line.split()[0] for line in lines[2:5]] == ["current", "desired", "mean"]
    assert lines[-1] == "results: robsim-compare" and "note" not in out
    with xr.open_dataset("robsim-compare/comparison.nc", engine="h5netcdf") as data:
        times = data["time"].values
    for i, name in enumerate(("current", "desired", "mean")):
        run = rs.open_run(f"robsim-compare/{name}.nc")
        expected = rs.load_scenario("turn.toml", [f"task.interaction={name}"]).run()
        np.testing.assert_array_equal(run.q, expected.q)
        np.testing.assert_array_equal(rs.replay(run).q, run.q)
        assert times[i] == float(run.end_time)
    rows = Path("robsim-compare/comparison.csv").read_text(encoding="utf-8").splitlines()
    assert [row.split(",")[0] for row in rows] == ["scheme", "current", "desired", "mean"]
    assert robsim("compare", "turn.toml", "--no-figures")[1].endswith("robsim-compare-2\n")
    assert files("robsim-compare-2") == ["comparison.csv", "comparison.nc", "turn.nc"]


def test_files_become_schemes_each_in_its_own_scene(robsim):
    Path("other").mkdir()
    Path("other/turn.toml").write_text(TURN.replace("0.5 rad", "0.2 rad"), encoding="utf-8")
    lens = TURN.replace("focal = 500", "focal = 400")
    Path("comparison.toml").write_text(lens, encoding="utf-8")
    paths = ("turn.toml", "other/turn.toml", "comparison.toml")
    status, out, _ = robsim("compare", *paths, "--no-figures", "-o", "out")
    assert status == 0
    assert files("out") == [
        *("comparison-2.nc", "comparison.csv", "comparison.nc", "turn-2.nc", "turn.nc")
    ]
    assert "note: another scene than turn: comparison-2\n" in out
    assert "note: another start than turn: turn-2\n" in out


def test_files_and_values_are_all_combined_after_the_changes(robsim):
    Path("b.toml").write_text(TURN, encoding="utf-8")
    changes = ("--set", "run.duration=1 s", "--vary", "start.rotvec=[0,0,0.1] rad,'0, 0, 0.2 rad'")
    assert robsim("compare", "turn.toml", *changes)[0] == 2  # the first is no rotvec
    changes = ("--set", "run.duration=1 s", "--vary", "start.rotvec='0, 0, 0.1 rad',0 0 0.2 rad")
    status, _, _ = robsim("compare", "turn.toml", "b.toml", *changes, "-o", "out", "--no-figures")
    assert status == 0
    names = ["turn-0-0-0.1-rad", "turn-0-0-0.2-rad", "b-0-0-0.1-rad", "b-0-0-0.2-rad"]
    assert files("out") == sorted([*(f"{n}.nc" for n in names), "comparison.csv", "comparison.nc"])
    turned = [rs.open_run(f"out/{name}.nc") for name in names[:2]]
    angles = [rs.Pose(run.camera_pose.values[0]).rotvec[2] for run in turned]
    np.testing.assert_allclose(angles, [0.1, 0.2])
    assert all(float(run.time[-1]) == 1.0 for run in turned)


def test_bad_input_is_reported_and_leaves_nothing(robsim):
    behind = "task.goal.position=0 0 2 m"
    for arguments, *parts in (
        (["missing.toml"], "missing.toml: no such file"),
        (["turn.toml", "--vary", "task.gain"], "--vary: expected key=value,value", "'task.gain'"),
        (["turn.toml", "--vary", "task.gain=1,,2"], "--vary: expected key=value,value"),
        (["turn.toml", "--vary", "task.gain=1,-1"], "turn.toml", "task.gain", "-1"),
        (["turn.toml", "--vary", "task.gian=1,2"], "'gian'", "did you mean 'gain'?"),
        (["turn.toml", "--set", behind, "--vary", "task.gain=1,2"], "scheme '1'", "behind camera"),
        (["turn.toml", "-o", "turn.toml"], "cannot write turn.toml"),
    ):
        status, out, err = robsim("compare", *arguments)
        assert status == 2 and err.count("error: ") == 1 and out == ""
        for part in parts:
            assert part in err, (part, err)
    assert robsim("compare")[0] == 2
    assert files(".") == ["turn.toml"]


def test_two_keys_at_a_time_are_refused_not_dropped(robsim):
    keys = ("--vary", "task.gain=1,2", "--vary", "sensing.noise=0,1")
    status, _, err = robsim("compare", "turn.toml", *keys)
    assert status == 2 and err == (
        "error: --vary: one key at a time, got 'task.gain=1,2' and 'sensing.noise=0,1'\n"
    )
    assert files(".") == ["turn.toml"]


def test_nothing_is_written_over_without_force(robsim):
    robsim("compare", "turn.toml", "-o", "out")
    before = Path("out/turn.nc").read_bytes()
    status, _, err = robsim("compare", "turn.toml", "--set", "task.gain=2", "-o", "out")
    assert status == 2 and "out has comparison.nc, comparison.csv, comparison.png, turn.nc" in err
    assert Path("out/turn.nc").read_bytes() == before
    changed = ("compare", "turn.toml", "--set", "task.gain=2", "-o", "out", "--force")
    assert robsim(*changed, "--no-figures")[0] == 0
    assert files("out") == ["comparison.csv", "comparison.nc", "turn.nc"]
    assert Path("out/turn.nc").read_bytes() != before
    Path("out/turn.nc").write_text("mine", encoding="utf-8")
    assert robsim("compare", "turn.toml", "-o", "out")[0] == 2
    assert Path("out/turn.nc").read_text(encoding="utf-8") == "mine"


def test_a_warning_of_a_scheme_is_one_line(robsim):
    line = TURN.replace('"0, 20, 100 cm", "20, 20, 100 cm"', '"40, 0, 100 cm"')
    Path("turn.toml").write_text(line, encoding="utf-8")
    status, _, err = robsim("compare", "turn.toml", "--no-figures")
    assert status == 0 and err.startswith("warning: the features of 'dots' fix only 5")
    assert len(err.splitlines()) == 1


def test_ctrl_c_keeps_the_simulated_part(robsim, monkeypatch):
    run_of = stop_at_the_second(monkeypatch)
    status, out, err = robsim("compare", "turn.toml", "--vary", "task.gain=1,2,3", "-o", "out")
    assert status == 130 and "stopped; what was simulated so far is in out" in err and out == ""
    assert files("out") == ["1.nc", "2.nc", "comparison.csv", "comparison.nc"]
    run = run_of(rs.load_scenario("turn.toml", ["task.gain=2"]))
    np.testing.assert_array_equal(rs.open_run("out/2.nc").q, run.q)


def test_ctrl_c_while_the_figure_is_drawn_keeps_the_runs(robsim, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("robsim.cli.compare_command.save_figure", interrupt)
    status, _, err = robsim("compare", "turn.toml", "-o", "out")
    assert status == 130 and "the runs are complete" in err
    assert files("out") == ["comparison.csv", "comparison.nc", "turn.nc"]


def test_examples_can_be_compared(robsim):
    names = ("visp_tutorial", "chapter_6_2")
    paths = [examples.path(name) for name in names]
    status, out, _ = robsim("compare", *paths, "-o", "out")
    assert status == 0 and Path("out/comparison.png").stat().st_size > 20_000
    assert "note: another scene than visp_tutorial: chapter_6_2" in out
