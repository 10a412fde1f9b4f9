"""Several tasks: in order, one after the other, and side by side."""

import numpy as np
import pytest

import robsim as rs

P = rs.features.FeatureBlock
quiet = pytest.mark.filterwarnings("ignore::robsim.errors.RankWarning")


def times(A, x):
    return np.einsum("knb,nb->kb", A, x)


def one_mark(n, feature="points", **what):
    return rs.IBVS(features=[P(feature, marks=[n])], **what)


LEVELS = {
    "points": [one_mark(0, gain=2.0), one_mark(1), one_mark(2, "log_depth", gain=0.5)],
    "and a pose": [one_mark(0, gain=2.0), rs.PBVS(), one_mark(3, gain=0.7)],
    "in conflict": [one_mark(0, gain=2.0), one_mark(1), rs.IBVS(gain=3.0)],
    "weighted": [one_mark(0, gain=2.0), rs.IBVS(features=[P("points", weight=3.0)]), rs.PBVS()],
}


@pytest.mark.parametrize("name", ["eye_in_hand", "eye_to_hand", "face_to_face", "mobile_arm"])
@pytest.mark.parametrize("levels", LEVELS)
def test_the_first_task_is_served_exactly_whatever_the_others_want(
    arrange, around, decide, levels, name
):
    """L1 J qd = -gain e1 at every state, and each next task does not see those behind it."""
    scene, tasks = arrange(name), LEVELS[levels]
    q = around(scene, 8, spread=0.06)
    parts = [decide(scene, task, q, columns=tasks[0].columns(scene)).command for task in tasks]
    qd = decide(scene, rs.Priorities(tasks), q).command.qd
    np.testing.assert_allclose(times(parts[0].task_jacobian, qd), -2.0 * parts[0].error, atol=1e-11)
    two = decide(scene, rs.Priorities(tasks[:2]), q).command.qd
    np.testing.assert_allclose(
        times(parts[1].task_jacobian, qd), times(parts[1].task_jacobian, two), atol=1e-9
    )


@pytest.mark.parametrize("levels", LEVELS)
def test_the_first_error_decays_as_if_alone(arrange, around, levels):
    """||e1|| = exp(-gain t) ||e1(0)||, but for the period: half of it, half of the difference."""
    scene = arrange("eye_in_hand")
    q0, misses = around(scene, 4, spread=0.03), []
    for dt in (4e-3, 2e-3):
        task = rs.Priorities(LEVELS[levels])
        run = rs.simulate(scene, task, q0, dt=dt, duration=1.0, hold=True)
        norm = np.linalg.norm(run.error.values[..., :2], axis=2)
        decay = np.exp(-2.0 * run.time.values)
        misses.append(np.abs(norm / norm[:, :1] - decay).max())
    assert misses[0] < 0.02
    assert misses[0] / misses[1] == pytest.approx(2.0, abs=0.15)


def test_three_levels_on_the_panda_all_arrive(arrange, around):
    scene = arrange("eye_in_hand")
    tasks = [one_mark(0), one_mark(2), one_mark(1), one_mark(3)]
    for count in (2, 3, 4):
        task = rs.Priorities(tasks[:count])
        run = rs.simulate(scene, task, around(scene, 6, spread=0.06), duration=40, record="summary")
        assert (run.outcome == rs.Outcome.CONVERGED).all()


def test_one_task_of_two_levels_that_agree_is_that_task(arrange, around, decide):
    """A second level with the same aim has nothing left to do."""
    scene = arrange("eye_in_hand")
    q = around(scene, 4)
    twice = decide(scene, rs.Priorities([rs.PBVS(), rs.PBVS()]), q).command.qd
    np.testing.assert_allclose(twice, decide(scene, rs.PBVS(), q).command.qd, atol=1e-11)


def test_a_switch_is_the_first_scheme_before_and_the_second_after(arrange, around):
    scene, timing = arrange("eye_in_hand"), {"dt": 0.04, "duration": 6.0, "hold": True}
    q0 = around(scene, 5, spread=0.1)
    task = rs.Switch(rs.PBVS(), rs.IBVS(), rs.tasks.ErrorBelow(0.03))
    both, first = (rs.simulate(scene, each, q0, **timing) for each in (task, rs.PBVS()))
    largest = np.abs(both.error.values[..., :6]).max(2)
    for b in range(5):
        step = int(np.argmax(largest[b] < 0.03))
        assert 3 < step < 120
        np.testing.assert_array_equal(both.q[b, : step + 1], first.q[b, : step + 1])
        np.testing.assert_array_equal(both.qd[b, :step], first.qd[b, :step])
        second = rs.simulate(scene, rs.IBVS(), both.q.values[b, step], **timing)
        np.testing.assert_array_equal(both.q[b, step:], second.q[: 151 - step])
        assert (both.qd[b, step] != first.qd[b, step]).any()


