"""A task keeps the stages of its last run, and no run depends on what ran before."""

import copy
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import robsim as rs
from robsim.files import examples
from robsim.servo.task_controller import LAST_STEPS

TUTORIAL = rs.load_scenario(examples.path("visp_tutorial")).with_(duration=0.8)
CHANGES = {
    "start": lambda e: e.with_(start=TUTORIAL.start + 0.01 * np.eye(7)[0]),
    "dt": lambda e: e.with_(dt=0.02),
    "duration": lambda e: e.with_(duration=0.4),
    "seed": lambda e: e.with_(sensing=rs.Sensing(noise=0.5), seed=3),
    "sensing": lambda e: e.with_(sensing=rs.Sensing(noise=0.5)),
    "latency": lambda e: e.with_(sensing=rs.Sensing(latency=0.1)),
    "lag": lambda e: e.with_(actuation=rs.Actuation(lag=0.1)),
    "first_run": lambda e: e.with_(sensing=rs.Sensing(noise=0.5), first_run=4),
    "hold": lambda e: e.with_(hold=True, duration=30.0),
    "record": lambda e: e.with_(record="summary"),
    "every third": lambda e: e.with_(record=3),
    "ending": lambda e: e.with_(endings=[rs.endings.TooClose("camera", "square", 0.3)]),
    "batch": lambda e: e.with_(start=np.stack([TUTORIAL.start] * 3)),
    "gain": lambda e: e.at("task.gain", 2.0),
}


def make_anew(experiment):
    """Return the experiment with a new scene and a new task, which keep nothing."""
    return pickle.loads(pickle.dumps(experiment))


@pytest.mark.parametrize("change", CHANGES)
def test_a_run_equals_that_of_a_new_task_whatever_ran_before(change):
    changed = CHANGES[change](TUTORIAL)
    expected = make_anew(changed).run()
    first = TUTORIAL.run()
    for _ in range(2):
        assert changed.run().identical(expected)
        assert TUTORIAL.run().identical(first)


def test_the_same_experiment_uses_the_same_stages_with_a_record_of_its_own():
    experiment = make_anew(TUTORIAL)
    loops = [experiment.loop(), experiment.loop()]
    first, second = (each.sequence for each in loops)
    assert first.plant is second.plant and first.program is not second.program
    runs = [experiment.run(), experiment.run()]
    assert runs[0].identical(runs[1])
    assert not np.shares_memory(runs[0].q.values, runs[1].q.values)
    runs[0].q.values[:] = 7.0
    assert runs[1].identical(experiment.run())


def test_copies_of_an_experiment_keep_no_stages():
    experiment = make_anew(TUTORIAL)
    experiment.run()
    controller = experiment.task.bind(experiment.scene)
    assert vars(controller)[LAST_STEPS] is not None
    for other in (copy.deepcopy(experiment), make_anew(experiment)):
        assert vars(other.task.bind(other.scene))[LAST_STEPS] is None


def test_threads_may_run_one_experiment_at_once():
    experiment, expected = make_anew(TUTORIAL), TUTORIAL.run()
    with ThreadPoolExecutor(6) as pool:
        runs = list(pool.map(lambda i: experiment.run(), range(30)))
    assert all(each.identical(expected) for each in runs)
