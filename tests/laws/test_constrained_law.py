"""The law within constraints: runs that it saves, bounds that it keeps, and its record."""

import numpy as np
import pytest

import robsim as rs
from robsim.analysis.explanation.deadlocks import advise_via_pose
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.resimulation import resimulate_run
from robsim.base.errors import InputError
from robsim.constraints import (
    FieldOfView,
    HalfSpace,
    JointAccelerations,
    JointLimits,
    JointSpeeds,
    MarkDepth,
)
from robsim.laws import ConstrainedLaw
from robsim.run.active_constraints import name_holding_constraints
from robsim.suites.suite_registry import load_suite

JOINTS = JointLimits(0.01), JointSpeeds(2.0), JointAccelerations(8.0)
TAUGHT = rs.load_scenario(rs.examples.path("visp_tutorial"))


@pytest.fixture(scope="module")
def near_limits():
    """A Panda with a camera, and starts near its limits."""
    return load_suite("near_limits")


def simulate(suite, task, runs=None, record="summary", **options):
    """Return the runs of a suite with a task."""
    starts = np.asarray(suite.starts)[:runs]
    return rs.simulate(
        suite.scene, task, starts, dt=suite.dt, duration=20.0, record=record, **options
    )


def task_of(suite, kind=rs.PBVS, **fields):
    """Return a task of a suite."""
    return kind(goal=suite.task_goal, gain=suite.gain, **fields)


@pytest.mark.parametrize("kind", [{}, {"interaction": "mean"}])
def test_all_starts_near_the_limits_arrive_within_joint_limits_and_the_image(near_limits, kind):
    law = ConstrainedLaw([*JOINTS, FieldOfView()])
    for task in rs.IBVS, rs.PBVS:
        run = simulate(near_limits, task_of(near_limits, task, law=law, **kind), 100, "all")
        assert (run.outcome == int(rs.Outcome.CONVERGED)).all()
        assert not (run.slack > 0).any()


def test_joints_speeds_and_accelerations_are_within_their_bounds(near_limits):
    run = simulate(near_limits, task_of(near_limits, law=ConstrainedLaw(JOINTS)), 100, "all")
    q, qd, limits = run.q.values, run.qd.values, near_limits.scene.limits
    assert np.nanmin(q - limits[:, 0]) >= 0.01 - 1e-9
    assert np.nanmin(limits[:, 1] - q) >= 0.01 - 1e-9
    assert np.nanmax(np.abs(qd)) <= 2.0
    before = np.concatenate([np.zeros_like(qd[:, :1]), qd[:, :-1]], axis=1)
    assert np.nanmax(np.abs(qd - before)) <= 8.0 * near_limits.dt + 1e-12
    held = run.active.sel(constraint="link4 at its lower limit")
    assert (held > 0).any()


def test_a_wish_that_satisfies_the_constraints_is_the_command_bit_for_bit():
    plain, wide = TAUGHT.run(), TAUGHT.at("task.law", ConstrainedLaw([FieldOfView(margin=1)])).run()
    np.testing.assert_array_equal(plain.qd.values, wide.qd.values)
    assert not (wide.active > 0).any()


def test_active_names_the_side_and_the_mark_that_hold_the_command_back():
    scenario = rs.load_scenario(rs.examples.path("pbvs_loses_target"))
    run = scenario.at("task.law", ConstrainedLaw([FieldOfView(margin=8)])).run()
    acts = run.active.where(run.active > 0).dropna("constraint", how="all")
    (left, right), (top, bottom) = scenario.scene.cameras[0].camera.border
    u, v = run.pixels.values[..., 0], run.pixels.values[..., 1]
    from_side = {"left": u - left, "right": right - u, "top": v - top, "bottom": bottom - v}
    assert acts.sizes["constraint"] >= 1
    for label in map(str, acts.constraint.values):
        side, mark = label.split()[0], int(label.split()[-1])
        distance = from_side[side][:, mark]
        on = acts.sel(constraint=label).values > 0
        assert distance[on].min() > 6.0  # the margin is 8 px
        assert distance[on].min() < 60.0


@pytest.mark.parametrize("chunk", [1, 7])
def test_bits_are_the_same_alone_in_a_batch_and_in_any_chunks(near_limits, chunk):
    task = task_of(near_limits, law=ConstrainedLaw([*JOINTS, FieldOfView(noise=1.0)]))
    sensing = rs.Sensing(noise=0.2, latency=0.06)
    whole = simulate(near_limits, task, 20, "all", sensing=sensing)
    parts = simulate(near_limits, task, 20, "all", sensing=sensing, chunk=chunk, threads=2)
    for name in "qd", "active", "slack":
        np.testing.assert_array_equal(whole[name].values, parts[name].values)
    one = rs.simulate(
        near_limits.scene,
        task,
        near_limits.starts[3],
        dt=near_limits.dt,
        duration=20.0,
        sensing=sensing,
        first_run=3,
    )
    steps = one.sizes["time"]
    np.testing.assert_array_equal(whole.qd.values[3, :steps], one.qd.values)


