"""The gallery: targets and limits that a law loses alone, and keeps within constraints."""

import numpy as np
import pytest

import robsim as rs

WEIGHTS = (
    "task.law=joint",
    'task.weighting=["border"]',
    'task.secondary={kind="avoid_limits", gain=5, margin=0.2}',
)
SIX = 'task.joints=["link1", "link2", "link4", "link5", "link6", "link7"]'
# of an experiment with changes: the outcome, the time of its end in seconds, the path in metres
ENDS = [
    ("base_in_view", (), "CONVERGED", 12.28, 0.816),
    ("base_in_view", WEIGHTS[:1], "OUT_OF_IMAGE", 0.4, 0.268),
    ("seven_joints", (), "CONVERGED", 11.72, 0.769),
    ("seven_joints", WEIGHTS[:1], "JOINT_LIMIT", 0.18, 0.129),
    ("seven_joints", (WEIGHTS[0], WEIGHTS[2]), "CONVERGED", 11.72, 0.770),
    ("seven_joints", (SIX,), "OUT_OF_IMAGE", 1.42, 0.606),
    ("limits_by_constraints", (), "CONVERGED", 8.18, 0.576),
    ("limits_by_constraints", WEIGHTS[:1], "OUT_OF_IMAGE", 0.1, 0.071),
    ("limits_by_constraints", WEIGHTS, "OUT_OF_IMAGE", 0.32, 0.194),
    ("line_of_sight", (), "CONVERGED", 11.76, 1.037),
    ("line_of_sight", WEIGHTS[:1], "CONVERGED", 11.32, 0.949),
    ("line_of_sight", ("objects.ball.position=22, 4, -45 cm",), "LOCAL_MINIMUM", 15.74, 0.483),
    ("view_without_depth", (), "CONVERGED", 22.22, 0.890),
    ("view_without_depth", WEIGHTS[:1], "OUT_OF_IMAGE", 0.46, 0.195),
    ("view_without_depth", ("task.law.constraints.0.depth_error=0",), "OUT_OF_IMAGE", 0.46, 0.204),
]


def run_of(name, *changes):
    return rs.load_scenario(rs.examples.path(name), changes).run()


@pytest.mark.parametrize(("name", "changes", "outcome", "end", "path"), ENDS)
def test_the_runs_end_as_the_remarks_describe(name, changes, outcome, end, path):
    run = run_of(name, *changes)
    assert rs.Outcome(int(run.outcome)).name == outcome
    assert (round(float(run.end_time), 2), round(float(run.path_length), 3)) == (end, path)
    if "slack" in run:
        assert np.nanmax(run.slack) == 0.0


def from_border(run, size):
    """The least distance of each mark from the border of the image, in pixels."""
    pixels = run.pixels.values
    return np.nanmin(np.minimum(pixels + 0.5, np.array(size) - 0.5 - pixels), axis=(0, 2))


@pytest.mark.parametrize(
    ("name", "size", "mark", "least"),
    [
        ("base_in_view", (800, 800), 1, 47.1),
        ("limits_by_constraints", (640, 480), 2, 22.1),
        ("view_without_depth", (640, 480), 3, 9.9),
    ],
)
def test_a_mark_turns_in_front_of_the_border(name, size, mark, least):
    run = run_of(name)
    assert from_border(run, size)[mark] == pytest.approx(least, abs=0.05)
    assert from_border(run, size).min() > 8.0


def test_one_border_holds_the_base_back():
    run = run_of("base_in_view")
    acting = run.constraint.values[(run.active > 0).any("time")]
    assert [each for each in acting if "border" in each] == ["bottom border for mark 1"]
    time = run.time[(run.active.sel(constraint="bottom border for mark 1") > 0)]
    assert 0.1 < time.min() < 0.2 and 0.6 < time.max() < 0.7


def test_the_second_joint_rests_at_its_limit_and_the_others_go_on():
    run = run_of("seven_joints")
    scene = rs.load_scenario(rs.examples.path("seven_joints")).scene
    room = np.degrees(run.q.values - scene.limits[:, 0])[:, 1]
    at_limit = run.time.values[room < 0.1]
    assert np.nanmin(room) > -1e-9 and 0.1 < at_limit.min() < 0.2 and 0.6 < at_limit.max() < 0.8


def test_no_line_of_sight_enters_the_ball():
    hidden = []
    for changes in (), ("task.law=joint",):
        run = run_of("line_of_sight", *changes)
        marks = rs.load_scenario(rs.examples.path("line_of_sight")).scene.object("square").marks
        eye = run.camera_pose.dropna("time").values[:, None, :3, 3]
        ray, to_ball = marks - eye, np.array([0.22, 0.06, -0.45]) - eye
        share = np.clip((ray * to_ball).sum(-1) / (ray**2).sum(-1), 0, 1)
        distance = np.linalg.norm(to_ball - share[..., None] * ray, axis=-1)
        hidden.append(0.02 * (distance < 0.08).any(axis=1).sum())
    assert hidden == pytest.approx([0.0, 1.24])
