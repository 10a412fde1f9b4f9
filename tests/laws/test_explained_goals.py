"""Explanations of goals that are out of reach, and of moments that end upside down."""

import re

import numpy as np
import pytest

import robsim as rs
from robsim.features.moments import DecoupledMoments, PointMoments, RegionMoments

HEIGHT = 6.0  # metres from the camera to the plane of the arm, which reaches 2 m
# a heptagon with third moments that a tilt could explain
HEPTAGON = [
    [0.236, 0.163],
    [0.024, 0.262],
    [-0.113, 0.192],
    [-0.271, 0.062],
    [-0.099, -0.256],
    [0.014, -0.241],
    [0.208, -0.183],
]
L_SHAPE = np.array([[0, 0], [4, 0], [4, 1], [1, 1], [1, 3], [0, 3]]) / 10 - 0.12


def arm_seen_from_above(goal, inverse):
    """Return an experiment: a planar arm brings a mark to (x, y) below a fixed camera."""
    robot = rs.robots.load("planar_2r")
    camera = rs.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], size=(640, 480))
    eye = rs.MountedCamera("eye", camera, pose=rs.Pose.at(0.3, 0.6, HEIGHT, rpy=(np.pi, 0, 0)))
    dot = rs.Object("dot", marks=[[0, 0, 0]], on=f"planar_2r.{robot.tip}")
    features = [(goal[0] - 0.3) / HEIGHT, -(goal[1] - 0.6) / HEIGHT]
    task = rs.IBVS(rs.GoalFeatures(features), inverse=inverse)
    return rs.Experiment(rs.Scene([robot], [dot], [eye]), task, duration=20)


@pytest.mark.parametrize("goal", [(2.2, 0.0), (2.1, 1.0), (-1.0, 2.2)])
@pytest.mark.parametrize(
    ("inverse", "outcome"), [("pseudo_inverse", "JOINT_LIMIT"), ("damped", "SINGULAR")]
)
@pytest.mark.few(3)
def test_a_goal_beyond_the_workspace_is_named(goal, inverse, outcome):
    """The least error is the distance beyond 2 m, over the height of the camera."""
    run = arm_seen_from_above(goal, inverse).run()
    found = rs.explain(run)
    assert found.outcome.name == outcome
    (cause,) = found.causes
    assert cause.about == "goal out of reach" and "The goal is out of reach: of 100" in str(found)
    assert cause.evidence["nearest"] == pytest.approx((np.hypot(*goal) - 2) / HEIGHT, rel=1e-6)


def test_a_goal_within_reach_is_not_said_to_be_out_of_it():
    """The arm passes its limit on the way to a goal within its reach."""
    experiment = arm_seen_from_above((1.0, 1.0), "pseudo_inverse").with_(start=[2.9, 2.9])
    found = rs.explain(experiment.run())
    assert found.outcome.name == "JOINT_LIMIT"
    assert "goal out of reach" not in [cause.about for cause in found.causes]


def upside_down(features, shape, free_scene):
    """Return the run of a free camera to a polygon, from a turn of 150 degrees."""
    goal = rs.Pose.at(0, 0, -1)
    scene = free_scene(np.column_stack([shape, np.zeros(len(shape))]))
    start = goal @ rs.Pose.at(0.1, -0.05, -0.2, rotvec=(0, 0, np.radians(150)))
    return rs.simulate(scene, rs.IBVS(goal, features=features, tolerance=1e-6), start, duration=25)


@pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")  # four numbers for six motions
@pytest.mark.parametrize(
    ("features", "shape", "reason", "advice"),
    [
        (DecoupledMoments(), HEPTAGON, "third moments of the target at the goal are so small", []),
        (PointMoments(), L_SHAPE, "axis without a head", ["With DecoupledMoments as features"]),
        (RegionMoments(), L_SHAPE, "axis without a head", ["With DecoupledMoments as features"]),
    ],
)
def test_a_run_that_ends_upside_down_says_so(features, shape, reason, advice, free_scene):
    """The advice was tried: each scheme ends at the goal pose from the same start."""
    run = upside_down(features, shape, free_scene)
    assert int(run.outcome) == rs.Outcome.CONVERGED and np.degrees(run.angle_to_goal) > 175
    found = rs.explain(run)
    (cause,) = [each for each in found.causes if each.about == "upside down"]
    assert "It converged upside down" in cause.sentence and reason in cause.sentence
    expected = [*advice, "With the feature points and L mean", "With PBVS"]
    assert [re.split(" the same start", each.sentence)[0] for each in found.advice] == expected
    assert all("at its goal pose" in each.sentence for each in found.advice)
    assert not rs.explain(run, trials=False).advice


@pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
def test_the_report_of_a_run_says_that_it_ended_upside_down(free_scene, tmp_path, capsys):
    from robsim.cli.report import print_run_report

    run = upside_down(PointMoments(), L_SHAPE, free_scene)
    print_run_report(run, tmp_path)
    assert (
        "it converged upside down, turned by half a turn: robsim explain" in capsys.readouterr()[0]
    )
