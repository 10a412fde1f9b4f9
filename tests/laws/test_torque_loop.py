"""Closed loops of torques: stored trajectories, energy, errors at rest, and outcomes."""

from dataclasses import replace

import numpy as np
import pytest
from planar_arm import CASES, PLANAR, TIMES, build_scene, build_task

import robsim as rs
from robsim.base.errors import InputError
from robsim.page.curves_and_texts import build_joint_panels

STATE = np.array([0.1, 0.3])
CONSERVATIVE = "linear", "rolled_camera", "saturated"  # models that are true


def simulate(case, dt=1e-3, duration=2.0, **settings):
    """A run of a stored case; each control period is one step of the drive."""
    model = rs.drives.DriveModel(gravity=case["share"])
    drive = rs.drives.TorqueInput(damping=PLANAR["DAMPING"], model=model)
    tasks = {key: settings.pop(key) for key in ("tolerance",) if key in settings}
    return rs.simulate(
        build_scene(case["roll"]),
        build_task(case, **tasks),
        STATE,
        dt=dt,
        duration=duration,
        actuation=rs.Actuation(drive=drive, step=dt),
        **settings,
    )


@pytest.mark.parametrize("name", CASES)
def test_a_run_is_the_stored_trajectory(name):
    """Euler's method and the held torque are of the first order: twice the half is better.

    After the extrapolation the error of the second order is left, relative to speeds of 8 rad/s.
    """
    case, found = CASES[name], []
    expected = np.hstack([case["q"], case["v"]])
    for dt in (1e-3, 5e-4):
        run, each = simulate(case, dt), round(TIMES[1] / dt)
        found.append(np.hstack([run.q.values[::each], run.qd_actual.values[::each]]))
    away = [np.abs(one - expected).max() for one in found]
    assert away[1] < 0.07
    assert away[0] / away[1] == pytest.approx(2.0, rel=0.05)
    np.testing.assert_allclose(2.0 * found[1] - found[0], expected, atol=0.003)


@pytest.mark.parametrize("name", CONSERVATIVE)
def test_the_energy_falls_in_every_period(name):
    case = CASES[name]
    run, law = simulate(case), build_task(case).law
    v, errors = run.qd_actual.values, run.error.values
    M = np.array([PLANAR["inertia"](q) for q in run.q.values])
    V = law.potential_energy(errors) + 0.5 * np.einsum("ti,tij,tj->t", v, M, v)
    assert V[0] == pytest.approx(case["energy"][0], rel=1e-12)
    assert (np.diff(V) < 0.0).all()
    lost = 1e-3 * np.cumsum(v[1:] ** 2 @ PLANAR["DAMPING"])
    np.testing.assert_allclose(V[0] - V[1:], lost, atol=0.03 * V[0])


def test_wrong_gravity_leaves_the_predicted_error():
    case = CASES["light_gravity"]
    run = simulate(case, duration=12.0)
    np.testing.assert_allclose(run.q.values[-1], case["rest"], atol=1e-8)
    np.testing.assert_allclose(run.error.values[-1], case["rest_error"], atol=1e-9)


def test_a_run_ends_at_rest_at_its_goal_or_beside_it():
    arrived = simulate(CASES["linear"], duration=12.0, tolerance=1e-3)
    assert arrived.outcome == rs.Outcome.CONVERGED
    last = int(np.isfinite(arrived.error_norm.values).sum()) - 1
    assert np.abs(arrived.qd_actual.values[last]).max() < 0.02
    beside = simulate(CASES["light_gravity"], duration=12.0, tolerance=1e-3)
    assert beside.outcome == rs.Outcome.LOCAL_MINIMUM and float(beside.end_time) < 12.0


def test_a_run_that_passes_its_goal_goes_on():
    """With little damping the arm crosses the goal at full speed."""
    case = CASES["linear"]
    made = rs.Experiment(build_scene(0.0), build_task(case, tolerance=0.02), STATE)
    drive = rs.drives.TorqueInput(damping=[0.6, 0.08])
    run = made.with_(actuation=rs.Actuation(drive=drive), dt=1e-3, duration=0.5).run()
    assert (np.abs(run.error.values).max(axis=1) < 0.02).any()
    assert run.outcome == rs.Outcome.TIME_LIMIT


