"""Every kind of name with every kind of axis: a row equals the experiment that is built by hand."""

import numpy as np
import pytest

import robsim as rs
from robsim.studies.study_text import format_plan, read_plan

RUNS = 4
EYE, SQUARE = "cameras.eye", "objects.square"
TURN = rs.samplers.Normal(0.0, [0.0, 0.0, 0.02])
CASES = {
    "gain": {"task.gain": rs.samplers.LogUniform(0.5, 2.0)},
    "depth_scale": {"task.depth_scale": rs.samplers.Uniform(0.8, 1.2)},
    "focal": {f"{EYE}.focal": rs.samplers.Uniform(450, 550)},
    "factor": {f"{EYE}.focal": rs.samplers.Product(rs.samplers.Normal(1.0, 0.05))},
    "lengths": {f"{EYE}.focal": [450, 500, 550]},
    "believed lengths": {f"belief.{EYE}.focal": rs.samplers.Grid(450, 550, 3)},
    "even": {f"{EYE}.focal": rs.samplers.Sobol(450, 550), "task.gain": rs.samplers.Sobol(1.0, 2.0)},
    "center": {f"{EYE}.center": rs.samplers.Sum(rs.samplers.Normal(0.0, 3.0))},
    "distortion": {f"{EYE}.distortion": rs.samplers.Normal([0.0, 0.0, 0.0, 0.0], 0.005)},
    "place": {f"{EYE}.position": rs.samplers.Sum(rs.samplers.Normal(0.0, 0.01))},
    "turn": {f"belief.{EYE}.rpy": TURN},
    "both": {f"{EYE}.rpy": TURN, f"belief.{EYE}.focal": rs.samplers.Uniform(480, 520)},
    "marks": {f"{SQUARE}.marks": rs.samplers.Product(rs.samplers.Uniform(0.9, 1.1))},
    "target": {f"belief.{SQUARE}.position": rs.samplers.Sum(rs.samplers.Uniform(-0.02, 0.02))},
    "noise": {
        "sensing.noise": rs.samplers.Uniform(0.0, 1.0),
        "sensing.latency": rs.samplers.Uniform(0.0, 0.1),
    },
    "lag": {"actuation.lag": rs.samplers.Uniform(0.0, 0.1)},
    "period": {"run.dt": ["20 ms", "40 ms"], "task.gain": rs.samplers.Uniform(0.5, 1.0)},
    "words": {"task.interaction": ["current", "mean"], "task.gain": rs.samplers.Choice([0.5, 1.0])},
    "laws": {"task.law": [rs.laws.CameraLaw(length=0.1), "joint"]},
    "inverses": {"task.inverse": rs.samplers.Choice([rs.laws.DampedInverse(0.3), "transpose"])},
    "gains": {"task.gain": [rs.laws.AdaptiveGain(2.0, 0.5, 30.0), 0.1]},
    "tasks": {"task": {"b": rs.PBVS(), "a": rs.IBVS()}, "task.gain": rs.samplers.Uniform(0.5, 1.0)},
    "named": {"task.gain": {"slow": 0.5, "fast": 2.0}},
    "imperfections": {"sensing": [rs.Sensing(noise=1.0), rs.Sensing()]},
    "two in turn": {
        "task.gain": rs.samplers.Grid(0.5, 1.0, 2),
        "task.interaction": ["mean", "desired"],
    },
}
BELIEFS = {
    "true": {},
    "partial": {f"belief.{EYE}.center": [325.0, 240.0]},
    "fixed": {f"belief.{EYE}.focal": 450.0, f"belief.{SQUARE}.position": [0.0, 0.0, 1.1]},
}


def pairs():
    """Each case with each belief about other parts; by default each case with one of them."""
    for i, case in enumerate(CASES):
        beliefs = [name for name, own in BELIEFS.items() if not own.keys() & CASES[case].keys()]
        for j, belief in enumerate(beliefs):
            marks = [] if j == i % len(beliefs) else pytest.mark.full
            yield pytest.param(case, belief, marks=marks)


