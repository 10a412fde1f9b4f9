"""Loops that learn unknown quantities: depth by a filter, the Jacobian by Broyden's rule."""

import numpy as np
import pytest

import robsim as rs
from robsim.base.arrays import move_runs_last
from robsim.kernels.control.broyden_update import learn_jacobian
from robsim.kernels.estimation.inverse_depth_filter import filter_depths
from robsim.servo.single_step import SingleStepController

quiet = pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")
STARTS = 10


def filtered(scene, task, run):
    """The final state of the filter of a noisy run, (runs, N): relative error of 1/Z, and its own
    relative standard deviation. The run is gone through again with its own measurements."""
    controller, memory = task.bind(scene), {}
    for step in range(run.sizes["time"]):
        decision, seen = instant(controller, run, step, memory)
        np.testing.assert_allclose(decision.command.qd.T, run.qd.values[:, step], atol=1e-9)
    near, variance = state_of(memory["alone"], memory["blocks"])
    return near.T * seen.depth.T - 1.0, np.sqrt(variance.T) / near.T


def calls_of(alone, stage):
    """The numbers of the calls of a stage."""
    return [call[1] for call in alone.program.calls if isinstance(call, tuple) and call[0] is stage]


def state_of(alone, blocks):
    """The 1/Z (N, B) of a depth filter, and its variance."""
    (p,) = calls_of(alone, filter_depths)
    return blocks.get(p[5], p[0], 3)[:, 2], blocks.get(p[6], p[0], 3, 3)[:, 2, 2]


def instant(controller, run, step, memory):
    """The decision at a step of runs on pixels, and the projection; the memory goes on."""
    q, sight = move_runs_last(run.q.values[:, step], 1), controller.sights[0]
    seen = sight.project(q)
    pixels = np.ascontiguousarray(run.s.values[:, step].T.reshape(seen.pixels.shape))
    if not memory:
        memory["alone"] = SingleStepController(controller, 0.04)
        memory["blocks"] = memory["alone"].begin(q.shape[1])
    given = {sight.key: pixels}, {sight.key: seen.depth}
    return memory["alone"].decide(memory["blocks"], step, q, *given), seen


@pytest.mark.parametrize("name", ["free", "eye_in_hand", "eye_to_hand"])
@pytest.mark.parametrize("wrong", [0.7, 1.5])
def test_a_filtered_depth_serves_under_a_pixel_of_noise(arrange, around, wrong, name):
    """From ten starts, with a first depth that is far off, all come to within 3 px."""
    scene = arrange(name)
    Z = scene.view(points="plate").depth.mean()
    task = rs.IBVS(features="pixels", tolerance=3.0, depth=rs.laws.DepthFilter(wrong * float(Z)))
    q0 = around(scene, STARTS, spread=0.15, seed=1)
    run = rs.simulate(scene, task, q0, duration=20, sensing=rs.Sensing(noise=1.0), seed=2)
    assert (run.outcome == rs.Outcome.CONVERGED).all()
    assert (run.pixel_error < 8.0).all()


@pytest.mark.parametrize("name", ["free", "eye_in_hand", "eye_to_hand"])
@pytest.mark.parametrize("wrong", [0.7, 1.5])
def test_a_filtered_depth_is_right_at_the_end(arrange, around, wrong, name):
    """Within a tenth for nearly all marks; the others moved too little across their rays, and
    there the filter is uncertain: its error is within four of its own standard deviations."""
    scene = arrange(name)
    Z = scene.view(points="plate").depth.mean()
    task = rs.IBVS(features="pixels", depth=rs.laws.DepthFilter(wrong * float(Z)))
    q0 = around(scene, STARTS, spread=0.2, seed=1)
    run = rs.simulate(scene, task, q0, duration=5, sensing=rs.Sensing(noise=1.0), seed=2, hold=True)
    assert (run.outcome == rs.Outcome.TIME_LIMIT).all()
    error, sigma = filtered(scene, task, run)
    assert (np.abs(error) < 0.1).mean() >= 0.9 and np.median(np.abs(error)) < 0.02
    assert np.abs(error / sigma).max() < 4.0 and (error / sigma).std() < 1.3


@pytest.mark.parametrize("name", ["free", "free_target", "eye_to_hand", "stereo_in_hand"])
def test_broyden_arrives_from_a_jacobian_that_is_wrong_by_a_third(arrange, around, decide, name):
    """A start within 30 % of the true L J, entry by entry; no joint is one too many."""
    scene = arrange(name)
    eye = scene.cameras[0].name
    q0 = around(scene, STARTS, spread=0.05, seed=3)
    true = decide(scene, rs.IBVS(camera=eye), scene.home).command.task_jacobian[..., 0]
    wrong = true * np.random.default_rng(4).uniform(0.7, 1.3, true.shape)
    task = rs.IBVS(camera=eye, interaction=rs.laws.Broyden(wrong))
    run = rs.simulate(scene, task, q0, duration=60, record="summary")
    assert (run.outcome == rs.Outcome.CONVERGED).all()


