"""A cell without its controller: with the controller's commands it moves as the simulation."""

import numpy as np
import pytest

import robsim as rs
from robsim.control import Controller, Marks

FEW = ("eye_in_hand", "slow_camera", "joint_lag", "velocity_loop", "unicycle_docking")
NAMES = [
    pytest.param(name, marks=[pytest.mark.full] * (name not in FEW))
    for name in rs.examples.names()
    if not name.startswith("inspection")
]
IMPERFECT = {
    "dropped": 0.3,
    "noise": 0.4,
    "latency": 0.07,
    "period": 0.08,
    "quantisation": 0.25,
    "occlusions": [rs.imperfections.Occlusion([0], 0.2, 0.6)],
}


def drive(experiment, steps, begin=3.0):
    """Return the coordinates (k, nq) of a cell that the controller of an experiment drives."""
    controller, cell, q = Controller(experiment), experiment.cell(), []
    pictured = controller.pictured_cameras
    for _ in range(steps):
        now = cell.now
        marks = Marks(now.pixels, begin + now.image_time) if now.arrived and not pictured else None
        pictures = {name: now.pictures[name] for name in pictured if name in now.pictures}
        command = controller.step(marks, now.measured, begin + now.time, images=pictures or None)
        q.append(now.q)
        cell.advance(command.torques if command.torques.size else command.velocities)
    return np.array(q)


@pytest.mark.parametrize("name", NAMES)
def test_the_controller_drives_the_cell_as_the_run(name):
    experiment = rs.load_scenario(rs.examples.path(name))
    q = experiment.run().q.values
    steps = min(int(np.isfinite(q[:, 0]).sum()), 60)
    np.testing.assert_array_equal(drive(experiment, steps), q[:steps])


def test_imperfect_images_arrive_as_in_the_run():
    experiment = rs.load_scenario(rs.examples.path("eye_in_hand"))
    experiment = experiment.with_(sensing=rs.Sensing(**IMPERFECT), duration=3.0, hold=True)
    q = experiment.run().q.values
    np.testing.assert_allclose(drive(experiment, len(q)), q, rtol=0, atol=1e-12)


def test_an_instant_has_the_time_of_its_image_and_a_reset_returns_to_the_start():
    experiment = rs.load_scenario(rs.examples.path("eye_in_hand"))
    cell = experiment.with_(sensing=rs.Sensing(period=0.12, latency=0.05)).cell()
    still, start = np.zeros(cell.columns.size), cell.now
    found = [(now.arrived, round(now.image_time, 9)) for now in (cell.advance(still) for _ in "ab")]
    assert found == [(False, -0.05), (False, -0.05)]
    now = cell.advance(still + 0.1)
    assert now.arrived and now.image_time == pytest.approx(0.07, abs=1e-12)
    moved = cell.advance(still)
    np.testing.assert_allclose(moved.q - start.q, 0.1 * cell.dt, atol=1e-12)
    np.testing.assert_array_equal(cell.reset().q, start.q)
    assert (cell.now.step, cell.now.time) == (0, 0.0)


def test_marks_outside_of_the_image_are_nan_and_joints_pass_their_limits():
    cell = rs.load_scenario(rs.examples.path("eye_in_hand")).cell()
    turn = np.zeros(cell.columns.size)
    turn[0] = 5.0
    now, start = cell.now, cell.now.q[0]
    while np.isfinite(now.pixels["camera", "plate"]).any() and now.step < 100:
        now = cell.advance(turn)
    assert now.step < 100
    for _ in range(100):
        now = cell.advance(turn)
    assert now.q[0] == pytest.approx(start + 5.0 * now.time) and now.q[0] > 3.0


def test_wrong_commands_and_missions_are_refused():
    experiment = rs.load_scenario(rs.examples.path("eye_in_hand"))
    cell = experiment.cell()
    for wrong in ([1.0], [np.nan] * cell.columns.size, "stop"):
        with pytest.raises(rs.errors.InputError, match="qd"):
            cell.advance(wrong)
    np.testing.assert_array_equal(cell.now.q, experiment.start)
    with pytest.raises(rs.errors.InputError, match="one start is needed"):
        experiment.with_(start=np.array([experiment.scene.home] * 2)).cell()
    mission = rs.load_scenario(rs.examples.path("inspection_a"))
    with pytest.raises(rs.errors.InputError, match="take the experiment of a phase"):
        mission.cell()
