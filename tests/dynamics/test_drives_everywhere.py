"""Runs with drives in batches, files, replays, missions, and on the command line."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs
from robsim.cli.report import print_run_report

SERIES = "q", "qd_actual", "torque", "saturation"
VARIED = {
    "actuation.drive.bandwidth": [30.0, 80.0],
    "actuation.drive.integral_rate": [5.0, 20.0],
    "actuation.drive.model.mass": [0.8, 1.2],
    "actuation.drive.model.friction": [0.0, 1.0],
    "actuation.payloads.0.mass": [0.5, 3.0],
    "robots.panda.links.link4.inertia.mass": [2.0, 5.0],
    "robots.panda.links.link4.armature": [0.1, 2.0],
    "robots.panda.links.link4.damping": [0.1, 5.0],
    "robots.panda.links.link4.friction": [0.1, 5.0],
}


@pytest.fixture(scope="module")
def case():
    drive = rs.drives.VelocityLoop(bandwidth=60, gravity=False)
    load = rs.drives.Payload("panda.flange", 1.0)
    actuation = rs.Actuation(drive=drive, payloads=[load])
    shown = rs.load_scenario(rs.examples.path("eye_in_hand"))
    return shown.with_(actuation=actuation, duration=0.2)


def check_same_run(batch, number, run):
    for name in SERIES:
        own = batch[name].values[number][: run.sizes["time"]]
        np.testing.assert_array_equal(own, run[name].values)


@pytest.mark.parametrize("name", VARIED)
def test_a_varied_number_acts_with_the_bits_of_single_runs(case, name):
    many = case.vary({name: VARIED[name]})
    batch = many.run()
    for i, value in enumerate(VARIED[name]):
        check_same_run(batch, i, many.of_run(i).run())
        check_same_run(batch, i, case.at(name, value).run())
    first, second = batch["torque"].values
    assert np.abs(first - second).max() > 1e-3


def test_all_numbers_differ_together(case):
    many = case.vary(VARIED)
    batch = many.run()
    for i in range(2):
        check_same_run(batch, i, case.at({name: x[i] for name, x in VARIED.items()}).run())


def test_the_believed_gravity_differs_from_run_to_run(case):
    fed = case.at("actuation.drive.gravity", True)
    batch = fed.vary({"actuation.drive.model.gravity": [0.9, 1.1]}).run()
    for i, share in enumerate((0.9, 1.1)):
        check_same_run(batch, i, fed.at("actuation.drive.model.gravity", share).run())


def test_files_and_replays_keep_torques(case, tmp_path):
    run = case.run()
    rs.save_run(run, tmp_path / "run.nc")
    stored = rs.open_run(tmp_path / "run.nc")
    again = rs.replay(stored)
    for name in (*SERIES, "torque_limit"):
        for other in (stored, again):
            np.testing.assert_array_equal(other[name].values, run[name].values)
    assert stored.torque.attrs["units"] == stored.torque_limit.attrs["units"] == "N m"


def test_the_limits_are_given_for_driven_joints_alone(case):
    arm, free = case.scene.robots[0], rs.robots.free_camera()
    task = rs.FollowJoints(by={"panda.link4": 0.05}, duration=0.1)
    run = rs.simulate(rs.Scene([arm, free]), task, actuation=case.actuation, dt=0.02, duration=0.1)
    limits = run.torque_limit.values
    np.testing.assert_array_equal(limits[:7], [87] * 4 + [12] * 3)
    assert np.isnan(limits[7:]).all() and (run.torque.values[:, 7:] == 0).all()


def test_steps_yield_the_torques_of_the_run(case):
    run = case.run()
    for i, now in enumerate(case.steps()):
        np.testing.assert_array_equal(now.torque, run.torque.values[i])
        np.testing.assert_array_equal(now.saturation, run.saturation.values[i])
    plain = next(case.with_(actuation=rs.Actuation()).steps())
    assert plain.torque.size == plain.saturation.size == 0


def test_a_summary_has_the_torques_of_the_end(case):
    end = case.with_(record="summary").run()
    np.testing.assert_array_equal(end.torque.values, case.run().torque.values[-1])


def test_a_controller_on_its_own_does_not_depend_on_the_drive(case):
    now, plain = next(case.steps()), case.with_(actuation=rs.Actuation())
    commands = [rs.Controller(each).step(now.pixels, now.q, 0.0) for each in (case, plain)]
    np.testing.assert_array_equal(*(each.velocities for each in commands))


def test_phases_of_a_mission_carry_what_is_attached():
    arm = replace(rs.robots.planar_2r(), base=rs.Pose.at(rpy=(np.pi / 2, 0, 0)))
    ball = rs.shapes.Ball(0.02, mass=5.0)
    scene = rs.Scene(arm, rs.Object("cup", shapes=[ball]))
    still = rs.FollowJoints(by={"upper": 1e-4}, duration=0.1)
    phases = [
        rs.Phase("wait", still),
        rs.Phase("carry", still, attach={"cup": "planar_2r.fore"}),
        rs.Phase("leave", still, release=["cup"]),
    ]
    drive = rs.Actuation(drive=rs.drives.VelocityLoop())
    done = rs.Experiment(scene, rs.Mission(phases), [0.3, 0.4], actuation=drive).run()
    loads = [leg.run.torque.values[0] for leg in done.legs]
    assert done.succeeded
    np.testing.assert_allclose(loads[0], loads[2], rtol=1e-3)
    assert np.abs(loads[1] - loads[0]).max() > 5.0


def test_the_report_names_the_joint_nearest_to_its_limit(case, capsys, tmp_path):
    limits = [2, 9, 5, 23, 1.2, 2, 1.0]
    run = case.at("actuation.drive", rs.drives.VelocityLoop(torque_limit=limits)).run()
    print_run_report(run, tmp_path)
    lines = capsys.readouterr().out.splitlines()
    torque = next(line for line in lines if line.startswith("torque "))
    shares = np.abs(run.torque.values[1:]).max(axis=0) / limits
    name = f"link{1 + int(shares.argmax())}"
    assert (
        torque.split(maxsplit=1)[1] == f"at most {100 * shares.max():.0f} % of the limit, at {name}"
    )
    assert any(line.startswith("limited ") and line.endswith("of the time") for line in lines)
    print_run_report(case.with_(actuation=rs.Actuation()).run(), tmp_path)
    assert "torque" not in capsys.readouterr().out


@pytest.mark.parametrize(
    "more",
    [
        {"sensing": rs.Sensing(latency=0.03)},
        {"sensing": rs.Sensing(noise=0.5)},
        {"safety": rs.Safety()},
    ],
)
def test_late_images_noise_and_safety_repeat_in_batches_with_drives(case, more):
    one = case.with_(**more)
    q0 = np.array([one.scene.home + shift for shift in (0.0, 0.01)])
    many = one.with_(start=q0)
    batch = many.run()
    assert np.isfinite(batch["q_end"].values).all()
    for i in range(2):
        check_same_run(batch, i, many.of_run(i).run())


def test_a_constrained_law_bounds_the_commands_of_a_drive(case):
    law = rs.laws.ConstrainedLaw([rs.constraints.JointSpeeds(0.1)])
    run = case.at("task.law", law).run()
    assert np.abs(run.qd.values).max() == pytest.approx(0.1)
    assert np.abs(run.qd_actual.values[-1] - run.qd.values[-2]).max() < 0.01


def test_the_encoder_rounds_the_coordinates_that_a_drive_moves(case):
    drive = case.actuation.drive
    coarse = case.with_(actuation=rs.Actuation(drive=drive, encoder=0.05)).run()
    fine = case.with_(actuation=rs.Actuation(drive=drive)).run()
    assert np.abs(coarse.qd.values - fine.qd.values).max() > 1e-4
