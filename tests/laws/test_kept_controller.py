"""A scene keeps its last controller, and no run depends on the tasks that ran before."""

import copy
import gc
import pickle
import weakref
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import robsim as rs
from robsim.world.scene import LAST_CONTROLLER

TUTORIAL = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=0.8)
SCENE, START, GOAL = TUTORIAL.scene, TUTORIAL.start, TUTORIAL.task.goal
WRONG = TUTORIAL.at("cameras.camera.focal", 810.0).scene
TASKS = {
    "of ours": rs.IBVS(GOAL, gain=0.5),
    "a gain": rs.IBVS(GOAL, gain=1.5),
    "an adaptive gain": rs.IBVS(GOAL, gain=rs.laws.AdaptiveGain(4.0, 0.4, 30.0)),
    "another adaptive gain": rs.IBVS(GOAL, gain=rs.laws.AdaptiveGain(2.0, 0.4, 30.0)),
    "a tolerance": rs.IBVS(GOAL, tolerance=0.05),
    "a law": rs.IBVS(GOAL, law="camera"),
    "a length": rs.IBVS(GOAL, law=rs.laws.CameraLaw(length=0.1)),
    "the transpose": rs.IBVS(GOAL, inverse="transpose"),
    "a gain of the transpose": rs.IBVS(GOAL, inverse="transpose", gain=2.0),
    "a smooth start": rs.IBVS(GOAL, smooth_start=2.0),
    "a limit": rs.IBVS(GOAL, limit=rs.laws.SpeedLimit(linear=0.05)),
    "a goal": rs.IBVS(GOAL.q + np.r_[0.02, np.zeros(6)]),
    "features": rs.IBVS(GOAL, features=rs.features.FeatureBlock("points", marks=[0, 1, 2])),
    "depths": rs.IBVS(GOAL, depth_scale=1.2),
    "an interaction": rs.IBVS(GOAL, interaction="mean"),
    "an estimate": rs.IBVS(GOAL, interaction="broyden"),
    "a belief": rs.IBVS(GOAL, belief=WRONG),
    "joints": rs.IBVS(GOAL, joints=["free_camera"]),
    "weights": rs.IBVS(GOAL, weighting=rs.weights.Tukey()),
    "a position": rs.PBVS(GOAL, gain=0.5),
    "a gain of a position": rs.PBVS(GOAL, gain=1.5),
    "a choice of laws": rs.IBVS(GOAL, law=rs.laws.RolloutLaw(["joint", "camera"], horizon=0.2)),
    "another choice": rs.IBVS(
        GOAL, law=rs.laws.RolloutLaw(["joint", "camera"], horizon=0.2), gain=1.5
    ),
}


def make_anew(scene, task):
    """Return an experiment with a new scene and a new task, which keep nothing."""
    scene, task = pickle.loads(pickle.dumps((scene, task)))
    return rs.Experiment(scene, task, START, duration=0.8)


def copy_task(task):
    """Return an equal task that keeps nothing."""
    return pickle.loads(pickle.dumps(task))


@pytest.fixture(scope="module")
def expected():
    return {name: make_anew(SCENE, task).run() for name, task in TASKS.items()}


@pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
@pytest.mark.parametrize("after", TASKS)
@pytest.mark.few(4)
def test_a_run_does_not_depend_on_the_task_before(after, expected):
    experiment = make_anew(SCENE, TASKS[after])
    for name, task in TASKS.items():
        for each in (TASKS[after], task):
            run = rs.simulate(experiment.scene, copy_task(each), START, duration=0.8)
        assert run.identical(expected[name]), name


def test_equal_tasks_share_the_controller_of_a_scene_and_another_gain_its_features():
    scene = pickle.loads(pickle.dumps(SCENE))
    first = rs.IBVS(GOAL, gain=0.5).bind(scene)
    assert rs.IBVS(GOAL.q.copy(), gain=0.5).bind(scene) is first
    second = rs.IBVS(GOAL, gain=0.7).bind(scene)
    assert (second.gain, second.pace) == (0.7, 0.7) and first.gain == 0.5
    assert second.bound_features is first.bound_features
    goal = GOAL.q + np.r_[0.01, np.zeros(6)]
    assert rs.IBVS(goal, gain=0.7).bind(scene).bound_features is not first.bound_features