def test_commands_of_a_run_are_torques():
    run = simulate(CASES["linear"], duration=0.01)
    assert run.qd.attrs["units"] == "N m" and "torques" in run.qd.attrs["long_name"]
    case, goal = CASES["linear"], PLANAR["image"](PLANAR["GOAL"], 0.0)[0]
    for q, u in zip(run.q.values, run.qd.values, strict=True):
        s, J = PLANAR["image"](q, 0.0)
        np.testing.assert_allclose(u, -case["stiffness"] * J.T @ (s - goal), rtol=1e-9)
    held = run.qd.values[-2] + PLANAR["weight"](run.q.values[-2])
    damped = held - PLANAR["DAMPING"] * run.qd_actual.values[-2]
    np.testing.assert_allclose(run.torque.values[-1], damped, rtol=1e-9)


def test_a_stiffness_and_a_saturation_vary_from_run_to_run():
    drive = rs.drives.TorqueInput(damping=PLANAR["DAMPING"])
    made = rs.Experiment(
        build_scene(0.0),
        build_task(CASES["saturated"]),
        STATE,
        actuation=rs.Actuation(drive=drive),
        dt=1e-3,
        duration=0.05,
    )
    numbers = {"task.law.stiffness": [50.0, 400.0, 90.0], "task.law.saturation": [0.2, 0.03, 0.1]}
    batch = made.vary(numbers).run()
    for i in range(3):
        alone = made.at({key: each[i] for key, each in numbers.items()}).run()
        np.testing.assert_array_equal(batch.q.values[i], alone.q.values)


def test_a_drive_of_torques_refuses_a_law_of_velocities():
    drive = rs.drives.TorqueInput(damping=1.0)
    with pytest.raises(InputError, match="TorqueInput takes torques, and the task commands"):
        rs.simulate(
            build_scene(0.0), rs.IBVS(PLANAR["GOAL"]), STATE, actuation=rs.Actuation(drive=drive)
        )
    with pytest.raises(InputError, match="law of the task commands torques, and the joints take"):
        rs.simulate(
            build_scene(0.0),
            build_task(CASES["linear"]),
            STATE,
            actuation=rs.Actuation(drive=rs.drives.VelocityLoop()),
        )


def test_torques_for_joints_without_a_drive_are_refused():
    made = rs.load_scenario(rs.examples.path("mobile_arm"))
    made = made.with_(task=rs.PBVS(law="torque"))
    drive = rs.Actuation(drive=rs.drives.TorqueInput(damping=1.0))
    with pytest.raises(InputError, match="no drive moves"):
        made.with_(actuation=drive).run()


def test_a_safety_of_velocities_is_refused_in_a_run():
    drive = rs.Actuation(drive=rs.drives.TorqueInput(damping=PLANAR["DAMPING"]))
    settings = {"actuation": drive, "dt": 1e-3, "duration": 0.01}
    scene, task = build_scene(0.0), build_task(CASES["linear"])
    with pytest.raises(InputError, match="safety: speed limits velocities"):
        rs.simulate(scene, task, STATE, safety=rs.Safety(speed=1.0), **settings)
    plain = rs.simulate(scene, task, STATE, **settings)
    watched = rs.Safety(watchdog=rs.control.Watchdog(after=1.0))
    run = rs.simulate(scene, task, STATE, safety=watched, **settings)
    np.testing.assert_array_equal(run.q.values, plain.q.values)


def test_the_controller_has_the_torques_of_the_run_and_its_rows_are_a_log():
    made = rs.load_scenario(rs.examples.path("torque_planar")).with_(duration=0.2)
    run, controller, rows = made.run(), rs.Controller(made), []
    assert controller.command_quantity == "torque"
    for pixels, q, u, t in zip(
        run.pixels.values, run.q.values, run.qd.values, run.time.values, strict=True
    ):
        command = controller.step(pixels, q, t)
        np.testing.assert_array_equal(command.torques, u)
        assert command.velocities.size == 0
        rows.append(controller.row())
    held = controller.step(None, run.q.values[-1], float(run.time[-1]) + made.dt, run=False)
    assert held.phase == "holding" and not held.torques.any()
    log = rs.logs.read_log(rows, made)
    np.testing.assert_array_equal(log.qd.values, run.qd.values)
    assert log.qd.attrs["units"] == "N m"
    notes = str(rs.explain(log, made))
    assert "are the commands of this controller" in notes and "cannot separate" not in notes


def test_a_page_shows_velocities_and_torques_of_the_joints():
    run = simulate(CASES["linear"], duration=0.02)
    panels = {panel.title: panel for panel in build_joint_panels(run)}
    assert list(panels)[:2] == ["joint velocities", "commanded torques"]
    np.testing.assert_array_equal(panels["joint velocities"].values, run.qd_actual.values)
    assert panels["joint velocities"].unit == "rad/s"
    assert panels["commanded torques"].unit == "N m"


