"""`robsim bench` and `rs.bench`: the files that they write, and the input that they refuse."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from stopping import stop_at_the_second

import robsim as rs
from robsim.suites.published import vit_500

VIT = vit_500.suite()
MINE = """
from dataclasses import dataclass
from beside import GAIN
import robsim as rs

@dataclass(frozen=True, eq=False)
class Scheme(rs.IBVS):
    interaction: str = "mean"

def function(goal, gain):
    return rs.PBVS(goal, gain=gain * GAIN)

class Late:
    def command(self, state):
        if state.time > 0.5:
            raise ZeroDivisionError("deep inside")
        return rs.laws.JointLaw().command(state)

task = rs.IBVS(law=Late())
number = 3

def raising(goal, gain):
    return goal.nonsense
"""


@pytest.fixture
def robsim(tmp_path, monkeypatch, called):
    """`robsim ARGUMENTS` in this process, in a folder with a user's file: (status, out, err)."""
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(MINE, encoding="utf-8")
    Path("beside.py").write_text("GAIN = 1.0", encoding="utf-8")
    return called


def files(folder):
    return sorted(path.name for path in Path(folder).iterdir())


@pytest.mark.full
def test_schemes_of_a_file_are_compared_with_the_textbooks(robsim):
    tasks = ("--task", "mine.py:Scheme", "--task", "mine.py:function")
    status, out, err = robsim("bench", "vit_500", *tasks)
    assert (status, err) == (0, "") and out.endswith("results: robsim-bench\n")
    assert files("robsim-bench") == ["bench.csv", "bench.tex", "runs.csv"]
    table = pd.read_csv("robsim-bench/bench.csv").set_index("scheme")
    assert len(table) == 10 and table.loc["mine:Scheme", "successes"] == 412
    like = {"mine:Scheme": "IBVS, L mean", "mine:function": "PBVS, goal form"}
    for own, other in like.items():
        pd.testing.assert_series_equal(table.loc[own], table.loc[other], check_names=False)
    rows = pd.read_csv("robsim-bench/runs.csv")
    assert len(rows) == 10 * 500 and rows["success"].sum() == table["successes"].sum()
    assert "mine:Scheme" in out and "mine:Scheme" in Path("robsim-bench/bench.tex").read_text()


@pytest.mark.full
def test_alone_and_several_suites(robsim):
    own = ("--task", "mine.py:Scheme", "--alone", "-o", "out")
    assert robsim("bench", "vit_500", "gallery", *own)[0] == 0
    table = pd.read_csv("out/bench.csv")
    assert table["suite"].value_counts().to_dict() == {"gallery": 17, "vit_500": 1}
    before = Path("out/bench.csv").read_bytes()
    status, _, err = robsim("bench", "gallery", "-o", "out")
    assert status == 2 and "out has bench.csv, bench.tex, runs.csv already" in err
    assert Path("out/bench.csv").read_bytes() == before
    assert robsim("bench", "gallery", "-o", "out", "--force")[0] == 0
    assert Path("out/bench.csv").read_bytes() != before


def test_the_list_has_every_suite_with_its_title(robsim):
    status, out, _ = robsim("bench", "--list")
    assert status == 0 and files(".") == ["beside.py", "mine.py"]
    names = [line.split()[0] for line in out.splitlines()]
    known = "calibration", "cns_150", "gallery", "large_rolls", "near_limits", "oblique_pairs"
    others = "photometric", "retreat", "shift_lag", "vit_500", "vit_500_images", "vit_500_poster"
    assert names == [*known, *others]


WRONG = {
    "no suite": (["vit500"], "no suite 'vit500'; did you mean 'vit_500'? suites: calibration"),
    "nothing alone": (["--alone"], "--alone needs a scheme"),
    "no name": (["--task", "mine.py"], "--task: expected FILE.py:NAME, as in mine.py:Scheme"),
    "no file": (["--task", "no.py:Scheme"], "--task: no.py: no such file"),
    "a folder": (["--task", ".:Scheme"], "--task: .: no such file"),
    "no Python": (["--task", "text.txt:Scheme"], "text.txt: not a Python file"),
    "no such name": (
        ["--task", "mine.py:Schem"],
        "no 'Schem' in mine.py; did you mean 'Scheme'? there are: Scheme, function, Late, task, "
        "raising",
    ),
    "no such task": (["--task", "mine.py:tusk"], "no 'tusk' in mine.py; did you mean 'task'?"),
    "twice": (["--task", "mine.py:task"] * 2, "two schemes have the name mine:task"),
    "raises": (["--task", "boom.py:x"], "boom.py raised ZeroDivisionError: division by zero"),
    "leaves": (["--task", "exit.py:x"], "exit.py raised SystemExit: 3"),
    "no syntax": (["--task", "syntax.py:x"], "syntax.py, line 2: "),
    "a number": (["--task", "mine.py:number"], "'mine:number': expected a task such as"),
    "raises when made": (["--task", "mine.py:raising"], "'mine:raising' raised AttributeError"),
    "raises in mid-run": (["vit_500", "--task", "mine.py:task"], "raised ZeroDivisionError: deep"),
}


