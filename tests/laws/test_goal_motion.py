"""The motion that remains to the goal, and its parts that a task cannot or does not make."""

import numpy as np
import pytest

from robsim import Pose, examples, explain, load_scenario
from robsim.analysis.explanation.goal_motion import split_goal_motion

ARM = 0.14  # metres from the axle of the unicycle to its camera


def split(name, q):
    experiment = load_scenario(examples.path(name))
    controller = experiment.loop_from_start().controller
    return split_goal_motion(controller, np.array(q, dtype=float)[:, None])


def measure(motion):
    return np.linalg.norm(motion[:3]), np.linalg.norm(motion[3:])


@pytest.mark.parametrize("side", [0.05, -0.08])
def test_of_a_goal_to_the_side_a_unicycle_makes_the_part_that_a_turn_makes(side):
    """The oracle is the nearest multiple of a turn, which moves the camera by its arm."""
    motion = split("unicycle_docking", [0.0, -side, 0.0])
    scene = load_scenario(examples.path("unicycle_docking")).scene
    target, camera = scene.pose("board", scene.home), scene.pose("camera", [0.0, -side, 0.0])
    depth = np.linalg.norm((camera.inv() @ target).position)  # scale of angles
    turn = side * ARM / (ARM**2 + depth**2)
    assert measure(motion.whole) == pytest.approx((abs(side), 0.0), abs=1e-9)
    assert measure(motion.sideways) == pytest.approx((abs(side - ARM * turn), abs(turn)), rel=1e-4)
    assert np.allclose(motion.outside, 0.0, atol=1e-6) and not motion.free
    (clause,) = motion.clauses()
    assert clause.startswith("the wheels do not roll along") and "must turn away" in clause


@pytest.mark.parametrize(
    ("name", "q"),
    [
        ("unicycle_docking", [-0.2, 0.0, 0.0]),  # straight ahead
        ("holonomic", [-0.1, 0.05, 0.1, 0.0, 0.0, 0.0, 0.0]),
    ],
)
def test_a_way_that_a_vehicle_drives_has_no_part_that_is_missing(name, q):
    nq = load_scenario(examples.path(name)).scene.nq
    motion = split(name, q[:nq])
    assert measure(motion.whole)[0] > 0.1 and [*motion.clauses()] == []


def test_an_arm_with_six_joints_makes_every_motion_to_its_goal():
    experiment = load_scenario(examples.path("eye_in_hand"))
    motion = split("eye_in_hand", experiment.start)
    assert measure(motion.whole)[0] > 0.05 and [*motion.clauses()] == []


def test_two_features_leave_an_arc_around_the_sign_free():
    """At poses along the free motion the features are equal to the second order."""
    experiment = load_scenario(examples.path("differential_drive"))
    run, scene = experiment.run(), experiment.scene
    q = run["q_end"].values
    motion = split("differential_drive", q)
    assert measure(motion.unseen)[0] == pytest.approx(measure(motion.whole)[0], rel=0.05)
    assert len(motion.free) == 1 and "turn about the axis parallel to y" in motion.free[0]
    mount = np.linalg.norm(scene.pose("camera", q).position[:2] - q[:2])
    errors = []
    for size in (0.0, 0.01, 0.02):
        shift = size * motion.unseen
        there = scene.pose("camera", q) @ Pose.at(*shift[:3], rotvec=shift[3:])
        heading = np.arctan2(there.rotation[1, 2], there.rotation[0, 2])  # of the optical axis
        ahead = mount * np.array([np.cos(heading), np.sin(heading)])
        start = np.concatenate([there.position[:2] - ahead, [heading], q[3:]])
        errors.append(experiment.with_(start=start, duration=0.04).run()["error"].values[0])
    near, far = (np.abs(each - errors[0]).max() for each in errors[1:])
    assert near < 1e-4 and far == pytest.approx(4.0 * near, rel=0.1)


def test_the_explanation_of_a_run_with_free_motions_names_them():
    experiment = load_scenario(examples.path("differential_drive"))
    *_, last = explain(experiment.run(), trials=False).causes
    assert last.about == "way to the goal"
    assert last.sentence.startswith("The features do not change along 173 mm and 21.3 degrees")
    assert last.evidence["off_m"] == pytest.approx(0.18, abs=0.01)
