"""A played cell and a driving node, in two processes: they reach what the simulation reaches."""

import signal

import numpy as np
import pytest
from ros_cells import CELLS, Coordinates
from ros_processes import wait_until

import robsim as rs

START = 1.0  # seconds on the clock of a stepped cell
NEAR = 5e-3  # rad and m: noise of 0.3 px moves a joint by 1e-3


@pytest.fixture(params=CELLS, ids=lambda each: each.__name__)
def cell(request, tmp_path):
    """An experiment, its file, and its coordinates (k, nq) as simulated."""
    experiment, path = request.param(), tmp_path / "cell.toml"
    path.write_text(experiment.to_toml(), encoding="utf-8")
    run = experiment.run()
    assert int(run.outcome) == rs.Outcome.CONVERGED
    q = run.q.values
    return experiment, path, q[np.isfinite(q[:, 0])]


def test_in_steps_the_joints_are_those_of_the_simulation(cell, robsim, listener):
    experiment, path, q = cell
    found = Coordinates(listener, experiment)
    play = robsim("ros2", "play", path, "--stepped")
    wait_until(found.by_time, "joints of the first instant")
    drive = robsim("ros2", "drive", path, "--stepped")
    end = START + (len(q) - 1) * experiment.dt
    wait_until(lambda: max(found.by_time(), default=0.0) > end - 1e-6, f"instant at {end} s")
    heard = {round((t - START) / experiment.dt): at for t, at in found.by_time().items()}
    steps = sorted(step for step in heard if step < len(q))
    assert len(steps) > 0.5 * len(q)
    np.testing.assert_allclose([heard[step] for step in steps], q[steps], rtol=0, atol=1e-6)
    assert drive.finish(signal.SIGINT) == 0 and play.finish(signal.SIGINT) == 0


def test_in_real_time_the_end_is_that_of_the_simulation(cell, robsim, listener):
    experiment, path, q = cell
    found = Coordinates(listener, experiment)
    play, drive = robsim("ros2", "play", path), robsim("ros2", "drive", path)
    near = lambda: np.abs(found.latest() - q[-1]).max() < NEAR  # noqa: E731
    wait_until(near, "arrival", 2 * len(q) * experiment.dt + 20.0)
    assert drive.finish(signal.SIGTERM) == 0 and play.finish(signal.SIGTERM) == 0
