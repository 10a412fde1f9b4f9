"""Texts that nobody checked: the key that a refusal names, and its time."""

import io
import sys

import pytest

import robsim as rs
from robsim.cli.console import print_text

SCENE = """schema = 1
robots = [{ model = "free_camera" }]
objects = [{ name = "dots", marks = ["0,0,1 m", "1,0,9 m", "0,1,9 m", "1,1,9 m"] }]
cameras = [{ name = "eye", on = "free_camera.body", focal = 800, size = [640, 480] }]
"""
WHEN = 'when = { kind = "error_below", value = 0.1 }'
LEAF = '{ kind = "ibvs" }'


def switch(first, second=LEAF):
    return f'{{ kind = "switch", first = {first}, second = {second}, {WHEN} }}'


def tree(depth):
    return LEAF if not depth else switch(tree(depth - 1), tree(depth - 1))


def chain(depth):
    return LEAF if depth == 1 else switch(chain(depth - 1))


def checked(task=LEAF, old="", new="", more=""):
    experiment = rs.Experiment.from_text(f"{SCENE.replace(old, new, 1)}task = {task}\n{more}")
    experiment.check()
    return experiment


def get_refusal(*args, **kwargs):
    with pytest.raises((rs.errors.FileError, rs.errors.GoalError)) as caught:
        checked(*args, **kwargs)
    return str(caught.value)


EYE = '{ name = "eye", on = "free_camera.body", focal = 800, size = [640, 480] }'
BOX = '{ name = "box", on = "lid" }, { name = "lid", on = "box" }, { name = "dots"'
ARM = '{ name = "a", links = [{ name = "b" }], on = "a.b" }, { model = "free_camera" }'
SPEED = 'rates = ["1 m/s", "0 m/s", "0 m/s", "0 rad/s", "0 rad/s", "0 rad/s"]'


@pytest.mark.parametrize(
    ("said", "key"),
    [
        ({"old": EYE, "new": f"{EYE}, {EYE}"}, "cameras.eye: two things in the scene are called"),
        ({"old": '{ name = "dots"', "new": BOX}, "objects.box: 'box' is its own ancestor"),
        ({"old": '{ model = "free_camera" }', "new": ARM}, "robots.a.b: 'a.b' is its own ancestor"),
        (
            {"more": f'[[motions]]\nrobot = "free_camera"\n{SPEED}\n' * 2},
            "motions.free_camera: two motions for one robot",
        ),
        (
            {"task": '{ kind = "ibvs", features = { kind = "points", marks = [9] } }'},
            "task.features: 'dots' has 4 marks",
        ),
        (
            {"task": f'{{ kind = "parallel", tasks = [{LEAF}, {LEAF}] }}'},
            "task: two tasks command one joint",
        ),
        (
            {"task": switch(LEAF, '{ kind = "ibvs", features = "stereo_points" }')},
            "task.second.features: StereoPoints needs two cameras",
        ),
        (
            {"task": switch(LEAF, '{ kind = "ibvs", goal = { position = "9, 9, 9 m" }}')},
            "task.second.goal: the shown goal puts mark",
        ),
        (
            {"more": '[[belief.objects]]\nname = "dots"\nmarks = ["0, 0, 1 m"]\n'},
            "task.belief: the belief has 1 marks on 'dots', the scene 4",
        ),
        ({"more": '[run]\ndt = "1 s"\nduration = "0.5 s"\n'}, "run.duration: dt 1 s is longer"),
        (
            {"more": '[sensing]\nperiod = "50 ms"\n'},
            "sensing: the period of the camera, 0.05 s, must be a multiple",
        ),
        ({"more": '[run]\ndt = "1e-8 s"\n'}, "run: duration 10 s in periods of 1e-08 s are more"),
    ],
)
def test_a_refusal_names_its_key(said, key):
    """Also when the parts of an experiment are checked, or brought together."""
    assert get_refusal(**said).startswith(f"<text>: {key}")


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("title = 'x", 'not valid TOML: Expected "\'" (at line 6, the end)'),
        (f"x = {'[' * 3000}", "brackets are nested too deeply (line 6)"),
        (f"x = {'9' * 5000}", "a number of 5000 digits; at most 4300 are read (line 6)"),
        (f"x = 0x{'f' * 5000}", "x: unknown key 'x'"),
        ("".join(f"[a.b.c.d.e.f.g.h{i}]\n" for i in range(1001)), "more than 1000 keys of 8 parts"),
    ],
)
def test_invalid_toml_is_reported_with_its_line(more, message):
    assert message in get_refusal(more=more)