def test_messages_of_torques_have_efforts():
    made = rs.load_scenario(rs.examples.path("torque_planar")).with_(duration=0.01)
    run = made.run()
    ros = rs.control.RosMessages(rs.Controller(made), make=lambda kind, **parts: parts)
    joints, twist = "sensor_msgs/msg/JointState", "geometry_msgs/msg/Twist"
    message = ros.command(run.qd.values[0], joints)
    np.testing.assert_array_equal(message["effort"], run.qd.values[0])
    assert message["velocity"].size == 0
    with pytest.raises(InputError, match="the law commands torques, and messages of geometry"):
        ros.command(run.qd.values[0], twist)


def weigh(arm, q):
    """The mass matrix and the gravity load of an arm, from the Jacobians of its links."""
    M = np.diag([x.joint.armature for x in arm.links if x.joint.kind == "revolute"])
    g = np.zeros(arm.nv)
    for link in arm.links:
        if link.inertial is not None:
            T, J = arm.fk(q, link.name), arm.jacobian(q, link.name)
            R = T[:3, :3]
            v, omega = J[:3] + np.cross(J[3:].T, R @ link.inertial.centre).T, R.T @ J[3:]
            M = M + link.inertial.mass * v.T @ v + omega.T @ link.inertial.tensor @ omega
            g = g + 9.81 * link.inertial.mass * v[2]
    return M, g


def build_puma(share=1.0):
    """A Puma 560 without friction and a camera in its hand, before marks at two heights."""
    arm = rs.robots.puma560()
    links = [replace(x, joint=replace(x.joint, friction=0.0, damping=0.0)) for x in arm.links]
    a, high = 0.06, 0.2
    marks = [[-a, -a, high], [a, -a, 0], [a, a, high], [-a, a, 0]]
    towers = rs.Object("towers", marks=marks, pose=rs.Pose.at(0.45, -0.15, 0.25))
    camera = rs.Camera([[500, 0, 320], [0, 500, 240], [0, 0, 1]], (640, 480))
    eye = rs.MountedCamera("camera", camera, on="puma560.flange", pose=rs.Pose.at(0, 0, 0.07))
    law = rs.laws.TorqueLaw(300.0, saturation=0.05)
    model = rs.drives.DriveModel(gravity=share)
    drive = rs.drives.TorqueInput(damping=[30, 30, 30, 5, 6, 3], model=model)
    return rs.Experiment(
        rs.Scene([replace(arm, links=links)], [towers], [eye]),
        rs.IBVS(law=law, tolerance=1e-6),
        arm.home + np.radians([4, 3, -3, 5, -6, 9]),
        actuation=rs.Actuation(drive=drive),
        dt=2e-3,
        duration=20.0,
        record=50,
    )


def test_six_joints_with_a_camera_in_the_hand_arrive_and_their_energy_falls():
    run = build_puma().run()
    assert run.outcome == rs.Outcome.CONVERGED
    assert float(run.distance_to_goal) < 1e-5
    law, arm = build_puma().task.law, build_puma().scene.robots[0]
    n = int(np.isfinite(run.error_norm.values).sum())
    q, v = run.q.values[:n], run.qd_actual.values[:n]
    kinetic = 0.5 * np.array([y @ weigh(arm, x)[0] @ y for x, y in zip(q, v, strict=True)])
    V = law.potential_energy(run.error.values[:n]) + kinetic
    assert V[0] > 5.0 and (np.diff(V) < 0.0).all()


def test_six_joints_with_wrong_gravity_rest_where_spring_and_weight_balance():
    share, made = 0.8, build_puma(0.8)
    run, arm, w = made.run(), made.scene.robots[0], made.task.law.saturation
    q, e = run.q.values[-1], run.error.values[-1]
    assert np.abs(run.qd_actual.values[-1]).max() < 1e-6
    A = np.asarray(made.task.task_jacobian(made.scene, q))
    pull = 300.0 * A.T @ (w * np.tanh(e / w))
    np.testing.assert_allclose(pull, (share - 1.0) * weigh(arm, q)[1], atol=1e-4)
    # the linear prediction at the goal, before the run
    goal = np.asarray(made.task.task_jacobian(made.scene))
    dq = np.linalg.solve(300.0 * goal.T @ goal, (share - 1.0) * weigh(arm, arm.home)[1])
    np.testing.assert_allclose(e, goal @ dq, atol=0.15 * np.abs(e).max())
    assert np.abs(e).max() > 1e-3
