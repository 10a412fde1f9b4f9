"""Marks that come and go in a run: the remaining marks, the same bits, late images, logs."""

from dataclasses import replace

import numpy as np
import pytest
from poster import BESIDE, GOAL, HIDDEN, LESS, POSTER, SCENE

import robsim as rs

# remaining marks


def leaving(scene=SCENE, task=None, **how):
    """A run: the poster is pulled away, along its x at 0.2 m/s, and hardly followed."""
    task = task or rs.IBVS(rs.tasks.TaughtGoal([*POSTER.goal, 0.0]), gain=1e-3, **how)
    along = rs.Pose.at(0, 0, 0, rpy=(0, np.pi / 2, 0))
    joint = rs.joints.Joint("prismatic", place=along)
    rail = rs.Robot("rail", [rs.joints.Link("base"), rs.joints.Link("cart", "base", joint)])
    marks = scene.object().marks @ along.rotation  # in axes of the cart
    poster = rs.Object("square", marks=marks, on="rail.cart")
    moving = rs.Scene((*scene.robots, rail), poster, scene.cameras, [rs.Motion("rail", [0.2])])
    return rs.simulate(moving, task, [*BESIDE, 0.0], dt=0.04, duration=8)


def test_a_run_ends_out_of_image_where_too_few_marks_are_left():
    ends = {}
    for least in (1, 12, 40):
        run = leaving(weighting=rs.weights.Border(least=least))
        marks = (run.weight.values[:, ::2] > 0).sum(axis=1)
        last = round(float(run.end_time) / 0.04)
        assert rs.Outcome(int(run.outcome)) is rs.Outcome.OUT_OF_IMAGE
        assert marks[last] < max(least, 6) <= marks[last - 1]  # five are in a column
        ends[least] = float(run.end_time)
    assert ends[40] < ends[12] < ends[1]


def test_without_the_weighting_the_same_run_ends_with_the_first_mark():
    plain, every = leaving(), leaving(weighting=rs.weights.Border(least=40))
    assert float(plain.end_time) == float(every.end_time) > 0


def test_the_end_and_the_marks_are_reported():
    run = leaving(weighting="border")
    explanation = rs.explain(run, trials=False)
    assert (
        "too few marks are left for a command: 5 of 40 are in the image, and L J"
        in explanation.what
    )
    diagnosis = rs.diagnose(run)
    last = diagnosis.sizes["time"] - 1
    marks = diagnosis.marks_in_image.values
    assert marks[0] == 40 and marks[last] == 5 and diagnosis.rank_task_jacobian[last] == 5
    assert (diagnosis.rank_task_jacobian[:last] == 6).all()
    start = POSTER.starts[LESS[0]]
    arrived = rs.simulate(SCENE, rs.IBVS(GOAL, weighting="border"), start, duration=20)
    note = rs.explain(arrived)
    assert note.causes[0].about == "visibility"
    assert note.causes[0].evidence["least_marks"] == (SCENE.view(start).visibility == 0).sum()
    blind = rs.simulate(SCENE, rs.IBVS(GOAL), start, duration=20)
    assert "Try: With weighting='border' the same start" in str(rs.explain(blind))


def test_a_start_that_sees_too_little_is_reported_before_the_run():
    away = rs.Pose.at(3.0, 0, 0.61, rpy=(np.pi, 0, 0)).q
    task = rs.IBVS(GOAL, weighting="border")
    with pytest.raises(rs.errors.InputError, match="sees too few marks to command by"):
        rs.Experiment(SCENE, task, away).check()
    run = rs.simulate(SCENE, task, away)
    assert rs.Outcome(int(run.outcome)) is rs.Outcome.OUT_OF_IMAGE and run.end_time == 0
    rs.Experiment(SCENE, task, POSTER.starts[LESS[0]]).check()


def test_a_singular_arm_is_not_taken_for_an_image_without_marks():
    """At the stretched elbow J has rank 5, and so has L J, though every mark is there."""
    scenario = rs.load_scenario(rs.examples.path("eye_in_hand"))
    ends = []
    for weighting in ((), "border"):
        task = rs.IBVS(scenario.task.goal, weighting=weighting)
        run = rs.simulate(scenario.scene, task, scenario.start, duration=0.4)
        ends.append(int(run.outcome))
    assert ends[0] == ends[1]


