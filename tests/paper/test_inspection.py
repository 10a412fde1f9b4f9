"""The inspection robots keep their promises at every instant of their examples (figs 11, 12)."""

from types import SimpleNamespace

import numpy as np
import pytest

import robsim as rs

ARMS = {"inspection_a": ("rear", "front"), "inspection_b": ("rear", "middle", "front")}
HOLD = {"inspection_a": 1, "inspection_b": 2}  # wheels, at least
PHASES = {"inspection_a": 14, "inspection_b": 24}
APART = {"inspection_a": 0.18, "inspection_b": 0.26}  # from the obstacle to a wheel that opens
THINGS = {"inspection_a": ["spacer"], "inspection_b": ["clamp", "string"]}
RADIUS, CLOSED, DT = 0.05, 1e-9, 0.04


@pytest.fixture(scope="module", params=ARMS)
def done(request):
    """The motion of the robot of a scenario file from its first to its last instant."""
    experiment = rs.load_scenario(rs.examples.path(request.param))
    scene, mission = experiment.scene, experiment.run()
    robot = scene.robot()
    q, qd = mission.run.q.values, mission.run.qd.values
    wheres = np.array([robot.coordinate_names.index(f"{arm}_lift") for arm in ARMS[robot.name]])
    frames = robot.frames(q)
    return SimpleNamespace(
        experiment=experiment,
        scene=scene,
        robot=robot,
        mission=mission,
        legs=mission.legs,
        q=q,
        qd=qd,
        arms=ARMS[robot.name],
        lift=q[:, wheres],
        swing=q[:, wheres - 1],
        frame={link.name: frames[:, i] for i, link in enumerate(robot.links)},
        cable=robot.links[1].joint.curve,
    )


def closed(done):
    """(instants, arms): which wheels hold."""
    return (np.abs(done.lift) <= CLOSED) & (np.abs(done.swing) <= CLOSED)


def reached(done, what):
    return done.frame[what][:, :3, 3]


def test_every_phase_converges(done):
    assert done.mission.succeeded and len(done.legs) == PHASES[done.robot.name]
    assert {leg.outcome for leg in done.legs} == {rs.Outcome.CONVERGED}
    assert all(leg.run.attrs["dt"] == DT for leg in done.legs)


def test_enough_wheels_hold_and_every_wheel_is_lifted_once(done):
    holds = closed(done)
    assert holds.sum(axis=1).min() == HOLD[done.robot.name]
    np.testing.assert_array_equal((np.diff(holds.astype(int), axis=0) == -1).sum(axis=0), 1)
    assert holds[0].all() and holds[-1].all()


def test_a_wheel_that_holds_touches_the_cable(done):
    for arm, holds in zip(done.arms, closed(done).T, strict=True):
        centre = reached(done, f"{arm}_wheel")[holds]
        away = done.cable.nearest(centre[:, [0, 2]])[1]
        np.testing.assert_allclose(away, RADIUS, rtol=0, atol=1e-9)
        np.testing.assert_allclose(centre[:, 1], 0.0, rtol=0, atol=1e-9)


def test_its_hub_is_level_with_the_cable(done):
    for arm, holds in zip(done.arms, closed(done).T, strict=True):
        hub, rail = (done.frame[name][holds][:, :3, :3] for name in (f"{arm}_hub", arm))
        np.testing.assert_allclose(hub, rail, rtol=0, atol=1e-9)


def test_a_wheel_that_holds_rolls_without_slip(done):
    """The velocity of the point that touches is zero while the wheel holds a whole period."""
    for arm, holds in zip(done.arms, closed(done).T, strict=True):
        still = holds & np.append(holds[1:], False)
        J = done.robot.jacobian(done.q[still], f"{arm}_wheel")
        v, omega = np.split(np.einsum("tij,tj->ti", J, done.qd[still]), 2, axis=1)
        down = (reached(done, arm) - reached(done, f"{arm}_wheel"))[still]
        np.testing.assert_allclose(v + np.cross(omega, down), 0.0, rtol=0, atol=1e-12)
        assert np.abs(omega).max() == pytest.approx(0.4 / RADIUS, rel=0.02)  # and roll it does