def test_the_controller_gives_the_same_bits():
    law = ConstrainedLaw([JointSpeeds(0.2), JointAccelerations(1.0), FieldOfView()])
    experiment = TAUGHT.at("task.law", law)
    run, controller = experiment.run(), rs.Controller(experiment)
    for t in range(50):
        command = controller.step(run.pixels.values[t], run.q.values[t], t=t * experiment.dt)
        np.testing.assert_array_equal(command.velocities, run.qd.values[t])
        active = run.constraint.values[run.active.values[t] > 0]
        assert command.health.limits == tuple(active)


def test_a_standstill_names_its_constraints_and_another_metric_helps(near_limits):
    """The metric of the joints stands still, and the metric of the error arrives."""
    law = ConstrainedLaw([*JOINTS, FieldOfView()], metric="joint")
    task = task_of(near_limits, rs.IBVS, interaction="desired", law=law)
    many = simulate(near_limits, task)
    stalled = np.flatnonzero(many.outcome == int(rs.Outcome.LOCAL_MINIMUM))
    assert stalled.size
    start = near_limits.starts[stalled[0]]
    run = rs.simulate(near_limits.scene, task, start, dt=near_limits.dt, duration=20.0)
    held = name_holding_constraints(run)
    explained = rs.explain(run)
    assert held
    assert explained.causes[0].about == "constraint"
    assert held[0] in explained.causes[0].sentence
    assert "With metric='error'" in str(explained)


def test_a_via_pose_is_advice_for_a_standstill(near_limits):
    law = ConstrainedLaw([*JOINTS, FieldOfView()], metric="joint")
    task = task_of(near_limits, rs.IBVS, interaction="desired", law=law)
    many = simulate(near_limits, task)
    found = []
    for start in near_limits.starts[many.outcome.values == int(rs.Outcome.LOCAL_MINIMUM)][:4]:
        run = rs.simulate(near_limits.scene, task, start, dt=near_limits.dt, duration=20.0)
        analysis = RunAnalysis(**vars(resimulate_run(run)), trials=True)
        found += [each.evidence["via_m"] for each in advise_via_pose(analysis)]
    assert found
    assert all(distance in (0.25, 0.5) for distance in np.round(found, 9))


def test_the_constraint_is_advice_for_a_lost_target_with_its_price():
    run = rs.load_scenario(rs.examples.path("pbvs_loses_target")).run()
    advice = rs.explain(run).advice[0]
    assert advice.about == "constraint"
    assert advice.changes["task.law"]["kind"] == "constrained"
    assert 0.0 <= advice.evidence.get("path_price", 0.0) < 0.05


def test_advice_names_the_constraint_nearest_at_the_start():
    case = TAUGHT.at("task.law", ConstrainedLaw([JointSpeeds(0.2), FieldOfView()]))
    assert any(
        "body.wz at its upper limit: it acts there" in note for note in rs.advise(case).notes
    )


def test_it_acts_on_tasks_in_order_of_priority():
    scenario = rs.load_scenario(rs.examples.path("mobile_arm"))
    centroid = rs.features.FeatureBlock("point_moments", components=[1, 2])
    levels = [rs.IBVS(features=centroid, gain=3), rs.PBVS()]
    law = ConstrainedLaw([JointSpeeds(0.3), FieldOfView()])
    task = rs.Priorities(levels, law=law)
    run = rs.simulate(scenario.scene, task, scenario.start, duration=40)
    assert int(run.outcome) == rs.Outcome.CONVERGED
    assert float(np.abs(run.qd).max()) <= 0.3
    free = rs.simulate(scenario.scene, rs.Priorities(levels), scenario.start, duration=40)
    assert float(np.abs(free.qd).max()) > 0.3


def test_it_is_written_and_read_and_a_stored_run_keeps_the_record(tmp_path):
    law = ConstrainedLaw([JointSpeeds(0.2), FieldOfView(margin=12, rate=3), "joint_limits"])
    experiment = TAUGHT.at("task.law", law)
    assert type(experiment).from_text(experiment.to_toml()).task.law == law
    run = experiment.run()
    rs.save_run(run, tmp_path / "run.nc")
    again = rs.open_run(tmp_path / "run.nc")
    for name in "active", "slack", "constraint":
        np.testing.assert_array_equal(again[name].values, run[name].values)