def test_a_zero_of_another_sign_is_another_goal():
    scene, q = pickle.loads(pickle.dumps(SCENE)), GOAL.q + 0.0
    first = rs.IBVS(q).bind(scene)
    assert not q[0] and rs.IBVS(np.r_[-0.0, q[1:]]).bind(scene) is not first


def test_stages_of_a_run_serve_another_gain():
    experiment = make_anew(SCENE, TASKS["of ours"])
    experiment.run()
    faster = experiment.at("task.gain", 1.25)
    steps, other = experiment.loop().sequence, faster.loop().sequence
    assert other.plant is steps.plant and other.controller.gain == 1.25
    _, chunk = next(faster.loop().instants(np.arange(1)))
    decision = other.decision(chunk)
    assert decision.basis.state.gain == 1.25
    qd = decision.command.qd[:, 0]
    np.testing.assert_allclose(qd, 2.5 * experiment.run().qd[0].values, rtol=1e-14)


@pytest.mark.parametrize("gains", [(0.5, 0.7), (0.7, 0.5, 0.7)])
def test_a_gain_that_decides_the_outcome_is_the_gain_of_the_run(gains):
    experiment = make_anew(SCENE, TASKS["of ours"]).with_(duration=30.0, record="summary")
    ends = [float(experiment.at("task.gain", gain).run().end_time) for gain in gains]
    fresh = [make_anew(SCENE, rs.IBVS(GOAL, gain=gain)) for gain in gains]
    alone = [each.with_(duration=30.0, record="summary").run() for each in fresh]
    assert ends == [float(run.end_time) for run in alone]


def test_an_edited_object_of_a_user_counts():
    class Slower:
        factor = 0.5

        def command(self, state):
            return self.factor * rs.laws.JointLaw().command(state)

    scene, law = pickle.loads(pickle.dumps(SCENE)), Slower()
    run = rs.simulate(scene, rs.IBVS(GOAL, law=law), START, duration=0.2)
    law.factor = 0.25
    again = rs.simulate(scene, rs.IBVS(GOAL, law=law), START, duration=0.2)
    np.testing.assert_array_equal(2.0 * again.qd[0].values, run.qd[0].values)


def test_an_edited_motion_of_a_user_counts():
    class Drift:
        rate = 0.1

        def __call__(self, seconds):
            return [self.rate]

    drift = Drift()
    belt = rs.Robot.from_dh([[0, 0, 0, 0]], joints="P", name="belt")
    scene = rs.Scene(
        [*SCENE.robots, belt], SCENE.objects, SCENE.cameras, motions=[rs.Motion("belt", drift)]
    )
    ends = []
    for rate in (0.1, 0.2):
        drift.rate = rate
        run = rs.simulate(scene, rs.IBVS(np.r_[GOAL.q, 0.0]), np.r_[START, 0.0], duration=0.4)
        ends.append(float(run.q[-1, -1]))
    np.testing.assert_allclose(ends, [0.04, 0.08], rtol=1e-12)


def test_copies_of_a_scene_keep_no_controller():
    scene = pickle.loads(pickle.dumps(SCENE))
    controller = rs.IBVS(GOAL).bind(scene)
    assert vars(scene)[LAST_CONTROLLER].controller is controller
    for other in (copy.copy(scene), copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        assert LAST_CONTROLLER not in vars(other)
        assert rs.IBVS(GOAL).bind(other).scene is other


def test_a_scene_that_nobody_uses_is_freed():
    experiment = make_anew(SCENE, TASKS["of ours"])
    experiment.run()
    scene = weakref.ref(experiment.scene)
    del experiment
    gc.collect()
    assert scene() is None


def test_threads_may_run_tasks_in_one_scene_at_once(expected):
    scene = pickle.loads(pickle.dumps(SCENE))
    names = ["of ours", "a gain", "a position", "a gain of a position", "a tolerance"] * 6

    def simulate(name):
        return rs.simulate(scene, copy_task(TASKS[name]), START, duration=0.8)

    with ThreadPoolExecutor(6) as pool:
        runs = list(pool.map(simulate, names))
    assert all(run.identical(expected[name]) for name, run in zip(names, runs, strict=True))