@pytest.mark.full
def test_nothing_of_it_touches_the_obstacle(done):
    gaps = rs.kinematics.clearance(done.scene, done.q, done.robot.name, THINGS[done.robot.name])
    assert gaps.min() > 0.05


def test_a_wheel_swings_aside_only_when_it_is_clear_of_the_cable(done):
    for arm, swing in zip(done.arms, done.swing.T, strict=True):
        aside = swing > CLOSED
        parts = [f"{done.robot.name}.{arm}_{part}" for part in ("swing", "lift", "wheel")]
        assert rs.kinematics.clearance(done.scene, done.q[aside], parts, "cable").min() > 0.02


@pytest.mark.full
def test_an_arm_touches_neither_the_body_nor_another_arm(done):
    name = done.robot.name
    parts = {arm: [f"{name}.{arm}_{part}" for part in ("lift", "wheel")] for arm in done.arms}
    rest = {"body", "beam", "camera_mount"} & set(done.frame)
    for i, arm in enumerate(done.arms):
        others = [part for other in done.arms[i + 1 :] for part in parts[other]]
        others += [f"{name}.{part}" for part in rest]
        assert rs.kinematics.clearance(done.scene, done.q, parts[arm], others).min() > 0.005


def test_the_motion_is_continuous_through_all_phases(done):
    """No frame goes or turns farther in a period than the fastest part can."""
    for T in done.frame.values():
        way = np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1)
        assert way.max() < 1.05 * 0.4 * DT
        between = np.swapaxes(T[:-1, :3, :3], 1, 2) @ T[1:, :3, :3]
        cosine = (np.trace(between, axis1=1, axis2=2) - 1) / 2
        assert np.arccos(np.clip(cosine, -1, 1)).max() < 1.05 * 0.4 / RADIUS * DT


def test_the_camera_brings_it_before_the_obstacle_and_it_ends_behind(done):
    apart, thing = APART[done.robot.name], done.scene.objects[0].name
    where = done.cable.nearest(done.scene.pose(thing).position[[0, 2]])[0]
    approach = next(leg for leg in done.legs if leg.name == "approach by sight")
    front = done.robot.fk(approach.q_end, "front_wheel")[[0, 2], 3]
    assert where - done.cable.nearest(front)[0] == pytest.approx(apart, abs=3e-3)
    seen = approach.run.dropna("time", subset=["error"])
    assert abs(seen.error.values[-1, 0]) < 1e-3 < abs(seen.error.values[0, 0])
    assert (seen.pixels.values > 0).all() and (seen.pixels.values < [640, 480]).all()
    assert done.q[-1, 0] - where > apart


def test_the_body_of_three_arms_hangs_between_two_that_hold(done):
    if "body" not in done.robot.coordinate_names:
        return  # only the body of robot b shifts
    x = done.q[:, done.robot.coordinate_names.index("body")]
    stands = np.where(closed(done), [0.0, 0.6, 1.2], np.nan)
    assert (np.nanmin(stands, axis=1) + 0.1 < x).all()
    assert (x < np.nanmax(stands, axis=1) - 0.1).all()


def test_to_roll_on_with_the_arms_closed_is_caught(done):
    approach = next(leg for leg in done.legs if leg.name == "approach by sight")
    on = rs.FollowJoints(by={"rear": 0.4}, speed=0.4, acceleration=0.8)
    blind = rs.simulate(done.scene, on, approach.q_end)
    assert rs.Outcome(int(blind.outcome)) is rs.Outcome.CONVERGED  # it has no model of the obstacle
    gaps = rs.kinematics.clearance(
        done.scene, blind.q.dropna("time").values, done.robot.name, THINGS[done.robot.name]
    )
    assert gaps[0] > 0.05 and gaps.min() < -0.02


def test_it_starts_elsewhere_and_passes_all_the_same(done):
    """The phases after the approach are counted from its end."""
    moved = done.experiment.at("task.phases.roll.task.to.rear", "520 cm")
    assert moved.run().succeeded


def test_a_mission_is_repeated_from_its_own_text(done):
    again = rs.Experiment.of(done.mission).run()
    assert again.run.identical(done.mission.run)
