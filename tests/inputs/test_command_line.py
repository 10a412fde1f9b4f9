"""The command line: exit status, messages, files, and that nothing of the user's is lost."""

import os
import re
import select
import signal
import struct
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import robsim as rs
from robsim import examples
from robsim.base import environment
from robsim.errors import InputError
from robsim.kernels.machine import cache_files

try:
    import pty
except ImportError:  # there are no pseudo-terminals here
    pty = None

SCENARIO = """
schema = 1
title = "A lift"

[[robots]]
name = "lift"
[[robots.links]]
name = "base"
[[robots.links]]
name = "deck"
joint = "prismatic"
dh = { theta = "0 deg", d = "0 cm", a = "0 cm", alpha = "0 deg" }
limits = ["0 cm", "50 cm"]

[[objects]]
name = "dots"
marks = ["10, 0, 100 cm", "0, 10, 100 cm", "10, 10, 120 cm"]

[[cameras]]
name = "eye"
on = "lift.deck"
rpy = "0, 0, 0 deg"
size = [640, 480]
K = [[800, 0, 320], [0, 800, 240], [0, 0, 1]]

[task]
kind = "ibvs"
camera = "eye"
target = "dots"
gain = 2

[task.goal]
q = ["40 cm"]

[start]
q = ["10 cm"]

[run]
dt = "40 ms"
duration = "4 s"
"""
NOBODY = 65534  # the user who owns nothing
ENDLESS = """
schema = 1
title = "Without end"
robots = [{ model = "free_camera" }]
objects = [{ name = "dots", marks = ["0, 0, 1 m", "10, 0, 100 cm", "0, 10, 100 cm"] }]
cameras = [{ name = "eye", on = "free_camera.body", focal = 800, center = [320, 240] }]
task = { kind = "ibvs", tolerance = 1e-12 }
run = { dt = "1 ms", duration = "300 s", record = 1000 }
sensing = { noise = 1.0 }
"""


