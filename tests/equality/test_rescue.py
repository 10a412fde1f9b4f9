"""Steps of compiled stages that are taken again where Python is needed."""

import numpy as np

import robsim as rs
from robsim import examples
from robsim.engine.chunk import ChunkProgress


def experiment(ahead, duration):
    """A plate that is believed to be somewhere else, behind the camera where `ahead` is below 0."""
    visp = rs.load_scenario(examples.path("visp_tutorial"))
    belief = visp.scene.believe(place=rs.Pose.at(0.05, 0, ahead))
    starts = visp.start + np.array([[0, 0, 0], [0.02, 0, 0.1], [0, 0.03, 0]]) @ np.eye(3, 7)
    return visp.with_(task=rs.PBVS(visp.task.goal, belief=belief), start=starts, duration=duration)


def record_loop(experiment, fast=True, chunk=3):
    loop = experiment.loop()
    assert loop.sequence.compiled
    if not fast:
        loop.sequence._fast = None  # every step through the stages in Python
    for first in range(0, 3, chunk):
        loop.advance(ChunkProgress(np.arange(first, min(first + chunk, 3))), lambda share: None)
    return np.concatenate([loop.recorder.table.ravel(), loop.recorder.ends.ravel()])


def test_a_pose_that_needs_no_python_is_found_by_stages_alone(monkeypatch):
    def refuse(*given):
        raise AssertionError("nothing is lost here")

    near = experiment(0.1, 6.0)
    slow = record_loop(near, fast=False)
    monkeypatch.setattr("robsim.features.feature_rows.refit_lost_poses", refuse)
    np.testing.assert_array_equal(record_loop(near), slow)


def test_steps_that_are_taken_again_have_the_bits_of_steps_one_by_one():
    far = experiment(-3.0, 1.6)
    slow = record_loop(far, fast=False)
    np.testing.assert_array_equal(record_loop(far), slow)
    np.testing.assert_array_equal(record_loop(far, chunk=1), slow)
    q = far.of_run(1).run().q.values
    walked = np.stack([now.q for now in far.of_run(1).steps()])
    np.testing.assert_array_equal(walked, q[: len(walked)])
