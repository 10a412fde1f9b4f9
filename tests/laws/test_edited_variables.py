"""Edits of a variable in place change no other variable, and no later run."""

import numpy as np
import pytest

import robsim as rs


@pytest.fixture(scope="module")
def experiment():
    return rs.load_scenario(rs.examples.path("eye_in_hand"))


def numbers(run, name):
    return np.array(run[name].values)


@pytest.mark.parametrize(
    ("edited", "dependent"),
    [
        ("s", "error"),
        ("s_goal", "error_norm"),
        ("q", "camera_pose"),
        ("q_end", "distance_to_goal"),
        ("qd", "camera_velocity"),
        ("pixels_goal", "pixel_error"),
        ("pixels_end", "pixel_error"),
    ],
)
def test_an_edit_of_a_variable_changes_no_other(experiment, edited, dependent):
    expected, run = numbers(experiment.run(), dependent), experiment.run()
    run[edited].values[...] = 0.25
    np.testing.assert_array_equal(numbers(run, dependent), expected)


def test_edits_of_a_run_change_no_later_run(experiment):
    fresh = rs.load_scenario(rs.examples.path("eye_in_hand")).run()
    edited = experiment.run()
    for name in edited.data_vars:
        if edited[name].dtype.kind == "f":
            edited[name].values[...] = 0.25
    assert experiment.run().identical(fresh)


class Copied(rs.IBVS):
    """A task that hands out one controller, changed in between."""

    def bind(self, scene, columns=None):
        if not hasattr(self, "own"):
            object.__setattr__(self, "own", self._build_controller(scene, self.columns(scene)))
        return self.own


def test_a_controller_that_its_task_does_not_keep_has_new_stages_in_each_run(experiment):
    task = Copied()
    first = rs.simulate(experiment.scene, task, duration=0.4)
    task.own.s_goal[...] += 0.05
    second = rs.simulate(experiment.scene, task, duration=0.4)
    assert np.abs(first.qd.values[0]).max() < 1e-9
    assert np.abs(second.qd.values[0]).max() > 1e-3
