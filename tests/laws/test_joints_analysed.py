"""All analyses of scenes accept rails, cars, wheels and fingers: no crash, and correct numbers."""

import numpy as np
import pytest

import robsim as rs
from robsim import Pose, Robot
from robsim.errors import InputError
from robsim.joints import Joint, Link, Mimic

TWO = [rs.features.FeatureBlock("decoupled_moments", components=[0, 2])]
CAMERA = rs.Camera([[400, 0, 319.5], [0, 400, 239.5], [0, 0, 1]], (640, 480))
MARKS = [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.08, 0], [-0.1, 0.1, 0]]


def before(robot, link, away):
    """A camera on a link, and a plate that it looks at from so many metres at home."""
    T = Pose(robot.fk(robot.home, link))
    plate = rs.Object("plate", marks=MARKS, pose=T @ Pose.at(0, 0, away, rpy=(0.1, 0, 0.2)))
    eye = rs.MountedCamera("eye", CAMERA, f"{robot.name}.{link}")
    return rs.Scene([robot], [plate], [eye])


def crawler():
    """On a cable by two wheels; on its body a camera that pans."""
    cable = rs.shapes.curves.Catenary((0, 0), (5, 0.5), 5.2)
    up, hub = Pose.at(rpy=(np.pi / 2, 0, 0)), Pose.at(0, 0.05, 0)
    chord = rs.joints.Chord("rear", 0.4, 0.05, gives="angle")
    pan = Joint("revolute", Pose.at(0.2, -0.1, 0, rpy=(np.pi / 2, 0, 0)), limits=(-2.0, 2.0))
    links = [
        Link("base"),
        Link("rear", "base", Joint("rail", up, curve=cable)),
        Link("wheel", "rear", Joint("revolute", hub, follows=Mimic("rear", -20.0))),
        Link("body", "rear", Joint("revolute", hub, follows=chord)),
        Link("pan", "body", pan),
        Link("head", "pan", Joint(place=Pose.at(rpy=(0, np.pi / 2, 0)))),
    ]
    return before(Robot("crawler", links, [2.0, 0.0]), "head", 1.0), rs.IBVS(features=TWO)


def vehicle(name):
    scene = rs.load_scenario(rs.examples.path(name)).scene
    return scene, rs.IBVS(features=TWO)


def with_gripper():
    arm = rs.robots.rhino_xr4().with_tool(rs.robots.rhino_gripper(), Pose.at(z=-0.1083), bare=True)
    return before(arm, "tool", 0.3), rs.IBVS()


SCENES = {
    "car": lambda: vehicle("car"),
    "differential drive": lambda: vehicle("differential_drive"),
    "crawler": crawler,
    "gripper": with_gripper,
}


@pytest.fixture(scope="module", params=SCENES)
def case(request):
    scene, task = SCENES[request.param]()
    q0 = scene.home.copy()
    q0[:2] -= 0.05
    return scene, task, q0, rs.simulate(scene, task, q0, duration=3.0)


def test_its_goal_is_an_equilibrium_that_attracts(case):
    scene, task, *_ = case
    found = rs.equilibria(scene, task, count=10, duration=8.0)
    assert found[0].kind == "goal" and found[0].eigenvalues.real.max() < 1e-6
    np.testing.assert_allclose(found[0].q, scene.home, atol=1e-6)


@pytest.mark.few(2)
def test_it_is_explained_compared_diagnosed_and_drawn(case):
    scene, task, q0, run = case
    explanation = rs.explain(run, trials=False)
    assert explanation.outcome == rs.Outcome.TIME_LIMIT and "falls by" in explanation.what
    assert {"V", "rank_task_jacobian"} & set(rs.diagnose(run).variables)
    tasks = {"slow": task, "fast": rs.IBVS(features=task.features, gain=2.0)}
    compared = rs.compare(scene, tasks, np.array([q0]), duration=3.0)
    assert "slow" in str(compared) and "fast" in str(compared)
    for figure in (rs.plot.scene(scene, run=run), rs.plot.run(run, scene), rs.plot.velocity(run)):
        assert figure.axes


def test_secondary_motions_limits_and_chosen_joints(case):
    scene, task, q0, _ = case
    first, n = scene.velocity_names[0], task.bind(scene).columns.size
    one = [rs.features.FeatureBlock("points", marks=[0], components=[0])]
    for made in (
        rs.IBVS(features=one, secondary=rs.laws.AvoidLimits()),
        rs.IBVS(features=one, secondary=rs.laws.Posture(np.zeros(n))),
        rs.IBVS(features=one, joints=first),
        rs.IBVS(features=task.features, limit=rs.laws.SpeedLimit(joint=0.02)),
    ):
        qd = rs.simulate(scene, made, q0, duration=0.4).qd.dropna("time").values
        assert qd.size
        if made.limit:
            assert np.abs(qd).max() <= 0.02 * (1 + 1e-12)
        if made.joints:
            assert not qd[:, 1:].any()
    with pytest.raises(InputError, match="joints: no robot or velocity"):
        rs.IBVS(joints=scene.robots[0].links[-1].name).bind(scene)


def test_it_is_believed_wrongly_where_that_makes_sense():
    scene, _ = with_gripper()
    wrong = scene.believe(dh={"finger_left": {"a": 0.01}, "wrist": {"theta": 0.01}})
    home = wrong.home
    shift = wrong.pose("rhino_xr4.finger_left", home).position
    right = scene.pose("rhino_xr4.finger_left", home).position
    assert 0.01 < np.linalg.norm(shift - right) < 0.03
    car, _ = vehicle("car")
    with pytest.raises(InputError, match="'rear_left': its axis must lie across its vehicle"):
        car.believe(dh={"body": {"theta": 0.01}})


def test_how_far_wheels_have_turned_does_not_set_states_apart():
    from robsim.analysis.vector_fields import VectorField

    field = VectorField.of(*vehicle("car"))
    a, b = np.zeros((8, 1)), np.zeros((8, 1))
    b[4:] = 1.0
    assert field.distances(a, b) == 0.0
    b[0] = 0.3
    assert field.distances(a, b) == 0.3


def test_a_car_that_cannot_turn_enough_is_reported():
    run = rs.load_scenario(rs.examples.path("car"), ["task.tasks.0.gain=0.5"]).run()
    explanation = rs.explain(run, trials=False)
    assert explanation.causes[0].about == "steering limit"
    assert "'body.steering' is at its limit of 24 degrees" in explanation.causes[0].sentence
    radius = 0.3302 / np.tan(0.4189)
    assert explanation.causes[0].evidence["radius_m"] == pytest.approx(radius)
    assert explanation.causes[0].evidence["asked_rad"] > 0.4189


def test_a_car_that_is_only_to_turn_stands_and_is_reported():
    scenario = rs.load_scenario(rs.examples.path("car"))
    one = [rs.features.FeatureBlock("points", marks=[0], components=[0])]
    task = rs.IBVS(features=one, joints="body.omega")
    run = rs.simulate(scenario.scene, task, scenario.start, duration=1.0)
    assert (run.qd_actual == 0).all() and (run.q == run.q[0]).all()
    explanation = rs.explain(run, trials=False)
    assert explanation.causes[0].about == "standing car" and "turns only while it drives" in str(
        explanation
    )