@pytest.mark.parametrize(
    ("constraints", "parts"),
    [
        ([FieldOfView(margin=240)], ("margin of 240 px leaves no room", "640 x 480")),
        ([FieldOfView(camera="eye")], ("no camera 'eye'", "cameras of the task: camera")),
        ([JointSpeeds([1.0, 2.0])], ("2 numbers of most for 6",)),
        (
            [HalfSpace("camera", (0, 0, 1), 1.0), HalfSpace("camera", (0, 0, -1), 1.0)],
            ("no command satisfies", "plane for camera"),
        ),
    ],
)
def test_constraints_that_do_not_fit_are_named_before_anything_runs(constraints, parts):
    with pytest.raises(InputError) as error:
        TAUGHT.at("task.law", ConstrainedLaw(constraints)).run()
    assert all(part in str(error.value) for part in parts)


def test_an_image_of_unknown_size_has_no_border():
    scene = TAUGHT.scene
    eye = rs.MountedCamera("camera", rs.Camera(scene.cameras[0].camera.K), on=scene.cameras[0].on)
    task = rs.PBVS(TAUGHT.task.goal, law=ConstrainedLaw([FieldOfView()]))
    with pytest.raises(InputError, match="size of camera 'camera' is unknown"):
        rs.simulate(scene.replacing(eye), task, TAUGHT.start)


@pytest.mark.parametrize(
    ("fields", "part"),
    [
        ({"constraints": []}, "must have at least 1 item, not 0"),
        ({"constraints": ["views"]}, "no constraint 'views'"),
        ({"constraints": ["joint_limits"], "metric": "euclid"}, "no choice 'euclid'"),
        ({"constraints": ["joint_limits"], "joint_weight": 0.0}, "must be a positive number"),
        (
            {"constraints": ["joint_limits"], "law": ConstrainedLaw(["joint_limits"])},
            "give all of them in one list",
        ),
    ],
)
def test_fields_that_mean_nothing_are_refused(fields, part):
    with pytest.raises(InputError, match=part):
        ConstrainedLaw(**fields)


def test_constraints_of_a_switched_scheme_act_only_while_it_commands():
    law = ConstrainedLaw([JointSpeeds(0.05)])
    schemes = rs.PBVS(TAUGHT.task.goal), rs.IBVS(TAUGHT.task.goal, law=law)
    task = rs.Switch(*schemes, when=rs.tasks.ErrorBelow(0.1))
    run = rs.simulate(TAUGHT.scene, task, TAUGHT.start, duration=30.0)
    fast = np.abs(run.qd.values).max(axis=1) > 0.05
    acts = (run.active.values > 0).any(axis=1)
    assert fast.any() and acts.any()
    assert not (fast & acts).any()


def test_prescribed_motions_enter_the_barrier():
    """A target on a belt leaves the image of a slow camera, and not with the constraint."""
    scenario = rs.load_scenario(rs.examples.path("pan_tilt_tracking"))
    slow = scenario.at({"task.feed_forward": None, "task.gain": 0.5})
    assert int(slow.run().outcome) == rs.Outcome.OUT_OF_IMAGE
    run = slow.at("task.law", ConstrainedLaw([FieldOfView(margin=30)])).run()
    (left, right), (top, bottom) = slow.scene.cameras[0].camera.border
    u, v = run.pixels.values[..., 0], run.pixels.values[..., 1]
    room = np.nanmin([u - left, right - u, v - top, bottom - v])
    assert 29.0 < room < 31.0
    assert not (run.slack > 0).any()


def test_names_of_constraints_on_several_tasks_follow_their_rows():
    """The border of the target of the first task is named first, as its rows come first."""
    marks = [[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]]
    other = rs.Object("other", marks=marks[:3], pose=rs.Pose.at(0.05, 0.0, 0.1))
    scene = rs.Scene(TAUGHT.scene.robots, [*TAUGHT.scene.objects, other], TAUGHT.scene.cameras)
    levels = [rs.IBVS(TAUGHT.task.goal, target="square"), rs.PBVS(TAUGHT.task.goal, target="other")]
    task = rs.Priorities(levels, law=ConstrainedLaw([MarkDepth(0.2)]))
    controller = task.bind(scene)
    assert controller.constraint_labels[0] == "least depth of mark 0 of square in camera"
    assert controller.constraint_labels[-1] == "least depth of mark 2 of other in camera"
    run = rs.simulate(scene, task, TAUGHT.start, duration=0.2)
    assert run.sizes["constraint"] == 7
