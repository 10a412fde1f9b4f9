"""Bodies that nothing moves are placed once: runs have the bits of a placement at every step."""

import copy

import numpy as np
import pytest

import robsim as rs
from robsim.engine import plant
from robsim.engine.idle_joints import find_idle_coordinates, place_idle_bodies

ROWS = [
    [0, 0.672, 0, np.pi / 2],
    [0, 0, 0.432, 0],
    [0, 0.15, 0.02, -np.pi / 2],
    [0, 0.432, 0, np.pi / 2],
    [0, 0, 0, -np.pi / 2],
    [0, 0, 0, 0],
]
GOAL = np.array([0, np.pi / 4, np.pi, 0, np.pi / 4, 0])
START = GOAL + np.array([0.04, -0.03, 0.05, 0.02, -0.04, 0.06])
IDLE = np.array([0.3, 0.7, 2.9, 0.0, 0.8, -0.4])
MARKS = np.array([[x, y, 0.0] for x in (-0.1, 0.1) for y in (-0.1, 0.1)])


def arm(name, x=0.0):
    return rs.Robot.from_dh(ROWS, name=name).at(rs.Pose.at(x, 0, 0))


ARMS = [arm("a"), arm("b", 3.0), arm("c", -3.0)]
FRONT = ARMS[0].fk(GOAL) @ np.asarray(rs.Pose.at(0.02, 0.03, 0.6))  # of the camera at the goal


def mount(name, pose, q=IDLE):
    """Return the pose on the last link of a robot of a pose in the world."""
    hand = rs.Scene(ARMS).pose(f"{name}.link6", np.concatenate([q, q, q]))
    return np.linalg.inv(np.asarray(hand)) @ pose


def cell(carrier="world", eye="a.link6", marks=FRONT, view=None, motions=()):
    camera = rs.MountedCamera(
        "eye", rs.Camera(np.eye(3)), on=eye, pose=rs.Pose(np.eye(4) if view is None else view)
    )
    square = rs.Object("square", marks=MARKS, on=carrier, pose=rs.Pose(marks))
    return rs.Scene(ARMS, [square], [camera], motions=motions)


def both(a, b=IDLE, c=IDLE):
    return np.concatenate([a, b, c])


def experiment(scene, law="joint", **fields):
    task = rs.IBVS(goal=both(GOAL), gain=2.0, tolerance=1e-9, joints="a", law=law)
    return rs.Experiment(scene, task, **{"start": both(START), "duration": 1.0, **fields})


EYE = FRONT @ np.diag([1.0, -1.0, -1.0, 1.0])  # looks back at the arm
HELD = mount("a", EYE @ np.asarray(rs.Pose.at(0, 0, 0.5)), GOAL)
SPREAD = np.stack([both(START + 0.01 * i) for i in range(11)])
AWAY = rs.laws.ConstrainedLaw([rs.constraints.Clearance("a.link6", "c.link6", 3.085)])
CASES = {
    "idle arms beside the loop": (experiment(cell()), 12),
    "an idle arm carries the object": (experiment(cell("b.link6", marks=mount("b", FRONT))), 12),
    "an idle arm carries the camera": (
        experiment(cell("a.link6", "c.link6", HELD, mount("c", EYE))),
        12,
    ),
    "a batch": (experiment(cell(), start=SPREAD), 12),
    "idle arms that differ from run to run": (
        experiment(cell(), start=np.stack([both(START, IDLE + 0.1 * i) for i in range(9)])),
        6,
    ),
    "a negative zero": (experiment(cell(), start=both(START, -0.0 * np.ones(6))), 6),
    "lag": (experiment(cell(), actuation=rs.Actuation(lag=0.1)), 12),
    "latency": (experiment(cell(), sensing=rs.Sensing(latency=0.05)), 12),
    "occlusion": (
        experiment(
            cell(), sensing=rs.Sensing(occlusions=rs.imperfections.Occlusion((0,), 0.2, 0.4))
        ),
        12,
    ),
    "a distance from an idle arm": (experiment(cell(), law=AWAY), 12),
    "a distance from an idle arm with the camera": (
        experiment(cell("a.link6", "c.link6", HELD, mount("c", EYE)), law=AWAY),
        12,
    ),
    "a moved arm": (experiment(cell(motions=[rs.Motion("b", [0.1, 0, 0, 0, 0, 0])])), 6),
}


@pytest.mark.parametrize("case", CASES)
def test_runs_have_the_bits_of_a_placement_at_every_step(case, monkeypatch):
    experiment, idle = CASES[case]
    assert len(experiment.loop().sequence.plant.idle) == idle
    run = experiment.run()
    monkeypatch.setattr(plant, "find_idle_coordinates", lambda *given: {})
    again = experiment.with_(scene=copy.copy(experiment.scene)).run()  # keeps no stages
    assert np.isfinite(run.q).any() and run.error_norm.dropna("time").size > 5
    for name in again.variables:
        assert run[name].values.tobytes() == again[name].values.tobytes(), name


def test_idle_bodies_have_the_poses_of_the_tree():
    scene, q0 = cell(), both(START)[None]
    idle = find_idle_coordinates(scene, np.arange(6), q0)
    poses = place_idle_bodies(scene, idle.keys(), q0)
    assert sorted(idle) == list(range(6, 18)) and len(poses) == 12
    expected = scene.tree.bodies(q0.T).poses[..., 0]
    for body, pose in poses.items():
        np.testing.assert_array_equal(pose, expected[body])


def test_a_distance_from_an_idle_arm_limits_the_motion():
    case, _ = CASES["a distance from an idle arm"]
    run = case.run()
    links = (case.scene.pose(f"{name}.link6", run.q.values) for name in "ac")
    first, second = (np.asarray(pose)[:, :3, 3] for pose in links)
    least = np.linalg.norm(first - second, axis=1).min()
    assert float(run.active.max()) > 0.0 and 3.085 - 1e-4 < least < 3.0875