@dataclass
class Done:
    """The names of the files that a command left behind."""

    status: int
    out: str
    err: str

    def told(self, *parts):
        """Refused with one message that has these parts."""
        assert self.status == 2, (self.out, self.err)
        assert self.err.startswith("error: ") and self.err.count("error:") == 1, self.err
        for part in parts:
            assert str(part) in self.err, (part, self.err)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty folder to be in, with a scenario file."""
    monkeypatch.chdir(tmp_path)
    Path("lift.toml").write_text(SCENARIO, encoding="utf-8")
    return tmp_path


@pytest.fixture
def robsim(here, called):
    """`robsim ARGUMENTS` in this process."""

    return lambda *arguments: Done(*called(*arguments))


def process(*arguments, **settings):
    """`python -m robsim ARGUMENTS` in a process of its own."""
    command = [sys.executable, "-m", "robsim", *map(str, arguments)]
    done = subprocess.run(
        command, check=False, capture_output=True, text=True, timeout=300, **settings
    )
    assert "Traceback" not in done.stdout + done.stderr
    return Done(done.returncode, done.stdout, done.stderr)


def write_changed_scenario(old="", new="", path="bad.toml"):
    """The scenario file with one thing changed."""
    assert old in SCENARIO
    Path(path).write_text(SCENARIO.replace(old, new) if old else new, encoding="utf-8")
    return path


def files(folder="."):
    return sorted(str(p.relative_to(folder)) for p in Path(folder).rglob("*"))


def png_size(path):
    """(width, height) in pixels, from the head of the file."""
    head = Path(path).read_bytes()[:24]
    assert head[:8] == b"\x89PNG\r\n\x1a\n" and head[12:16] == b"IHDR"
    return struct.unpack(">II", head[16:24])


def same(a, b):
    assert set(a.variables) == set(b.variables)
    for name in a.variables:
        np.testing.assert_array_equal(a[name], b[name], err_msg=name)


# ---- what works ----


def test_the_demo_leaves_run_scenario_figures_and_page(robsim, here):
    done = robsim("demo", "--no-open")
    assert done.status == 0 and "section 6.1" in done.out
    for words in ("outcome      converged", "time  ", " s\n", " px\n", "path length", " cm\n"):
        assert words in done.out
    assert "results      robsim-demo" in done.out
    folder = here / "robsim-demo"
    pictures = ["image.png", "scene.png", "velocity.png"]
    assert files(folder) == sorted([*pictures, "run.html", "run.nc", "scenario.toml"])
    run = rs.open_run(folder / "run.nc")
    assert rs.Outcome(int(run.outcome)) == rs.Outcome.CONVERGED
    same(run, rs.load_scenario(folder / "scenario.toml").run())
    same(run, rs.replay(run))
    for name in ("image", "scene", "velocity"):
        path = folder / f"{name}.png"
        width, height = png_size(path)
        assert 600 <= width <= 6000 and 400 <= height <= 6000
        assert path.stat().st_size > 10_000  # something is drawn


def test_run_obeys_set_and_output(robsim):
    done = robsim("run", "lift.toml", "--set", "task.gain=3", "--set", "run.dt=20 ms", "-o", "out")
    assert done.status == 0 and done.out.startswith("A lift\n") and "results      out" in done.out
    assert files("out") == ["image.png", "run.nc", "scenario.toml", "scene.png", "velocity.png"]
    scenario = rs.load_scenario("out/scenario.toml")
    assert scenario.task.gain == 3 and scenario.dt == 0.02
    same(rs.open_run("out/run.nc"), scenario.run())
    assert Path("lift.toml").read_text(encoding="utf-8") == SCENARIO


def test_a_run_that_goes_wrong_is_still_a_run(robsim):
    done = robsim("run", "lift.toml", "--set", "task.gain=60", "-o", "out", "--no-figures")
    assert done.status == 0
    assert "outcome      joint limit: a joint left its limits; try" in done.out
    assert files("out") == ["run.nc", "scenario.toml"]


def test_a_target_behind_the_camera_at_the_start_is_an_outcome_at_time_zero(robsim):
    marks = 'marks = ["10, 0, 45 cm", "0, 10, 45 cm", "10, 10, 46 cm"]'
    write_changed_scenario(re.search("marks = .*", SCENARIO)[0], marks, "near.toml")
    text = Path("near.toml").read_text(encoding="utf-8")
    Path("near.toml").write_text(text.replace('["40 cm"]', '["1 cm"]').replace(
        '["10 cm"]', '["50 cm"]'), encoding="utf-8")  # fmt: skip
    done = robsim("run", "near.toml")
    assert done.status == 0, done.err
    assert "outcome      behind camera: " in done.out and "time         0.00 s" in done.out
    assert "nan" not in done.out


def test_a_run_that_goes_wrong_is_explained(robsim):
    out = robsim("run", "lift.toml", "--set", "task.gain=60", "-o", "out", "--no-figures").out
    assert "\nwhy          robsim explain out\n" in out
    done = robsim("explain", "out")
    assert (done.status, done.err) == (0, "")
    assert done.out == f"{rs.explain(rs.open_run('out/run.nc'))}\n"
    assert re.match(r"After 0.04 s joint 'deck' passed its upper limit of 0.5 m", done.out)
    assert "\nWhy: The gain is too high for the period" in done.out
    assert "\nTry: With a quarter of the gain (15 per second)" in done.out
    assert robsim("explain", "out/run.nc").out == done.out
    read = robsim("explain", "out", "--no-trials").out
    assert read.startswith(done.out.splitlines()[0]) and "Try: " not in read


def test_a_run_that_converged_gives_no_hint_and_is_explained(robsim):
    longer = ["--set", "run.duration=6 s", "-o", "out", "--no-figures"]
    assert "explain" not in robsim("run", "lift.toml", *longer).out
    assert "the run converged: every error is below" in robsim("explain", "out").out


def test_a_robot_that_its_safety_holds_gets_no_advice_on_its_law(robsim):
    held = ["--set", "safety.margin=15 cm", "-o", "out", "--no-figures"]
    out = robsim("run", "lift.toml", *held).out
    words = "although the error remains; the margin of the joint limits may hold the robot\n"
    assert f"local minimum: no motion is commanded {words}" in out and "robsim explain out" in out
    assert "The safety stops joint deck 150 mm before its limit." in robsim("explain", "out").out


def test_a_run_that_cannot_be_explained_is_reported(robsim):
    robsim("explain", "nothing").told("nothing: no such file")
    robsim("explain", ".").told("run.nc: no such file")
    robsim("explain", "lift.toml").told(
        "lift.toml is not a run but a TOML file: simulate it (robsim run lift.toml), and give the"
    )
    run = rs.load_scenario("lift.toml").run(duration=0.4)
    rs.save_run(run.assign_attrs(scenario=""), "mute.nc")
    robsim("explain", "mute.nc").told("mute.nc: this run cannot be repeated from its own text")
    rs.save_run(run.assign(q_end=run.q_end + 1), "other.nc")
    robsim("explain", "other.nc").told("other.nc: this run is not reproduced: q_end[deck] is")
    batch = rs.load_scenario("lift.toml").run(start=[[0.1], [0.2]], duration=0.4)
    rs.save_run(batch, "batch.nc")
    robsim("explain", "batch.nc").told("batch.nc: expected one run, got 2: pick one")


def test_without_an_output_folder_the_next_free_name_is_taken(robsim):
    for folder in ("lift-run", "lift-run-2", "lift-run-3"):
        done = robsim("run", "lift.toml", "--no-figures")
        assert done.status == 0 and done.out.rstrip().endswith(f"results      {folder}")
        assert files(folder) == ["run.nc", "scenario.toml"]
    Path("robsim-demo").mkdir()
    assert robsim("demo", "--no-figures").out.rstrip().endswith("results      robsim-demo-2")
    assert files("robsim-demo") == []


def test_check_tries_goal_and_start_and_simulates_nothing(robsim):
    done = robsim("check", "lift.toml", "--set", "task.gain=3")
    assert done.status == 0 and done.err == ""
    assert done.out.splitlines() == [
        "lift.toml: no problems",
        "  robots   lift (1 velocities)",
        "  cameras  eye",
        "  objects  dots (3 marks)",
    ]
    assert files() == ["lift.toml"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ('sensing.period="50 ms"', "0.05 s, must be a multiple of the control period, 0.04 s"),
        ('sensing.occlusions=[{ marks = [9], start = "1 s" }]', "there is no 9"),
        (
            'sensing.occlusions=[{ marks = [0], start = "1 s", target = "dot" }]',
            "no target 'dot'; did you mean 'dots'?",
        ),
    ],
)
def test_check_refuses_the_same_scenarios_as_a_run(robsim, change, words):
    for command in ("check", "run"):
        done = robsim(command, "lift.toml", "--set", change)
        assert done.status == 2 and words in done.err


@pytest.mark.parametrize("command", ["check", "run"])
def test_a_warning_is_one_line_for_the_user(robsim, command):
    line = ENDLESS.replace('"0, 10, 100 cm"', '"20, 0, 100 cm"').replace("300 s", "1 s")
    Path("line.toml").write_text(line, encoding="utf-8")
    done = robsim(command, "line.toml", *(["--no-figures"] if command == "run" else []))
    assert done.status == 0
    warning = [text for text in done.err.splitlines() if "warning" in text.lower()]
    assert len(warning) == 1 and ".py" not in done.err
    assert warning[0].startswith("warning: the features of 'dots' fix only 5 of the 6 motions")
    assert "its marks lie on one line" in warning[0]


def test_examples_are_listed_and_copied_out(robsim, here):
    done = robsim("examples")
    assert done.status == 0 and done.out.endswith("copy one to a file: robsim examples NAME\n")
    for name in examples.names():
        assert name in done.out
    done = robsim("examples", "visp_tutorial")
    assert done.status == 0 and done.out.startswith(
        "wrote visp_tutorial.toml; run it with: robsim run visp_tutorial.toml\n"
        "wrote robsim.schema.json, the schema for editors that complete and check it\n"
        "The case of ViSP's tutorial on image-based servoing: "
    )
    source = examples.path("visp_tutorial").read_text(encoding="utf-8")
    assert Path("visp_tutorial.toml").read_text(encoding="utf-8") == source
    Path("folder").mkdir()
    robsim("examples", "visp_tutorial", "-o", "folder")
    robsim("examples", "visp_tutorial", "-o", "new/mine.toml")
    for path in ("folder/visp_tutorial.toml", "new/mine.toml"):
        assert Path(path).read_text(encoding="utf-8") == source
    assert robsim("check", "new/mine.toml").status == 0


def test_robots_are_listed_with_their_links(robsim):
    done = robsim("robots")
    assert done.status == 0 and done.err == ""
    for name in rs.robots.names():
        assert f"{name} " in done.out and rs.robots.about(name) in done.out
    assert "links: base, body" in done.out


def test_help_and_version(robsim):
    for arguments in (["--help"], ["-h"], ["run", "--help"]):
        done = robsim(*arguments)
        assert done.status == 0 and "Usage: " in done.out
    nothing = robsim()
    assert "Usage: " in nothing.out + nothing.err
    assert rs.__version__ in robsim("--version").out


# ---- bad input ----

ROTATION = "rotation = [[1, 0, 0], [0, 2, 0], [0, 0, 1]]"
BAD = {
    "broken TOML": ("[task]", "[task", "not valid TOML", "line"),
    "no schema": ("schema = 1", "", "schema", "missing", "schema = 1"),
    "another schema": ("schema = 1", "schema = 7", "schema", "7", "schema = 1"),
    "a text for a number": ("gain = 2", 'gain = "2"', "task.gain", "'2'", "number"),
    "a number for a text": ('name = "dots"', "name = 3", "name", "3", "starts with a letter"),
    "NaN": ("gain = 2", "gain = nan", "task.gain", "nan", "finite"),
    "infinity": ("800, 0, 320", "inf, 0, 320", "cameras.eye.K", "inf", "finite"),
    "no unit": ('["10 cm"]', '["10"]', "start.q[0]", "'10'", "cm", "m"),
    "an angle for a length": ('["40 cm"]', '["40 deg"]', "task.goal.q[0]", "'40 deg'", "cm"),
    "a length for a time": ('"40 ms"', '"40 cm"', "run.dt", "'40 cm'", "ms"),
    "unknown key": ("gain = 2", "gian = 2", "task", "'gian'", "did you mean 'gain'?"),
    "unknown robot": (
        "[[objects]]", '[[robots]]\nmodel = "puma"\n[[objects]]', "'puma'", "mean 'puma560'?"),
    "unknown frame": ('"lift.deck"', '"lift.dek"', "cameras.eye.on", "'lift.dek'", "'lift.deck'"),
    "unknown camera": ('camera = "eye"', 'camera = "ey"', "task.camera", "'ey'", "'eye'"),
    "unknown target": ('target = "dots"', 'target = "dot"', "task.target", "'dot'", "'dots'"),
    "unknown task": ('kind = "ibvs"', 'kind = "ibsv"', "task.kind", "'ibsv'", "'ibvs'"),
    "DH of another shape": (
        ', alpha = "0 deg"', ', alhpa = "0 deg"', "robots.lift.links.deck.dh.alhpa", "'alpha'"),
    "too many coordinates": ('["10 cm"]', '["1 cm", "2 cm"]', "start.q", "2", "expected 1: deck"),
    "start outside": ('["10 cm"]', '["51 cm"]', "start", "'deck'", "0.51", "[0, 0.5]"),
    "goal outside": ('["40 cm"]', '["51 cm"]', "task.goal", "'deck'", "0.51", "[0, 0.5]"),
    "no rotation": ('rpy = "0, 0, 0 deg"', ROTATION, "cameras.eye.rotation", "not a rotation"),
    "K of no focal length": ("[0, 800, 240]", "[0, 0, 240]", "cameras.eye.K", "above zero"),
    "a goal behind the camera": (
        "10, 0, 100 cm", "10, 0, 30 cm", "task.goal", "mark 0 of 'dots' behind camera 'eye'"),
    "a goal out of the image": (
        "10, 0, 100 cm", "90, 0, 100 cm", "task.goal", "mark 0 of 'dots' out of the image"),
    "dt of zero": ('"40 ms"', '"0 ms"', "run.dt", "'0 ms'", "greater than 0"),
    "a negative dt": ('"40 ms"', '"-40 ms"', "run.dt", "'-40 ms'", "greater than 0"),
    "a negative duration": ('"4 s"', '"-4 s"', "run.duration", "'-4 s'"),
    "too many steps": ('"4 s"', '"1e9 s"', "run", "1e+09 s", "0.04 s", "steps"),
    "a gain of zero": ("gain = 2", "gain = 0", "task.gain", "0", "greater than 0"),
    "a negative gain": ("gain = 2", "gain = -2", "task.gain", "-2", "greater than 0"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
@pytest.mark.parametrize("command", ["run", "check"])
def test_bad_input_is_reported_with_file_key_value_and_a_valid_value(robsim, command, case):
    old, new, *parts = BAD[case]
    robsim(command, write_changed_scenario(old, new)).told("bad.toml", *parts)
    assert files() == ["bad.toml", "lift.toml"]


def test_files_that_cannot_be_read_are_reported(robsim):
    Path("empty.toml").touch()
    Path("huge.toml").write_bytes(b"# nothing\n" * 500_000)
    Path("binary.toml").write_bytes(bytes(range(256)))
    Path("folder.toml").mkdir()
    before = files()
    for command in ("run", "check"):
        robsim(command, "missing.toml").told("missing.toml: no such file")
        robsim(command, "empty.toml").told("empty.toml: empty; a file starts with schema = 1")
        robsim(command, "huge.toml").told("huge.toml: larger than 2 MB")
        robsim(command, "binary.toml").told("binary.toml: not text", "UTF-8")
        robsim(command, "folder.toml").told("folder.toml: this is a folder")
        robsim(command, "x" * 300).told("xxxxx")
        robsim(command, "lift.toml/x").told("lift.toml/x: no such file")
        robsim(command, "").told("this is a folder")
    assert files() == before


def test_a_change_that_cannot_be_made_is_reported(robsim):
    for change, *parts in (
        ("task.gian=2", "'gian'", "did you mean 'gain'?"),
        ("task.gain", "expected key=value, as in task.gain=2"),
        ("task.gain=fast", "task.gain", "'fast'"),
        ("cameras.ey.size=[1, 1]", "cameras.ey", "did you mean 'eye'?"),
        ("run.dt=40", "run.dt", "40", "ms"),
    ):
        for command in ("run", "check"):
            robsim(command, "lift.toml", "--set", change).told("lift.toml", *parts)
    assert files() == ["lift.toml"]


def test_a_record_beyond_the_memory_is_refused_and_leaves_nothing(robsim, monkeypatch):
    monkeypatch.setattr("robsim.engine.recorder.get_free_memory", lambda: 4e9)
    changes = ("--set", "run.duration=9000 s", "--set", "run.dt=1 ms", "--set", "run.record=all")
    robsim("run", "lift.toml", *changes).told("lift.toml", "9000001 recorded instants", "4.0 GB")
    robsim("run", "lift.toml", *changes, "-o", "a/b").told("4.0 GB are free", "record=")
    assert "run.nc" not in " ".join(files())


def test_unknown_commands_options_and_names_are_reported(robsim):
    for arguments, part in (
        (["rum"], "No such command 'rum'"),
        (["run"], "Missing argument 'FILE'"),
        (["run", "lift.toml", "--foce"], "No such option"),
        (["run", "lift.toml", "-o"], "requires an argument"),
    ):
        done = robsim(*arguments)
        assert done.status == 2 and part in done.err + done.out
    robsim("examples", "chapter").told("no example 'chapter'", "chapter_6_1", "examples:")
    assert files() == ["lift.toml"]


def test_bad_input_has_status_2_in_a_process_too(here):
    done = process("run", write_changed_scenario("gain = 2", "gain = 0"))
    done.told("bad.toml", "task.gain")
    assert done.out == "" and len(done.err.splitlines()) == 1


# ---- where results cannot go ----


def test_a_folder_that_cannot_be_written_is_reported_before_anything_runs(robsim):
    Path("file").write_text("mine", encoding="utf-8")
    for folder in ("file", "file/below", "/proc/none/out", "x" * 300):
        for command in (["run", "lift.toml"], ["demo"]):
            done = robsim(*command, "-o", folder)
            done.told("cannot write", folder)
            assert done.out == ""
    robsim("examples", "visp_tutorial", "-o", "file/below.toml").told("cannot write")
    robsim("examples", "visp_tutorial", "-o", "x" * 300).told("cannot write")
    assert files() == ["file", "lift.toml"]
    assert Path("file").read_text(encoding="utf-8") == "mine"


@pytest.fixture
def locked(here, robsim):
    """A folder that the user of this process may not write to; root, who may, becomes nobody.

    Nobody may not read what root has installed, which has been read before.
    """
    robsim("run", "lift.toml", "-o", "open")
    folder, root = here / "locked", os.geteuid() == 0
    folder.mkdir(mode=0o500)
    if root:
        here.chmod(0o755)
        os.chown(folder, NOBODY, -1)
        os.seteuid(NOBODY)
    yield folder
    if root:
        os.seteuid(0)


@pytest.mark.full
@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="there are no such permissions here")
def test_a_folder_without_permission_is_reported(locked, robsim):
    robsim("run", "lift.toml", "-o", "locked").told("cannot write locked: Permission denied")
    robsim("run", "lift.toml", "-o", "locked/out").told("Permission denied")


def test_a_figure_that_cannot_be_written_is_reported_and_the_run_is_kept(robsim):
    Path("out/scene.png").mkdir(parents=True)
    robsim("run", "lift.toml", "-o", "out", "--force").told("cannot write", "scene.png")
    assert rs.open_run("out/run.nc").attrs["title"] == "RobSim run"


# ---- nothing of the user's is lost ----


def test_a_run_is_not_written_over_without_force(robsim):
    robsim("run", "lift.toml", "-o", "out")
    before = {path: Path("out", path).read_bytes() for path in files("out")}
    for command in (["run", "lift.toml"], ["demo"]):
        robsim(*command, "-o", "out").told("out has run.nc, scenario.toml, image.png", "--force")
    assert {path: Path("out", path).read_bytes() for path in files("out")} == before
    done = robsim("run", "lift.toml", "--set", "task.gain=3", "-o", "out", "--force")
    assert done.status == 0
    assert rs.load_scenario("out/scenario.toml").task.gain == 3
    assert Path("out/run.nc").read_bytes() != before["run.nc"]


def test_with_force_no_figure_of_an_older_run_stays(robsim):
    robsim("run", "lift.toml", "-o", "out")
    done = robsim("run", "lift.toml", "-o", "out", "--force", "--no-figures")
    assert done.status == 0 and files("out") == ["run.nc", "scenario.toml"]


@pytest.mark.parametrize("name", ["scenario.toml", "image.png", "velocity.png"])
def test_no_other_file_of_that_name_is_written_over_either(robsim, name):
    Path(name).write_text(SCENARIO, encoding="utf-8")
    robsim("run", "lift.toml", "-o", ".").told(f". has {name} already", "-o", "--force")
    assert Path(name).read_text(encoding="utf-8") == SCENARIO


def test_a_scenario_in_the_folder_of_its_results_survives_a_refusal(robsim):
    Path("scenario.toml").write_text(SCENARIO, encoding="utf-8")
    for change in ("task.gain=0", "task.goal.q=['1 m']", "cameras.eye.size=[1, 1]"):
        done = robsim("run", "scenario.toml", "--set", change, "-o", ".", "--force")
        assert done.status == 2
    assert Path("scenario.toml").read_text(encoding="utf-8") == SCENARIO
    assert robsim("run", "scenario.toml", "-o", ".", "--force", "--no-figures").status == 0
    assert Path("scenario.toml").read_text(encoding="utf-8") == SCENARIO


def test_a_refusal_leaves_no_folder_behind(robsim):
    robsim("run", "lift.toml", "--set", "cameras.eye.size=[1, 1]").told("task.goal")
    robsim("run", "lift.toml", "--set", "cameras.eye.size=[1, 1]", "-o", "out").told("task.goal")
    assert files() == ["lift.toml"]


def test_a_copy_of_an_example_is_not_written_over_without_force(robsim):
    Path("visp_tutorial.toml").write_text("mine", encoding="utf-8")
    robsim("examples", "visp_tutorial").told("visp_tutorial.toml exists", "--force")
    robsim("examples", "visp_tutorial", "-o", ".").told("visp_tutorial.toml exists", "--force")
    assert Path("visp_tutorial.toml").read_text(encoding="utf-8") == "mine"
    assert robsim("examples", "visp_tutorial", "--force").status == 0
    assert Path("visp_tutorial.toml").read_text(encoding="utf-8") != "mine"


# ---- stopping ----


def interrupt(*_):
    raise KeyboardInterrupt


def test_ctrl_c_before_anything_was_simulated_is_a_word_and_status_130(robsim, monkeypatch):
    monkeypatch.setattr("robsim.cli.run_command.load_with_changes", interrupt)
    done = robsim("run", "lift.toml")
    assert (done.status, done.out, done.err.strip()) == (130, "", "stopped")
    assert files() == ["lift.toml"]


def test_ctrl_c_while_figures_are_drawn_keeps_the_run(robsim, monkeypatch):
    monkeypatch.setattr("robsim.cli.run_command.write_run_figures", interrupt)
    done = robsim("run", "lift.toml", "-o", "out")
    assert done.status == 130 and "stopped" in done.err
    same(rs.open_run("out/run.nc"), rs.load_scenario("lift.toml").run())


START = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell may have had it ignored
from robsim.cli import main
main()
"""


