"""Bags with clocks that jitter, written by rosbags: messages of an instant with own stamps."""

import numpy as np
import pytest
from bagging import NANO, detections, serialise, state, write_bag
from rosbags.rosbag2 import StoragePlugin

import robsim as rs
from robsim.logs import message_types
from robsim.logs.command_messages import make_joint_state
from robsim.logs.message_types import make_message

EXPERIMENT = rs.load_scenario(rs.examples.path("chapter_6_1"))


@pytest.fixture(scope="module")
def whole():
    run = EXPERIMENT.run()
    return run.isel(time=np.isfinite(run.q.values).all(axis=1))


def messages(run, stamps, delays):
    """Joints, commands and marks of a run, stamped at times (T, 3) and recorded a little later."""
    joints, velocities = run.coordinate.values.tolist(), run.velocity.values.tolist()
    for i, (at, command_at, image_at) in enumerate(stamps.tolist()):
        velocity = make_joint_state(
            make_message, round(command_at * NANO), velocities, np.empty(0), run.qd.values[i]
        )
        marks = {f"cube.{k}": pixel for k, pixel in enumerate(run.pixels.values[i].tolist())}
        for topic, kind, time, each in (
            ("/joint_states", message_types.JOINTS, at, state(run.q.values[i], joints, at)),
            ("/joint_commands", message_types.JOINTS, command_at, serialise(velocity)),
            ("/camera/detections", message_types.DETECTIONS, image_at, detections(marks, image_at)),
        ):
            yield topic, kind, round((time + delays[i]) * NANO), each


@pytest.mark.parametrize("clock", ["header", "log"])
@pytest.mark.parametrize("jitter", [0.0, 1e-9, 1e-7, 1e-6, 1e-3, 8e-3])
def test_each_message_belongs_to_its_instant(whole, jitter, clock, tmp_path):
    """With the last message before k dt, about half of the rows were one period old."""
    rng = np.random.default_rng(2)
    stamps = 1e4 + whole.time.values[:, None] + rng.uniform(-jitter, jitter, (len(whole.time), 3))
    delays = rng.uniform(0.0, jitter, len(stamps)) if clock == "header" else np.zeros(len(stamps))
    storage = StoragePlugin.SQLITE3 if jitter == 1e-3 else StoragePlugin.MCAP
    path = write_bag(tmp_path / "bag", messages(whole, stamps, delays), storage)
    found = rs.logs.read_bag(path, EXPERIMENT, clock=clock)
    for name in ("q", "qd", "pixels"):
        np.testing.assert_array_equal(found[name].values, whole[name].values, err_msg=name)
    assert rs.Outcome(int(found.outcome)) is rs.Outcome.CONVERGED
    assert rs.explain(found, trials=False).causes == ()


def test_images_with_the_stamp_of_their_exposure_are_used_at_the_next_instant(tmp_path):
    """Images 0.7 periods old: the controller used each at the instant after it."""
    run = EXPERIMENT.run(duration=2.0)
    rng = np.random.default_rng(9)
    stamps = 1e4 + run.time.values[:, None] + [0.0, 0.004, -0.028]
    stamps += rng.uniform(-4e-3, 4e-3, stamps.shape)
    path = write_bag(tmp_path / "bag", messages(run, stamps, np.zeros(len(stamps))))
    found = rs.logs.read_bag(path, EXPERIMENT)
    np.testing.assert_array_equal(found.pixels.values, run.pixels.values[: len(found.time)])
    np.testing.assert_array_equal(found.qd.values, run.qd.values[: len(found.time)])
    assert found.image_age.values.mean() == pytest.approx(0.028, abs=2e-3)
    assert found.attrs["held_images"] == found.attrs["held_commands"] == 0