class Between:
    """True in a band of the first scheme's largest error: not for good."""

    def holds(self, first, second):
        largest = np.abs(first.error).max(axis=1)
        return (largest < 0.06) & (largest > 0.03)


def test_a_latch_stays_and_without_it_the_condition_is_evaluated_anew(arrange, around, decide):
    scene, timing = arrange("eye_in_hand"), {"dt": 0.04, "duration": 6.0, "hold": True}
    q0 = around(scene, 5, spread=0.15, seed=2)
    for latch in (True, False):
        task = rs.Switch(rs.PBVS(), rs.IBVS(), Between(), latch=latch)
        run = rs.simulate(scene, task, q0, **timing)
        largest = np.abs(run.error.values[..., :6]).max(2)
        inside = (largest < 0.06) & (largest > 0.03)
        second = np.maximum.accumulate(inside, axis=1) if latch else inside
        assert second.any(1).all() and not second[:, 0].any()
        for b in range(5):
            q = run.q.values[b]
            one, other = (decide(scene, each(), q).command.qd.T for each in (rs.PBVS, rs.IBVS))
            np.testing.assert_array_equal(run.qd[b], np.where(second[b][:, None], other, one))


def test_near_the_border_means_in_pixels_of_the_image(arrange, around, decide):
    """IBVS takes over if a mark is within the margin of any of the four borders."""
    scene, size, margin = arrange("eye_in_hand"), (800, 800), 250.0
    q = around(scene, 40, spread=0.25)
    pixels = scene.view(q, points="plate").pixels
    near = ((pixels < margin) | (pixels > np.array(size) - margin)).any((1, 2))
    assert 5 < near.sum() < 35
    switch = rs.Switch(rs.PBVS(), rs.IBVS(), rs.tasks.NearBorder(margin, size))
    qd, one, other = (decide(scene, t, q).command.qd for t in (switch, rs.PBVS(), rs.IBVS()))
    np.testing.assert_array_equal(qd, np.where(near, other, one))


def test_side_by_side_each_moves_as_if_it_were_alone(arrange, around):
    """A head watches and an arm works: bit for bit the same as in two separate scenes."""
    both, timing = arrange("head_and_arm"), {"dt": 0.04, "duration": 4.0, "hold": True}
    watch = rs.IBVS(camera="watch", target="dish", features="pixels")
    work = rs.PBVS(camera="camera", target="plate", gain=2.0)
    q0 = around(both, 4)
    run = rs.simulate(both, rs.Parallel([watch, work]), q0, **timing)
    head = rs.Scene(both.robots[:1], both.objects[:1], both.cameras[:1])
    arm = rs.Scene(both.robots[1:], both.objects[1:], both.cameras[1:])
    np.testing.assert_array_equal(run.q[..., :2], rs.simulate(head, watch, q0[:, :2], **timing).q)
    np.testing.assert_array_equal(run.q[..., 2:], rs.simulate(arm, work, q0[:, 2:], **timing).q)


def test_side_by_side_arrives_when_the_last_one_does(arrange, around):
    both = arrange("head_and_arm")
    watch = rs.IBVS(camera="watch", target="dish")
    slow, fast = (rs.PBVS(camera="camera", target="plate", gain=gain) for gain in (0.5, 2.0))
    q0 = {"panda": around(arrange("eye_in_hand"), 4)}
    runs = [rs.simulate(both, rs.Parallel([watch, work]), q0, duration=60) for work in (slow, fast)]
    for run in runs:
        assert (run.outcome == rs.Outcome.CONVERGED).all()
    assert (runs[0].end_time > 3.5 * runs[1].end_time).all()


@quiet
def test_two_arms_share_the_work_side_by_side(arrange, around):
    """Each with its own camera and joints, on the same plate: the worker receives the
    view of the watcher's camera, the watcher its own view, and together they meet."""
    scene = arrange("face_to_face")
    tasks = [rs.PBVS(joints="worker"), rs.PBVS(joints="watcher")]
    run = rs.simulate(scene, rs.Parallel(tasks), around(scene, 4), duration=20)
    assert (run.outcome == rs.Outcome.CONVERGED).all()


