"""The law that looks ahead: what it predicts, what it chooses, and where it arrives."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.errors import InputError
from robsim.kernels.machine.program import Blocks, Program
from robsim.laws import RolloutLaw
from robsim.servo.prediction import Forecast, Prediction, divide_horizon
from robsim.servo.rollout_controller import choose_candidates
from robsim.suites.published import retreat

SUITE = retreat.suite()
STARTS, GOAL = np.asarray(SUITE.starts), SUITE.task_goal
CAMERA_FORM = rs.PBVS(form="camera")
LAW = RolloutLaw(["joint"], schemes=[CAMERA_FORM])
BORDER = np.array([639.5, 479.5])  # the image begins at -0.5 pixels


def experiment(law, starts, **changes):
    """The experiment of a law of image-based servoing in the suite."""
    return SUITE.experiment(rs.IBVS(GOAL, law=law)).with_(start=starts, **changes)


def forecast_of(controller, starts, horizon, dt, margin=4.0, last=None):
    """The forecast of a controller as its only candidate, in steps of dt."""
    prediction = Prediction(controller, [controller], divide_horizon(horizon, dt, dt), margin, ())
    rest = np.zeros((len(controller.columns), len(starts))) if last is None else last
    return prediction.forecast(starts.T, rest, Blocks(Program(), np.arange(len(starts))), 0)


# the prediction


@pytest.mark.parametrize(
    ("scheme", "different"), [(rs.IBVS(), 1), (rs.PBVS(), 4)], ids=["L current", "PBVS"]
)
def test_a_prediction_is_the_run_of_its_candidate(scheme, different):
    """In steps of the loop the marks end where those of the run end, and leave the margin there."""
    starts, dt, steps, margin = STARTS[:30], 0.05, 40, 60.0
    task = replace(scheme, goal=GOAL)
    run = rs.simulate(SUITE.scene, task, starts, dt=dt, duration=dt * steps)
    whole = np.isfinite(run.q.values[:, -1, 0])
    assert whole.sum() >= 15
    found = forecast_of(task.bind(SUITE.scene), starts, dt * steps, dt, margin)
    T = SUITE.scene.pose("eye", run.q.values[whole, -1]).inv()
    marks = SUITE.scene.object().marks
    goal = SUITE.scene.pose("eye", SUITE.goal).inv()
    X, X_goal = (
        np.einsum("...ij,nj->...ni", each.rotation, marks) + each.position[..., None, :]
        for each in (T, goal)
    )
    distances = np.sqrt(((X - X_goal) ** 2).sum(axis=2).mean(axis=1))
    np.testing.assert_allclose(found.distances[0, whole], distances, rtol=1e-9)

    pixels = run.pixels.values[whole]
    room = np.minimum(pixels + 0.5, BORDER - pixels).min(axis=(2, 3))
    inside = room >= np.minimum(margin, room[:, :1]) - 1e-9
    counts = np.where(inside.all(axis=1), steps + 1, inside.argmin(axis=1))
    assert (found.counts[0, whole] == counts).all() and len(set(counts)) >= different


def test_a_joint_beyond_its_limit_makes_a_candidate_infeasible():
    scenario = rs.load_scenario(rs.examples.path("joint_limits"))
    task, dt = replace(scenario.task, projection="classic"), scenario.dt
    run = rs.simulate(scenario.scene, task, scenario.start, dt=dt, duration=20)
    assert rs.Outcome(int(run.outcome)).name == "JOINT_LIMIT"
    start = np.asarray(run.q.values[:1])
    found = forecast_of(task.bind(scenario.scene), start, 4.0 * float(run.end_time), dt, 0.0)
    assert found.counts[0, 0] == round(float(run.end_time) / dt)


def test_a_prediction_goes_on_from_the_last_command():
    """With limited accelerations, from the middle of a run, the marks end where the run ends."""
    slow = rs.laws.ConstrainedLaw([rs.constraints.JointAccelerations(0.2)])
    task, dt, half, steps = rs.PBVS(GOAL, form="camera", law=slow), 0.05, 15, 30
    run = rs.simulate(SUITE.scene, task, STARTS[:4], dt=dt, duration=dt * steps)
    rows = run.q.values[:, half], run.qd.values[:, half - 1].T
    controller = task.bind(SUITE.scene)
    ends = [
        forecast_of(controller, q, (steps - first) * dt, dt, 0.0, last).distances
        for q, first, last in ((STARTS[:4], 0, None), (rows[0], half, rows[1]))
    ]
    np.testing.assert_allclose(*ends, rtol=1e-9)
    assert (
        abs(forecast_of(controller, rows[0], (steps - half) * dt, dt, 0.0).distances / ends[0] - 1)
        > 1e-3
    ).all()


def test_a_horizon_has_fine_steps_until_the_next_prediction():
    times = divide_horizon(5.0, 0.1, 0.02)
    assert times.between == 5 and times.coarse == 50 and times.instants == 55
    assert divide_horizon(1.0, 0.01, 0.04).period == 0.04


# the choice


def test_the_nearest_of_the_feasible_candidates_is_chosen():
    counts = np.array([[9, 9, 3, 9], [9, 9, 5, 9], [4, 9, 5, 9]], dtype=float)
    ends = np.array([[2, 2, 0, np.nan], [1, 1, 3, 2], [0, 3, 2, 3]], dtype=float)
    last = np.full(4, -1)
    assert choose_candidates(Forecast(counts, ends), last, 0.1).tolist() == [1, 1, 2, 1]


def test_the_last_candidate_stays_unless_another_is_clearly_nearer():
    counts = np.array([[9, 9, 3, 9], [9, 9, 9, 9]], dtype=float)
    ends = np.array([[1, 1, 1, 1e-7], [0.95, 0.8, 2, 1e-9]], dtype=float)
    last = np.zeros(4, dtype=int)
    assert choose_candidates(Forecast(counts, ends), last, 0.1).tolist() == [0, 1, 1, 0]


def test_a_law_alone_commands_as_without_prediction():
    one, other = (
        experiment(law, STARTS[:8], duration=4.0).run() for law in ("joint", RolloutLaw(["joint"]))
    )
    assert one.q_end.values.tobytes() == other.q_end.values.tobytes()


# where it arrives


@pytest.fixture(scope="module")
def runs():
    return experiment(LAW, STARTS[:40]).run()


def test_every_start_of_the_retreat_arrives_with_all_marks_in_view(runs):
    distance, angle = SUITE.off_goal(runs.q_end.values)
    assert set(runs.outcome.values) == {rs.Outcome.CONVERGED}
    assert distance.max() < 0.01 and np.degrees(angle).max() < 1.0
    assert float(runs.path_length.max()) < 1.0


def test_half_a_turn_alone_is_a_rotation_in_place():
    half = (
        rs.Pose.from_quaternion(SUITE.goal[:3], SUITE.goal[3:]) @ rs.Pose.at(rpy=(0, 0, np.pi))
    ).q
    run = experiment(LAW, half).run()
    assert rs.Outcome(int(run.outcome)) == rs.Outcome.CONVERGED and float(run.path_length) < 1e-6


def test_a_constrained_scheme_is_a_candidate():
    limited = rs.PBVS(law=rs.laws.ConstrainedLaw([rs.constraints.FieldOfView()]))
    run = experiment(RolloutLaw(["joint"], schemes=[limited]), STARTS[:16]).run()
    assert set(run.outcome.values) == {rs.Outcome.CONVERGED}


def test_the_bits_are_those_of_a_run_alone_in_any_chunk_and_on_any_thread(runs):
    names = "q_end", "end_time", "path_length", "outcome"
    other = experiment(LAW, STARTS[:40]).run(threads=2, chunk=7)
    assert all(other[name].values.tobytes() == runs[name].values.tobytes() for name in names)
    for i in (0, 5, 33):
        alone = experiment(LAW, STARTS[i : i + 1], first_run=i).run()
        assert all(alone[name].values[0] == runs[name].values[i] for name in names[1:])
        assert alone.q_end.values[0].tobytes() == runs.q_end.values[i].tobytes()


def test_the_controller_gives_the_commands_of_the_simulation():
    one = experiment(LAW, STARTS[2], record="all", duration=0.4)
    run, controller = one.run(), rs.Controller(one)
    for i in range(len(run.time) - 1):
        command = controller.step(run.pixels.values[i], run.q.values[i], float(run.time[i]))
        assert np.asarray(command.velocities).tobytes() == run.qd.values[i].tobytes()


def test_a_law_in_python_is_predicted_from_its_memory():
    class Pulse:
        """Commands at each second instant."""

        def command(self, state):
            count = state.memory.setdefault("count", np.zeros(len(state.error)))
            state.memory["count"] = count + 1
            return 2.0 * (count % 2)[:, None] * rs.laws.JointLaw().command(state)

    calm = SUITE.goal + np.array([0.02, 0, 0, 0, 0, 0, 0])
    run = experiment(RolloutLaw([Pulse()]), calm).run()
    assert rs.Outcome(int(run.outcome)) == rs.Outcome.CONVERGED


def test_a_scheme_has_the_weighting_of_the_task():
    """Marks that are out of the image at the start neither enter it nor make it infeasible."""
    scenario = rs.load_scenario(rs.examples.path("marks_come_and_go"))
    law = RolloutLaw(["joint"], schemes=[rs.PBVS()])
    assert rs.Outcome(int(scenario.at("task.law", law).run().outcome)).name == "CONVERGED"
    partitioned = RolloutLaw(["joint"], schemes=[rs.tasks.Partitioned()])
    with pytest.raises(InputError, match="needs all marks"):
        scenario.at("task.law", partitioned).run()


def test_a_run_from_its_experiment_is_explained():
    scenario = rs.load_scenario(rs.examples.path("looking_ahead")).at("task.law", RolloutLaw())
    run = scenario.run()
    assert rs.Experiment.of(run) == scenario and "left the image" in str(rs.explain(run))


# texts and errors


def test_a_text_gives_the_same_law():
    table = {"kind": "rollout", "schemes": [{"kind": "pbvs", "form": "camera"}], "horizon": "4 s"}
    scenario = rs.load_scenario(rs.examples.path("camera_retreat")).at("task.law", table)
    law = scenario.task.law
    assert law.horizon == 4.0 and law.schemes[0].form == "camera"
    again = rs.Experiment.from_text(scenario.text)
    assert again == scenario and again.run().equals(scenario.run())


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: RolloutLaw([]), "laws"),
        (lambda: RolloutLaw([LAW]), "cannot be a RolloutLaw"),
        (lambda: RolloutLaw(schemes=[rs.IBVS(law=LAW)]), "cannot be a RolloutLaw"),
        (lambda: RolloutLaw(horizon=50.0, period=0.001), "more than 2000 steps"),
        (lambda: LAW.command(None), "needs a scene"),
    ],
)
def test_impossible_laws_are_refused(make, words):
    with pytest.raises(InputError, match=words):
        make()


@pytest.mark.parametrize(
    ("task", "words"),
    [
        (rs.IBVS(GOAL, law=LAW, gain=20.0), "steps of 0.1 s are too long for a gain of 20/s"),
        (rs.IBVS(rs.GoalFeatures(np.zeros(8)), law=LAW), "a goal given as numbers"),
        (
            rs.IBVS(GOAL, law=RolloutLaw(schemes=[rs.Hybrid(mark=7)])),
            r"schemes\[0\].*4 marks, numbered from 0; there is no 7",
        ),
        (rs.IBVS(GOAL, law=RolloutLaw(schemes=[rs.PBVS(camera="other")])), r"schemes\[0\].*other"),
    ],
)
def test_laws_that_do_not_fit_the_scene_are_refused(task, words):
    with pytest.raises(InputError, match=words):
        rs.simulate(SUITE.scene, task, STARTS[0], duration=1.0)