def study_of(flying, case, belief, **how):
    one = flying.at(BELIEFS[belief]) if BELIEFS[belief] else flying
    start = rs.starts.Shell(distance=(0.05, 0.15), angle=(0.0, 0.3))
    return rs.study(one.with_(duration=0.6), RUNS, seed=3, start=start, vary=CASES[case], **how)


def by_hand(found, number):
    """The end of a run of the experiment with the values in the table."""
    plan, row = found.plan, found.table.iloc[number]
    values = {}
    for axis in plan.axes:
        if not axis.is_number:
            values[axis.name] = axis.values[row[axis.name]]
        elif axis.name in row:
            values[axis.name] = float(row[axis.name])
        else:
            parts = [row[name] for name in row.index if name.startswith(f"{axis.name}[")]
            values[axis.name] = np.array(parts).reshape(axis.shape)
    ordered = dict(sorted(values.items(), key=lambda each: each[0].count(".")))
    start = found.of_run(number).start
    one = plan.experiment.at(ordered).with_(start=start, first_run=int(row["draw"]))
    return one.run(record="summary")


@pytest.mark.filterwarnings("ignore::robsim.base.errors.RankWarning")
@pytest.mark.parametrize(("case", "belief"), list(pairs()))
@pytest.mark.few(4)
def test_a_row_equals_the_experiment_with_its_values(flying, case, belief):
    found = study_of(flying, case, belief)
    for number in range(found.plan.runs):
        run, row = by_hand(found, number), found.table.iloc[number]
        for name in ("error_norm", "distance_to_goal", "path_length", "end_time"):
            assert float(run[name]) == row[name], (number, name)
    assert study_of(flying, case, belief, chunk=1).hash == found.hash


@pytest.mark.filterwarnings("ignore::robsim.base.errors.RankWarning")
@pytest.mark.parametrize("case", CASES)
def test_the_text_of_a_study_gives_the_same_study(flying, case):
    one = study_of(flying, case, "partial").plan
    again = read_plan(rs.Experiment.from_text(format_plan(one)))
    assert format_plan(again) == format_plan(one)
    assert [axis.labels for axis in again.axes] == [axis.labels for axis in one.axes]
    runs = np.arange(one.runs)
    for a, b in zip(one.axes, again.axes, strict=True):
        if a.is_number:
            np.testing.assert_array_equal(
                a.is_number and one.numbers(a, runs), again.numbers(b, runs)
            )
        else:
            np.testing.assert_array_equal(one.codes(a, runs), again.codes(b, runs))
            for x, y in zip(a.values.values(), b.values.values(), strict=True):
                assert one.experiment.at(a.name, x) == again.experiment.at(b.name, y)


def test_standard_measures_of_varied_numbers_agree_with_the_runs_alone(flying):
    found = study_of(flying, "focal", "fixed", measures=True)
    for number in range(RUNS):
        run = found.of_run(number)
        alone = rs.compare({"one": run}).data
        for name in ("retreat", "image_detour", "border_margin", "rotation"):
            assert float(alone[name][0]) == found.table[name].iloc[number], name


def test_the_links_of_an_arm_come_back_from_a_store(tmp_path):
    arm = rs.load_scenario(rs.examples.path("wrong_dh")).with_(duration=0.4)
    name = "belief.robots.puma560.links.forearm.dh"
    vary = {
        f"{name}.a": rs.samplers.Sum(rs.samplers.Normal(0.0, 0.002)),
        f"{name}.alpha": rs.samplers.Product(rs.samplers.Uniform(1, 1.1)),
    }
    found = rs.study(arm, RUNS, vary=vary, store=tmp_path)
    assert rs.open_study(tmp_path).table.equals(found.table)
    run = rs.open_study(tmp_path).replay(2)
    assert float(run.path_length) == found.table["path_length"][2]