@pytest.mark.full
@pytest.mark.skipif(pty is None, reason="there are no pseudo-terminals here")
def test_ctrl_c_in_the_middle_of_a_run_saves_the_simulated_part_and_reports_it(here):
    Path("endless.toml").write_text(ENDLESS, encoding="utf-8")
    ours, theirs = pty.openpty()
    command = [sys.executable, "-c", START, "run", "endless.toml"]
    child = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=theirs, text=True)
    os.close(theirs)
    try:
        seen = read_until(ours, rb"[1-9]\d*%", seconds=200)  # the bar shows progress
        child.send_signal(signal.SIGINT)
        seen += read_until(ours, None, seconds=100)
        out, _ = child.communicate(timeout=100)
    finally:
        child.kill()
        os.close(ours)
    err = seen.decode()
    assert child.returncode == 130
    assert "stopped; what was simulated so far is in endless-run" in err
    assert "Traceback" not in err and out.startswith("Without end\n") and "outcome" not in out
    assert files("endless-run") == ["checkpoint", "run.nc", "scenario.toml"]
    run = rs.open_run("endless-run/run.nc")
    assert rs.Outcome(int(run.outcome)) == rs.Outcome.RUNNING and float(run.end_time) > 0
    done = np.isfinite(run.q.values).all(axis=1)
    count = int(done.sum())
    assert 1 < count == run.sizes["time"]  # cut to the simulated part
    assert rs.load_scenario("endless-run/scenario.toml").to_toml()