def test_a_whole_number_that_python_cannot_write_is_shown():
    assert "run.seed" in get_refusal(more=f"[run]\nseed = 0x{'f' * 5000}\n")


@pytest.mark.parametrize("kind", ["cameras", "objects", "robots"])
def test_a_part_is_believed_once(kind):
    name = {"cameras": "eye", "objects": "dots", "robots": "free_camera"}[kind]
    text = f'[[belief.{kind}]]\nname = "{name}"\n'
    assert get_refusal(more=2 * text) == (
        f"<text>: belief.{kind}.{name}: there are two tables of this name; give one"
    )
    assert checked(more=text).task.belief.robots[0].name == "free_camera"


def test_a_robot_is_believed_once_also_by_its_model():
    text = '[[belief.robots]]\nname = "free_camera"\n[[belief.robots]]\nmodel = "free_camera"\n'
    assert "belief.robots.free_camera: there are two tables" in get_refusal(more=text)


def test_tasks_within_tasks_are_counted():
    """A tree of 4096 schemes took a minute and a half."""
    assert checked(tree(6)).task.second.second.first.when.value == 0.1
    assert "task: composed of more than 64 tasks" in get_refusal(tree(7))
    assert "more than 1100 tasks, nested tasks included" in get_refusal(tree(12))
    assert checked(chain(16)).task.first.first.second == rs.IBVS()
    assert "tasks are nested more than 16 deep" in get_refusal(chain(17))
    assert "tasks are nested more than 16 deep" in get_refusal(chain(60))


def test_python_counts_tasks_as_well():
    one = rs.IBVS()
    with pytest.raises(rs.errors.InputError, match="more than 64 tasks"):
        for _ in range(60):
            one = rs.Switch(one, one, rs.tasks.ErrorBelow(0.1))


def test_the_features_of_all_tasks_are_counted():
    marks = ", ".join(f'"{i % 100}, {i // 100}, 1000 mm"' for i in range(10_000))
    several = '{ kind = "ibvs", features = ["points", "points"] }'
    message = get_refusal(switch(several), '"0,0,1 m", "1,0,9 m", "0,1,9 m", "1,1,9 m"', marks)
    assert message == "<text>: task.second: all tasks together have more than 40000 features"


def test_only_so_many_robots_are_looked_up():
    """100 000 models took 20 s, and then one line reported that there are too many."""
    many = ", ".join(['{ model = "none" }'] * 65)
    message = get_refusal(old='{ model = "free_camera" }', new=many)
    assert message.startswith("<text>: robots: must have at most 64 items, not 65")


def test_of_many_problems_ten_are_kept():
    phases = ", ".join(f'{{ name = "p{i}", task = {{ kind = "x{i}" }} }}' for i in range(900))
    lines = get_refusal(f'{{ kind = "mission", phases = [{phases}] }}').splitlines()
    assert len(lines) == 11 and lines[-1] == "<text>: and 890 more"


@pytest.mark.parametrize(
    ("encoding", "shown"),
    [
        ("ascii", "\\u03a9 \\x1b[31m caf\\xe9"),
        ("latin-1", "\\u03a9 \\x1b[31m café"),
        ("cp1252", "\\u03a9 \\x1b[31m café"),
        ("cp437", "Ω \\x1b[31m café"),
        ("utf-8", "Ω \\x1b[31m café"),
    ],
)
@pytest.mark.parametrize("stream", ["stdout", "stderr"])
def test_a_title_is_shown_by_any_terminal(monkeypatch, encoding, shown, stream):
    """Escapes all characters outside its encoding, and controls, which could write anywhere."""
    written = io.BytesIO()
    monkeypatch.setattr(sys, stream, io.TextIOWrapper(written, encoding, errors="strict"))
    print_text("Ω \x1b[31m café", err=stream == "stderr")
    assert written.getvalue().decode(encoding) == f"{shown}\n"
