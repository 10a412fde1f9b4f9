"""Runs that follow trajectories: the same bits in any batch, chunk and thread, and reopened."""

import numpy as np
import pytest

import robsim as rs

START = np.array([0.2, 1.1, -3.0, 0.3, -0.4, 0.2])
OFFSET = np.array([0.05, -0.1, 0.08, 0.3, -0.2, 0.4])


@pytest.fixture(scope="module")
def arm():
    return rs.Scene([rs.robots.puma560()])


def followed(scene, task, q0=START, **told):
    return rs.simulate(scene, task, q0, **told)


def reached(scene, q, offset):
    """The pose of the flange at q, moved."""
    T = rs.Pose(scene.pose("puma560.flange", q).matrix)
    return rs.Pose.at(*offset[:3]) @ T @ rs.Pose.at(rotvec=offset[3:])


BATCHES = {
    "joints": lambda scene: rs.FollowJoints({"shoulder": 0.5, "forearm": -2.7}, duration=1.1),
    "limits": lambda scene: rs.FollowJoints({"shoulder": 0.5}, speed=0.5, acceleration=1.0),
    "path": lambda scene: rs.FollowPath(
        reached(scene, START, OFFSET), speed=0.1, acceleration=1, turn=0.5, turn_acceleration=1
    ),
    "gain": lambda scene: rs.FollowPath(
        reached(scene, START, OFFSET).position, mask="position", duration=1.0, gain=3.0
    ),
}


@pytest.mark.covering(1)
@pytest.mark.parametrize("name", BATCHES)
@pytest.mark.parametrize("actuation", [None, rs.Actuation(lag=0.05, encoder=1e-9)])
def test_batches_chunks_and_threads_do_not_matter(arm, name, actuation):
    starts = START + np.random.default_rng(2).uniform(-0.1, 0.1, (7, 6))
    options = {"duration": 4.0, "actuation": actuation}
    task = BATCHES[name](arm)
    run = followed(arm, task, starts, **options)
    assert len(np.unique(run.end_time)) > 1 or name == "joints" or actuation
    for changes in ({"chunk": 3, "threads": 2}, {"chunk": 1, "threads": 1}):
        again = followed(arm, task, starts, **options, **changes)
        for variable in run.variables:
            assert run[variable].values.tobytes() == again[variable].values.tobytes(), variable
    alone = followed(arm, task, starts[3], first_run=3, **options)
    for variable in alone.variables:
        row = run[variable].isel(run=3) if "run" in run[variable].dims else run[variable]
        assert alone[variable].values.tobytes() == row.values.tobytes(), variable


def test_a_run_is_saved_opened_and_replayed(arm, tmp_path):
    for make in BATCHES.values():
        run = followed(arm, make(arm), duration=0.5)
        back = rs.open_run(rs.save_run(run, tmp_path / "run.nc"))
        assert back.identical(run) and rs.replay(back).identical(run)