def read_until(terminal, pattern, seconds):
    """The output of a terminal until the pattern matches, or to its end."""
    seen, end = b"", time.monotonic() + seconds
    while time.monotonic() < end:
        if not select.select([terminal], [], [], 1.0)[0]:
            continue
        try:
            part = os.read(terminal, 4096)
        except OSError:  # Linux raises this when the other side is closed
            return seen
        seen += part
        if not part or (pattern and re.search(pattern, seen)):
            return seen
    raise AssertionError(f"not within {seconds} s: {seen[-500:]!r}")


@pytest.mark.full
@pytest.mark.skipif(sys.platform == "win32", reason="the shell is not bash")
def test_a_reader_that_goes_away_is_no_traceback(here):
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = subprocess.run(
            [sys.executable, "-m", "robsim", "examples"],
            check=False,
            stdout=writing,
            stderr=subprocess.PIPE,
            text=True,
            timeout=100,
        )
    finally:
        os.close(writing)
    assert "Traceback" not in done.stderr and "Error" not in done.stderr


@pytest.mark.full
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no full device here")
def test_output_to_a_full_device_is_reported_before_anything_is_simulated(here):
    command = [sys.executable, "-m", "robsim", "run", "lift.toml", "-o", "out", "--no-figures"]
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            command, check=False, stdout=full, stderr=subprocess.PIPE, text=True, timeout=100
        )
    assert done.returncode == 2 and not Path("out").exists()
    assert done.stderr == "error: cannot write the output: No space left on device\n"