def test_a_switch_goes_on_while_the_scheme_whose_turn_it_is_can():
    """One needs six marks at a side of the poster, and the other all that are there."""
    goal = rs.tasks.TaughtGoal([*POSTER.goal, 0.0])
    row = rs.features.FeatureBlock("points", marks=[7, 15, 23, 31, 39, 6])  # these leave first
    narrow = rs.IBVS(goal, gain=1e-3, features=[row], weighting="border")
    wide = rs.IBVS(goal, gain=1e-3, weighting="border")
    ends = [
        float(leaving(task=rs.Switch(*pair, when=rs.tasks.ErrorBelow(value, of="first"))).end_time)
        for pair in ((narrow, wide), (wide, narrow))
        for value in (10.0, 1e-9)
    ]
    alone = [float(leaving(task=task).end_time) for task in (narrow, wide)]
    assert ends == [alone[1], alone[0], alone[0], alone[1]] and alone[0] != alone[1]


# the same bits


def test_a_batch_has_the_bits_of_single_runs_in_any_chunks_and_threads():
    starts = POSTER.starts[LESS[:9]]
    for scheme in (rs.IBVS, rs.PBVS):
        task = scheme(GOAL, weighting=["border", rs.weights.Fade(time=0.3)])
        how = {"dt": 0.04, "duration": 2, "sensing": HIDDEN}
        whole = rs.simulate(SCENE, task, starts, **how)
        parts = rs.simulate(SCENE, task, starts, **how, chunk=2, threads=2)
        for name in ("q", "qd", "s", "weight", "error_norm"):
            np.testing.assert_array_equal(whole[name], parts[name])
        for i in (0, 4, 8):
            alone = rs.simulate(SCENE, task, starts[i], **how)
            for name in ("q", "qd", "s", "weight"):
                np.testing.assert_array_equal(whole[name][i], alone[name])


def test_runs_whose_cameras_and_marks_differ_have_the_bits_of_single_runs():
    task = rs.IBVS(GOAL, weighting=["border", "fade"])
    one = rs.Experiment(SCENE, task, POSTER.starts[LESS[0]], duration=1, sensing=HIDDEN)
    several = one.vary({"cameras.eye.focal": [480.0, 500.0, 520.0]})
    run = several.run()
    assert (
        np.isnan(run.s.values).any(axis=(1, 2)) & (run.weight.values < 1).any(axis=(1, 2))
    ).all()
    for i in range(3):
        np.testing.assert_array_equal(several.of_run(i).run().qd, run.qd[i])


# images that are late, lost or noisy


@pytest.mark.parametrize(
    "sensing",
    [
        rs.Sensing(latency=0.07, noise=0.3, dropped=0.2, period=0.08),
        rs.Sensing(quantisation=0.5, latency=0.1, outliers=0.02),
    ],
)
def test_a_mark_that_is_not_in_a_late_image_has_no_weight(sensing):
    task = rs.IBVS(GOAL, gain=0.5, weighting="border")
    run = rs.simulate(SCENE, task, POSTER.starts[LESS[0]], duration=4, sensing=sensing)
    assert np.isfinite(run.qd.values).all() and run.end_time == 4
    unseen = np.isnan(run.s.values)
    assert unseen.any() and (run.weight.values[unseen] == 0).all()
    assert run.error_norm[-1] < 0.5 * run.error_norm[0]


# logs


def test_a_log_of_marks_that_come_and_go_is_the_run_again():
    """Every mark is seen before its first period, and some are not there in others."""
    task = rs.IBVS(GOAL, weighting="border")
    made = rs.Experiment(SCENE, task, BESIDE, dt=0.04, duration=0.4)
    run = made.run()
    rows = rs.logs.to_table(run)
    hidden = [f"pixels[{i},{axis}]" for i in (3, 17) for axis in ("column", "row")]
    rows.loc[4:, hidden] = np.nan
    again = rs.logs.read_log(rows, made)
    weights = run.weight.values.copy()
    weights[4:, [6, 7, 34, 35]] = 0
    np.testing.assert_array_equal(again.weight, weights)
    np.testing.assert_array_equal(np.isnan(again.error), weights == 0)
    assert rs.Outcome(int(again.outcome)) is rs.Outcome.RUNNING
    every = made.with_(task=rs.IBVS(GOAL))
    assert rs.Outcome(int(rs.logs.read_log(rows, every).outcome)) is rs.Outcome.OUT_OF_IMAGE


# files


def test_a_weighting_of_a_file_can_be_switched_off():
    """A file without weightings gives the empty list."""
    made = rs.load_scenario(rs.examples.path("marks_come_and_go"))
    for none in ([], "[]"):
        off = made.at("task.weighting", none)
        assert made.task.weighting and off.task.weighting == ()
    plain = made.with_(task=replace(made.task, weighting=()))
    np.testing.assert_array_equal(off.run(duration=0.4).qd, plain.run(duration=0.4).qd)