@pytest.mark.parametrize("case", WRONG)
@pytest.mark.few(3)
def test_bad_input_is_reported_and_leaves_nothing(robsim, case):
    Path("boom.py").write_text("x = 1 / 0", encoding="utf-8")
    Path("exit.py").write_text("raise SystemExit(3)", encoding="utf-8")
    Path("syntax.py").write_text("x = 1\ndef (", encoding="utf-8")
    Path("text.txt").write_text("x = 1", encoding="utf-8")
    arguments, message = WRONG[case]
    more = () if case == "nothing alone" or "--task" not in arguments else ("--alone",)
    before = files(".")
    status, out, err = robsim("bench", *arguments, *more)
    assert (status, out) == (2, "") and err.count("error: ") == 1 and message in err, err
    assert set(files(".")) - set(before) <= {"__pycache__"}


def test_ctrl_c_keeps_the_simulated_part(robsim, monkeypatch):
    stop_at_the_second(monkeypatch)
    status, out, err = robsim("bench", "vit_500", "-o", "out")
    assert status == 130 and "stopped; what was simulated so far is in out" in err and out == ""
    assert pd.read_csv("out/bench.csv")["scheme"].tolist() == ["IBVS, L current", "IBVS, L desired"]


def test_a_class_of_ones_own_meets_the_same_errors():
    """A note of camera, depths and images, although no text can name the class."""

    class Mine(rs.PBVS):
        pass

    data = rs.bench("calibration", {"mine": Mine, "plain": rs.PBVS}, builtin=False).data
    own, other = (data[data["scheme"] == name] for name in ("mine", "plain"))
    same = [name for name in data if name != "scheme"]
    assert (own[same].to_numpy() == other[same].to_numpy()).all()


class Raising:
    def command(self, state):
        if state.time > 0.5:
            raise ZeroDivisionError("deep inside")
        return rs.laws.JointLaw().command(state)


BAD = {
    "no such suite": (("vit_50", None), "no suite 'vit_50'; did you mean 'vit_500'?"),
    "no suite at all": (([], None), "expected names of suites"),
    "a suite twice": ((["gallery", "gallery"], None), "a suite occurs twice"),
    "a number": ((3, None), "expected names of suites, got 3"),
    "no names": (("gallery", [rs.IBVS()]), "expected schemes by name"),
    "a text": (("gallery", {"mine": "ibvs"}), "scheme 'mine': expected a task such as"),
    "a taken name": (("gallery", {"2 1/2 D": rs.IBVS()}), "a built-in scheme has this name"),
    "no task": (("vit_500", {"mine": lambda goal, gain: 3}), "expected a task as its result"),
    "no gain": (("vit_500", {"mine": lambda goal: rs.IBVS()}), "'mine' raised TypeError"),
    "a bad task": (("vit_500", {"mine": rs.IBVS(target="cup")}), "in suite 'vit_500': .*cup"),
    "no goal": (("vit_500", {"mine": rs.FollowJoints}), "scheme 'mine'"),
    "raises in mid-run": (
        ("vit_500", {"mine": rs.IBVS(law=Raising())}),
        r"'mine' in suite 'vit_500' raised ZeroDivisionError: deep inside \(.*bench_command.py",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_an_invalid_suite_or_scheme_is_refused(case):
    given, message = BAD[case]
    with pytest.raises(rs.errors.InputError, match=message):
        rs.bench(*given, builtin=False)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"name": ""}, "name of a suite"),
        ({"succeeds": None}, "succeeds: expected a function"),
        ({"goal": VIT.starts}, r"expected a goal \(nq,\) and starts"),
        ({"groups": {"side": ["left"]}}, "side: 1 values for 500 starts"),
        ({"varied": {"task.gain": 3}}, "varied: expected a list for each name"),
        ({"crossed": True}, "two groups are needed"),
        ({"draws": [1, 2]}, r"draws: expected one number for each of 500 starts, got .* \(2,\)"),
        ({"draws": np.linspace(0, 1, 500)}, "draws: expected integers"),
        ({"draws": ["a"] * 500}, "draws"),
        ({"draws": 3}, "draws"),
        ({"columns": {"size": [1.0]}}, "size: 1 values for 500 starts"),
        ({"columns": {"size": [math.nan] * 500}}, r"size: nan at index \(0,\)"),
        ({"columns": {"size": np.ones((500, 2))}}, r"size: expected one number .* \(500, 2\)"),
        ({"columns": {"time": np.ones(500)}}, "the column 'time' would occur twice"),
        ({"groups": {"draw": ["a"] * 500}}, "the column 'draw' would occur twice"),
        ({"version": 0}, "version"),
        ({"duration": -1.0}, "duration"),
        ({"scene": rs.Scene()}, "camera"),
    ],
)
def test_a_suite_that_does_not_fit_is_refused(changes, message):
    with pytest.raises(rs.errors.InputError, match=message):
        replace(VIT, **changes)


def test_a_suite_reports_the_rows_that_succeed():
    for wrong in (lambda rows: 1, lambda rows: rows["time"], lambda rows: rows["tims"] > 1):
        with pytest.raises(rs.errors.InputError, match="succeeds of suite 'vit_500'"):
            rs.bench(replace(VIT, succeeds=wrong), {"mine": rs.IBVS()}, builtin=False)
