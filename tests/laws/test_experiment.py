"""An experiment is one value: checked, comparable, changed by name, and repeated from its run."""

import numpy as np
import pytest

import robsim as rs


@pytest.fixture(scope="module")
def visp():
    return rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=0.4)


def batch(experiment, **more):
    starts = np.stack([experiment.start, experiment.scene.home, experiment.start])
    return experiment.run(start=starts, sensing=rs.Sensing(noise=0.5), seed=7, **more)


BAD = {
    "scene: expected a Scene, got 3": {"scene": 3},
    "task: expected a task such as IBVS": {"task": "ibvs"},
    "task: expected a task such as IBVS(...), got <class": {"task": rs.IBVS},
    "start: expected shape (..., 7), got (2,)": {"start": [1, 2]},
    "start: expected shape (7,) or (B, 7), got (0, 7)": {"start": np.empty((0, 7))},
    "sensing: expected a Sensing, got Actuation": {"sensing": rs.Actuation()},
    "actuation: expected an Actuation, got None": {"actuation": None},
    "dt (seconds) must be a positive number, got 0": {"dt": 0},
    "run.duration: dt 0.5 s is longer than the duration 0.4 s": {"dt": 0.5},
    "duration (seconds): nan": {"duration": np.nan},
    "seed must be a whole number from 0 on, got -1": {"seed": -1},
    "hold must be True or False, got 1": {"hold": 1},
    "record must be 'all', 'summary' or every n-th step, got 'some'": {"record": "some"},
    "first_run must be a whole number from 0 on, got 0.5": {"first_run": 0.5},
    "title: expected a text, got 3": {"title": 3},
    "no field 'tsk'; did you mean 'task'? fields: scene, task": {"tsk": 3},
}


@pytest.mark.parametrize("message", BAD)
def test_an_impossible_explanation_is_refused_before_it_runs(visp, message):
    with pytest.raises(rs.errors.InputError) as caught:
        visp.with_(**BAD[message])
    assert str(caught.value).startswith(message)


def test_simulate_is_the_short_form(visp):
    options = {"dt": 0.02, "duration": 0.3, "seed": 3, "sensing": rs.Sensing(noise=0.1)}
    short = rs.simulate(visp.scene, visp.task, visp.start, **options)
    assert short.identical(rs.Experiment(visp.scene, visp.task, visp.start, **options).run())


def test_equal_values_have_equal_hashes_and_texts(visp):
    same, other = visp.with_(), visp.at("task.gain", np.nextafter(visp.task.gain, 1.0))
    assert same == visp and hash(same) == hash(visp) and same.hash == visp.hash
    assert rs.Experiment.from_text(visp.to_toml()) == visp
    assert other != visp and other.hash != visp.hash


def test_a_row_of_a_batch_is_an_experiment_with_its_own_noise(visp):
    runs = batch(visp)
    for row in range(3):
        one = rs.Experiment.of(runs.isel(run=row))
        assert one.first_run == row and one.seed == 7
        np.testing.assert_array_equal(one.run().q, runs.q[row])
    again = rs.Experiment.of(runs.isel(run=[1, 2]))
    assert again.first_run == 1 and again.start.shape == (2, 7)
    np.testing.assert_array_equal(again.run().q, runs.q[1:])


def test_a_number_of_a_run_is_reported_in_its_text(visp):
    one = visp.with_(first_run=5, seed=2**63)
    assert rs.Experiment.from_text(one.text) == one and "first_run = 5" in one.text
    assert "first_run" not in visp.to_toml()
    assert visp.at("run.first_run", 5).first_run == 5


def test_a_dataset_that_is_no_run_has_no_experiment(visp):
    for value in (3, visp, None, rs.simulate):
        with pytest.raises(rs.errors.InputError, match="expected a run, a Dataset of simulate"):
            rs.Experiment.of(value)
    with pytest.raises(rs.errors.InputError, match="are not consecutive"):
        rs.Experiment.of(batch(visp).isel(run=[0, 2]))


def test_errors_name_the_file_where_there_is_one(visp):
    far = visp.with_(task=rs.IBVS(rs.Pose.at(0, 0, 1)))
    with pytest.raises(rs.errors.GoalError, match=r"visp_tutorial.toml: task.goal: the shown goal"):
        far.run()
    with pytest.raises(rs.errors.GoalError, match=r"^the shown goal"):
        rs.Experiment(far.scene, far.task, far.start).run()


@pytest.mark.parametrize(
    ("name", "value", "found"),
    [
        ("task.gain", np.float64(2.0), lambda e: e.task.gain),
        ("task.gain", np.int64(2), lambda e: e.task.gain),
        ("run.hold", np.bool_(True), lambda e: e.hold),
        ("run.dt", np.float32(0.5), lambda e: e.dt),
        ("run.seed", np.uint64(2**63), lambda e: e.seed),
        ("start.q", np.array([0.1, 0, -1, 0, 0, 0, 1]), lambda e: e.start),
    ],
)
def test_numbers_of_numpy_may_be_given_and_are_in_the_text(visp, name, value, found):
    made = visp.with_(duration=5.0).at(name, value)
    np.testing.assert_array_equal(found(made), value)
    np.testing.assert_array_equal(found(rs.Experiment.from_text(made.text)), value)


def test_none_is_the_default_without_a_report(visp):
    slow = visp.with_(sensing=rs.Sensing(period=0.08, noise=1.0), duration=1.0)
    assert slow.at({"sensing.period": None, "sensing.noise": None}).sensing == rs.Sensing()
    assert slow.at("run.duration", None).duration == 10.0
    with pytest.raises(rs.errors.InputError, match=r"task\.kind: missing, and it must be given"):
        slow.at("task.kind", None)


def test_an_error_of_an_experiment_without_a_file_begins_with_the_name(visp):
    own = rs.Experiment(visp.scene, visp.task, visp.start)
    with pytest.raises(rs.errors.InputError) as caught:
        own.at({"task.gain": -1, "run.dt": "40 m"})
    lines = str(caught.value).splitlines()
    assert lines[0] == "task.gain: must be greater than 0, got -1" and len(lines) == 2