def test_broyden_explains_every_step_that_it_saw(arrange, around):
    """A_(k+1) dq = ds for the step just made."""
    scene, task = arrange("eye_in_hand"), rs.IBVS(features="pixels", interaction="broyden")
    run = rs.simulate(scene, task, around(scene, 3), duration=0.4)
    memory, controller = {}, task.bind(scene)
    for step in range(10):
        task_jacobian = instant(controller, run, step, memory)[0].command.task_jacobian
        if step:
            ds, dq = (run[name].values[:, step] - run[name].values[:, step - 1] for name in "sq")
            np.testing.assert_allclose(np.einsum("knb,bn->bk", task_jacobian, dq), ds, atol=1e-9)


LEARNING = rs.IBVS(features="pixels", interaction="broyden")
SEVERAL = {
    "ordered": rs.Priorities(
        [rs.IBVS(features=[rs.features.FeatureBlock("pixels", marks=[0])]), LEARNING]
    ),
    "switched": rs.Switch(
        rs.IBVS(features="pixels", gain=2.0), LEARNING, rs.tasks.ErrorBelow(15.0)
    ),
    "latent": rs.Switch(LEARNING, rs.IBVS(features="pixels"), rs.tasks.ErrorBelow(15.0)),
}


@pytest.mark.parametrize("task", SEVERAL)
def test_among_several_tasks_broyden_learns_from_the_final_command(arrange, around, task):
    """The update explains the step that was executed, not the step of the scheme alone."""
    scene, before = arrange("eye_in_hand"), None
    controller = SEVERAL[task].bind(scene)
    sight, q = controller.sights[0], move_runs_last(around(scene, 3), 1)
    alone = SingleStepController(controller, 0.04)
    blocks, (p,) = alone.begin(3), calls_of(alone, learn_jacobian)
    for step in range(40):
        seen = sight.project(q)
        given = {sight.key: seen.pixels}, {sight.key: seen.depth}
        decision = alone.decide(blocks, step, q, *given)
        s, task_jacobian = blocks.get(p[3], p[0]), blocks.get(p[7], p[0], p[1])
        if before is not None:
            dq, ds = q - before[0], s - before[1]
            np.testing.assert_allclose(np.einsum("knb,nb->kb", task_jacobian, dq), ds, atol=1e-8)
        before = q.copy(), s
        q = q + 0.04 * decision.command.qd


@pytest.mark.parametrize("task", [rs.PBVS(), rs.Hybrid()], ids=["PBVS", "Hybrid"])
def test_an_estimated_pose_serves_under_a_pixel_of_noise(arrange, around, task):
    """A small plate seen from in front; the noise hides its tilt."""
    scene = arrange("eye_in_hand")
    run = rs.simulate(
        scene, task, around(scene, 10), duration=5, sensing=rs.Sensing(noise=1.0), seed=3, hold=True
    )
    assert set(run.outcome.values.tolist()) <= {rs.Outcome.TIME_LIMIT, rs.Outcome.CONVERGED}
    assert run.pixel_error.max() < 10.0


@pytest.mark.full
@pytest.mark.parametrize("task", [rs.PBVS, rs.Hybrid])
@pytest.mark.parametrize("ahead", [-3.0, -1.2])
def test_a_target_believed_behind_the_camera_is_found_in_the_image(task, ahead):
    """No guess leads there: the pose is estimated from the image alone, alone and in a batch."""
    visp = rs.load_scenario(rs.examples.path("visp_tutorial"))
    lost = visp.scene.believe(place=rs.Pose.at(0.4, 0, ahead, rpy=(1, 0.5, 2)))
    scheme, goal = task(visp.task.goal, belief=lost, gain=3.0), visp.task.goal.q
    options = {"duration": 20, "record": "summary"}
    starts = visp.start + np.array([[0, 0, 0], [0.02, 0, 0.1]]) @ np.eye(3, 7)
    run = rs.simulate(visp.scene, scheme, starts, **options)
    assert (run.outcome == rs.Outcome.CONVERGED).all()
    np.testing.assert_allclose(run.q_end[:, :3], np.tile(goal[:3], (2, 1)), atol=1e-5)
    alone = rs.simulate(visp.scene, scheme, starts[1], **options, first_run=1)
    np.testing.assert_array_equal(run.q_end[1], alone.q_end)
