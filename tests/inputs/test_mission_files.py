"""Scenario files of missions: refusals and their messages; and the commands."""

from pathlib import Path

import pytest
from click.testing import CliRunner

import robsim as rs
from robsim.cli.commands import cli

TOP = """
schema = 1
robots = [{ model = "planar_2r" }, { model = "conveyor" }]
objects = [{ name = "cup", marks = ["0, 0, 5 cm"], position = "120, 90, 0 cm" }]
[task]
kind = "mission"
"""
GO = 'task = { kind = "follow_joints", by = { upper = "10 deg" }, duration = "1 s" }\n'


def phase(*lines, name="a", task=GO):
    return "\n".join(["[[task.phases]]", f'name = "{name}"', task, *lines, ""])


def test_every_key_of_a_phase():
    text = TOP + phase(
        'duration = "1500 ms"',
        'attach = { cup = "planar_2r.fore" }',
        'expects = ["time_limit", "joint_limit"]',
    )
    text += phase('release = "cup"', name="let it go")
    first, second = rs.Experiment.from_text(text).task.phases
    assert (first.duration, first.attach) == (1.5, {"cup": "planar_2r.fore"})
    assert first.expects == (rs.Outcome.TIME_LIMIT, rs.Outcome.JOINT_LIMIT)
    assert second.release == ("cup",) and second.expects == (rs.Outcome.CONVERGED,)
    assert second.duration is None and second.task.by == {"upper": pytest.approx(0.17453292519943)}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["task.phases: missing"]),
        ("phases = []", ["task.phases", "at least 1 item"]),
        ("phases = 3", ["task.phases", "list"]),
        (phase(task=""), ["task.phases.a.task: missing"]),
        (phase(name="a.b"), ["task.phases.a.b.name: must be a name without dots"]),
        (phase(name=" "), ["name: must be a name without dots"]),
        (phase() + phase(), ["task: two phases are called 'a'"]),
        (phase('durtion = "1 s"'), ["task.phases.a.durtion: unknown key", "mean 'duration'"]),
        (phase("duration = 1"), ["task.phases.a.duration", "unit of time"]),
        (phase('release = ["cap"]'), ["task.phases.a.release: no object 'cap'", "mean 'cup'"]),
        (phase('attach = { cap = "world" }'), ["task.phases.a.attach: no object 'cap'"]),
        (phase('attach = { cup = "planar_2r.for" }'), ["task.phases.a.attach", "'planar_2r.fore'"]),
        (phase("attach = { cup = 1 }"), ["task.phases.a.attach"]),
        (phase("attach = 3"), ["task.phases.a.attach", '{ object = "frame" }']),
        (
            phase('expects = ["convergd"]'),
            ["task.phases.a.expects[0]", "'converged'", "'singular'"],
        ),
        (phase("expects = []"), ["task.phases.a.expects", "at least 1"]),
        (
            phase('release = ["cup"]', 'attach = { cup = "world" }'),
            ["task.phases.a", "attach and release of 'cup' at once"],
        ),
        (
            phase(task='task = { kind = "ibsv" }'),
            ["task.phases.a.task.kind: no kind 'ibsv'", "ibvs"],
        ),
        (
            phase(task='task = { kind = "mission", phases = [] }'),
            ["task.phases.a.task.kind: no kind 'mission'"],
        ),
        (
            phase(task=GO.replace('upper = "10 deg"', 'belt = "10 deg"')),
            ["task.phases.a.task.by.belt", "length"],
        ),
    ],
)
def test_each_fault_is_reported_at_its_place(text, words):
    with pytest.raises(rs.errors.FileError) as caught:
        rs.Experiment.from_text(TOP + text)
    for word in words:
        assert word in str(caught.value)


def robsim(*arguments):
    return CliRunner().invoke(cli, [str(each) for each in arguments])


def test_the_commands_accept_missions(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = TOP + phase() + phase(name="b")
    Path("mission.toml").write_text(text, encoding="utf-8")
    assert robsim("check", "mission.toml").exit_code == 0
    done = robsim("run", "mission.toml", "-o", "out")
    assert done.exit_code == 0, done.output
    assert "    0.00 to 1.00 s  a  converged\n    1.00 to 2.00 s  b  converged\n" in done.output
    assert sorted(path.name for path in Path("out").iterdir()) == [
        "run.nc",
        "scenario.toml",
        "scene.png",
    ]
    run = rs.open_run("out/run.nc")
    assert run.attrs["succeeded"] == 1 and run.sizes["time"] == 51
    again = rs.Experiment.of(run).run()
    assert again.run.identical(run)
    explanation = robsim("explain", "out")
    assert explanation.exit_code == 1 and "this is a whole mission" in str(explanation.exception)
    short = robsim("run", "mission.toml", "--set", "task.phases.b.duration=400 ms", "-o", "short")
    assert "b  time limit" in short.output and "not completed" in short.output
    wrong = robsim("check", "mission.toml", "--set", "task.phases.c.duration=1 s")
    assert wrong.exit_code == 1 and "task.phases.c: there is none to change" in str(wrong.exception)