def test_each_scheme_of_a_switch_moves_its_own_joints(arrange, around):
    """First the worker comes to the watcher, then the watcher to the worker."""
    scene, q0 = arrange("face_to_face"), around(arrange("face_to_face"), 4)
    task = rs.Switch(rs.PBVS(joints="worker"), rs.IBVS(joints="watcher"), rs.tasks.ErrorBelow(0.01))
    run = rs.simulate(scene, task, q0, duration=40)
    assert (run.outcome == rs.Outcome.CONVERGED).all()
    for b in range(4):
        largest = np.abs(run.error.values[b, :, :6]).max(1)
        step = int(np.argmax(largest < 0.01))
        worker, watcher = run.qd.values[b, :, :6], run.qd.values[b, :, 6:]
        assert (watcher[:step] == 0.0).all() and (np.abs(worker[:step]).max(1) > 0).all()
        assert (np.nan_to_num(worker[step:]) == 0.0).all() and np.abs(watcher[step]).max() > 0


class Watched:
    """Whether the dish, the first target of the first scheme, is nearly at its place."""

    def holds(self, first, second):
        return np.abs(first.error[:, :8]).max(axis=1) < 0.005


def test_a_switch_may_hold_tasks_side_by_side(arrange, around):
    """They command fewer joints than the scheme that follows them."""
    scene, timing = arrange("head_and_arm"), {"duration": 6.0, "hold": True}
    watch = rs.IBVS(camera="watch", target="dish")
    coarse = rs.IBVS(camera="camera", target="plate", joints=["panda.link1", "panda.link2"])
    fine = rs.PBVS(camera="camera", target="plate")
    both, q0 = rs.Parallel([watch, coarse]), around(scene, 3)
    run = rs.simulate(scene, rs.Switch(both, fine, Watched()), q0, **timing)
    before = rs.simulate(scene, both, q0, **timing)
    for b in range(3):
        step = int(np.argmax(np.abs(run.error.values[b, :, :8]).max(1) < 0.005))
        assert step > 3
        np.testing.assert_array_equal(run.q[b, : step + 1], before.q[b, : step + 1])
        after = rs.simulate(scene, fine, run.q.values[b, step], **timing)
        np.testing.assert_array_equal(run.q[b, step:], after.q[: run.sizes["time"] - step])


@pytest.mark.parametrize(
    "task, message",
    [
        (rs.IBVS(joints="worker"), "joints, secondary, smooth_start and limit belong"),
        (rs.IBVS(smooth_start=1.0), "joints, secondary, smooth_start and limit belong"),
    ],
)
def test_shaping_of_the_whole_command_does_not_belong_to_one_level(task, message):
    with pytest.raises(rs.errors.InputError, match=message):
        rs.Priorities([task, rs.PBVS()])


@pytest.mark.parametrize("kind", [rs.Placing, rs.Docking, rs.Partitioned])
def test_a_level_has_no_law_of_its_own(kind):
    with pytest.raises(
        rs.errors.InputError, match=f"priorities are for tasks such as.*got {kind.__name__}"
    ):
        rs.Priorities([kind(), rs.IBVS()])


def test_a_level_has_no_inverse_of_its_own():
    """The remainder for each task is inverted by `rcond` of the whole."""
    with pytest.raises(rs.errors.InputError, match=r"inverse: .* inverts the task Jacobians"):
        rs.Priorities([rs.IBVS(inverse="damped"), rs.PBVS()])


@pytest.mark.parametrize("size", [None, 3, (1, 2, 3), [640]])
def test_an_image_has_two_sides(size):
    with pytest.raises(rs.errors.InputError, match=r"expected \(width, height\) in whole pixels"):
        rs.tasks.NearBorder(10, size)


@pytest.mark.parametrize("value", [None, np.ones(3), np.ones((1, 3)), np.full((1, 7), np.nan)])
def test_a_secondary_motion_of_the_wrong_shape_is_refused(arrange, around, value):
    class Odd:
        def velocity(self, q, limits):
            return value

    scene = arrange("eye_in_hand")
    with pytest.raises(rs.errors.InputError, match=r"Odd\.velocity"):
        rs.simulate(scene, rs.IBVS(secondary=Odd()), around(scene)[0])