# ---- variables of the environment ----


@pytest.mark.parametrize(
    ("variable", "value", "expected"),
    [
        ("NUMBA_DISABLE_JIT", "1", "RobSim's kernels require Numba's compiler: unset it"),
        ("NUMBA_NUM_THREADS", "0", "expected a number of threads, at least 1, got '0'"),
        ("NUMBA_NUM_THREADS", "-2", "expected a number of threads, at least 1, got '-2'"),
        ("NUMBA_CPU_FEATURES", "avx2", "expected features with a sign"),
    ],
)
def test_a_variable_that_stops_numba_is_named(variable, value, expected, monkeypatch):
    monkeypatch.setenv(variable, value)
    with pytest.raises(InputError, match=f"{variable}: {expected}"):
        environment.check_numba_variables()


@pytest.mark.parametrize(
    ("variable", "value"),
    [("NUMBA_NUM_THREADS", "4"), ("NUMBA_DISABLE_JIT", "0"), ("NUMBA_CPU_FEATURES", "+avx,-fma")],
)
def test_other_values_are_left_to_numba(variable, value, monkeypatch):
    monkeypatch.setenv(variable, value)
    environment.check_numba_variables()


@pytest.mark.full
def test_variables_of_libraries_are_named_by_the_command(here):
    for setting in ({"NUMBA_NUM_THREADS": "0"}, {"MPLBACKEND": "nonsense"}):
        done = process("run", "lift.toml", "-o", "out", env={**os.environ, **setting})
        assert done.status == 2 and not Path("out").exists()
        assert f"error: environment variable {next(iter(setting))}: expected" in done.err


def test_the_exit_of_a_command_visits_no_objects(here):
    code = "import atexit, gc; atexit.register(lambda: print(gc.get_freeze_count() > 10_000))\n"
    code += "import sys; sys.argv = ['robsim', '--version']; from robsim.cli import main; main()"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.splitlines()[-1] == "True"


# ---- compiling ----


@pytest.mark.first_start
def test_the_first_start_on_a_machine_compiles_and_the_second_does_not(here):
    environment = {k: v for k, v in os.environ.items() if k != "PYTEST_CURRENT_TEST"}
    environment["ROBSIM_CACHE_DIR"] = str(here / "cache")
    runs = ["run", "lift.toml", "--no-figures"]
    first, second = (process(*runs, env=environment) for _ in range(2))
    assert first.status == second.status == 0
    kept = here / "cache" / cache_files.CACHE.name
    assert first.err == f"robsim: compiling kernels, once: they are kept in {kept}\n"
    assert second.err == "" and first.out.replace("lift-run", "lift-run-2") == second.out
    same(rs.open_run("lift-run/run.nc"), rs.open_run("lift-run-2/run.nc"))
