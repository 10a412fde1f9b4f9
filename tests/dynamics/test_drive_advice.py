"""Advice for joints with drives, against simulations and closed forms."""

from dataclasses import dataclass, replace

import driven_arms
import numpy as np
import pytest

import robsim as rs
from robsim.analysis.linearisation.drive_advice import advise_drives, generate_drive_caveats
from robsim.analysis.linearisation.driven_loop import idealise_joints
from robsim.analysis.linearisation.linear_loop import LinearLoop
from robsim.analysis.linearisation.stability_limit import find_driven_limit, find_loop_limit

PERIODS, CASES, SHOWN = 900, 20, (1, 14)
BELOW, ABOVE = 0.95, 1.05  # factors of the largest gain


def random_drive(rng):
    """A drive of any kind; those that hold the weight by a model alone know the masses."""
    b, wrong = rng.uniform(20, 150), rs.drives.DriveModel(mass=rng.uniform(0.8, 1.2))
    drives = rs.drives
    return [
        lambda: drives.VelocityLoop(b, rng.uniform(1, b / 5), model=wrong),
        lambda: drives.VelocityLoop(b, 0.0),
        lambda: drives.PositionLoop(
            b * rng.uniform(0.1, 0.3), b, rng.uniform(0, b / 10), rng.choice([0, 0.5, 1.0])
        ),
        lambda: drives.GravityCompensatedPD(b / 2, rng.uniform(0.6, 1.5), model=wrong),
        lambda: drives.ComputedTorque(b / 2, rng.uniform(0.6, 1.5), model=wrong),
        lambda: drives.IndustrialServo(b, rng.uniform(1, b / 8), 0.2 * b, 0.002),
    ][rng.integers(6)]()


def random_case(i):
    """An arm with two or six joints, a drive, a period of 4 to 40 ms, and a latency."""
    rng = np.random.default_rng([i, 34])
    drive, dt = random_drive(rng), float(rng.choice([4, 6, 10, 20, 40])) / 1000
    latency = float(rng.choice([0, 0, 1, 1.5, 2])) * dt
    if i % 3 == 0:
        made = driven_arms.servo_six_joints(["puma560", "ur5e"][i % 2], drive, dt, latency)
    else:
        arm = {"masses": rng.uniform(0.5, 6, 2), "armature": rng.uniform(0.01, 0.3, 2)}
        made = driven_arms.servo(drive, dt, 2.0, latency, (1e-4, -2e-4), **arm)
    return made.with_(duration=PERIODS * dt)


def decays(experiment, gain):
    """Whether the steps of the features are smaller in the last fifth of a run than before."""
    task = replace(experiment.task, gain=gain, tolerance=1e-13)
    run = experiment.with_(task=task).run()
    if run.outcome in (rs.Outcome.UNSTABLE, rs.Outcome.DIVERGED):
        return False
    s = run.s.values
    steps = np.abs(np.diff(s[np.isfinite(s).all(axis=1)], axis=0))
    fifth = len(steps) // 5
    return steps[-fifth:].max() < max(steps[2 * fifth : 3 * fifth].max(), 1e-11)


@pytest.mark.parametrize(
    "i", [i if i in SHOWN else pytest.param(i, marks=pytest.mark.full) for i in range(CASES)]
)
def test_runs_below_the_largest_gain_settle_and_runs_above_it_do_not(i):
    experiment = random_case(i)
    largest = find_largest_gain(experiment)
    assert decays(experiment, BELOW * largest)
    assert not decays(experiment, ABOVE * largest)


def find_largest_gain(experiment):
    return 2.0 * find_loop_limit(LinearLoop.of(experiment))


def advise_only_drives(experiment):
    return advise_drives(LinearLoop.of(experiment))


def test_the_sag_of_a_velocity_loop_without_an_integral():
    experiment = driven_arms.servo(rs.drives.VelocityLoop(2000.0, 0.0, gravity=False), duration=5.0)
    run = experiment.with_(task=replace(experiment.task, tolerance=1e-12)).run()
    sag = advise_only_drives(experiment).sag
    assert sag.pixels == pytest.approx(driven_arms.FOCAL * run.error_norm.values[-1], rel=0.03)
    q = run.q_end.values - driven_arms.HOME
    arm = driven_arms.build_arm()
    weight = arm.gravity(driven_arms.HOME)
    inertia = np.diag(arm.mass_matrix(driven_arms.HOME))
    np.testing.assert_allclose(q, -weight / (2000.0 * inertia * 2.0), rtol=0.05)


@pytest.mark.parametrize(
    "drive",
    [
        rs.drives.VelocityLoop(gravity=False),
        rs.drives.VelocityLoop(integral_rate=0.0),
        rs.drives.PositionLoop(gravity=False, integral_rate=0.0),
        rs.drives.GravityCompensatedPD(model=rs.drives.DriveModel(mass=0.8)),
    ],
    ids=["integral", "compensation", "position loop", "position stiffness"],
)
def test_drives_that_hold_the_weight_do_not_sag(drive):
    advice = advise_only_drives(driven_arms.servo(drive))
    assert advice.sag.pixels == 0.0
    assert ("Sag", "none") in advice.rows()


@pytest.mark.parametrize(("friction", "offset"), [((3.0, 1.0), 0.1), ((0.5, 0.0), -0.1)])
def test_friction_holds_joints_at_the_predicted_error(friction, offset):
    drive = rs.drives.VelocityLoop(integral_rate=0.0)
    made = driven_arms.servo(drive, friction=friction, offset=(offset, offset), duration=8.0)
    run = made.with_(task=replace(made.task, tolerance=1e-12)).run()
    linear = LinearLoop.of(made)
    ends = driven_arms.FOCAL * run.error_norm.values[-1]
    assert ends == pytest.approx(advise_drives(linear).friction.pixels, rel=0.06)
    assert "Coulomb friction of 'upper'" in next(generate_drive_caveats(linear))


def test_an_integral_overcomes_friction():
    made = driven_arms.servo(rs.drives.VelocityLoop(), friction=(3.0, 1.0))
    assert advise_only_drives(made).friction.pixels == 0.0


def test_the_drive_and_the_joint_that_limit_the_gain_are_named():
    drive = rs.drives.PositionLoop(feed_forward=0.0)
    advice = rs.advise(driven_arms.servo(drive, masses=(2.0, 6.0)))
    assert advice.limited_by == "the drive PositionLoop"
    alike = driven_arms.servo(rs.drives.ComputedTorque(frequency=20.0))
    assert advise_only_drives(alike).joint == ""
    pd = advise_only_drives(driven_arms.servo(rs.drives.GravityCompensatedPD(), latency=0.02))
    assert pd.joint == "upper"
    late = rs.advise(driven_arms.servo(rs.drives.VelocityLoop(), latency=0.1))
    assert late.limited_by == "100 ms of latency"


def test_ideal_joints_have_the_loop_without_drives():
    drive = rs.drives.PositionLoop(feed_forward=0.0)
    driven = LinearLoop.of(driven_arms.servo(drive, latency=0.015))
    ideal = LinearLoop.of(driven_arms.servo(None, latency=0.015))
    loop = idealise_joints(driven.driven, driven.drives, [0, 1])
    limit = find_driven_limit(loop, driven.timing, driven.gain_dependence.rates)
    assert limit == pytest.approx(find_loop_limit(ideal), rel=1e-4)


def test_limits_of_torques_are_a_caveat():
    weight = driven_arms.build_arm().gravity(driven_arms.HOME)
    advice = rs.advise(driven_arms.servo(rs.drives.VelocityLoop(), effort=(10.0, 50.0)))
    words = f"the weight needs {10 * weight[0]:.3g} % of the limit of 'upper'"
    assert any(words in note for note in advice.notes)
    free = LinearLoop.of(driven_arms.servo(rs.drives.VelocityLoop()))
    assert list(generate_drive_caveats(free)) == []


def test_a_loop_without_rest_has_no_errors_at_rest():
    unstable = driven_arms.servo(rs.drives.IndustrialServo(), gain=120.0)
    advice = rs.advise(unstable)
    assert advice.margin < 1.0
    assert np.isnan([advice.drive.sag.pixels, advice.drive.friction.pixels]).all()
    assert "the loop does not come to rest" in str(advice)


@dataclass(frozen=True)
class Spring:
    """A user's drive with a position stiffness."""

    dead: float = 0.0

    def torque(self, state):
        push = 200.0 * state.gap + 20.0 * (state.command - state.v) + state.gravity
        return push - self.dead * np.sign(state.v)


def test_a_users_drive_is_differentiated_or_refused_by_name():
    experiment = driven_arms.servo(Spring(), offset=(1e-4, -2e-4), duration=6.0)
    largest = find_largest_gain(experiment)
    assert decays(experiment, BELOW * largest)
    assert not decays(experiment, ABOVE * largest)
    with pytest.raises(rs.errors.InputError, match="torques of Spring have no derivative"):
        rs.advise(driven_arms.servo(Spring(dead=2.0)))


def test_joints_that_are_not_commanded_move_by_reactions():
    drive = rs.drives.VelocityLoop(30.0, 2.0)
    experiment = driven_arms.servo(drive, joints=["fore"], offset=(0.0, 1e-3))
    largest = find_largest_gain(experiment)
    assert decays(experiment, BELOW * largest)
    assert not decays(experiment, ABOVE * largest)


def test_noise_with_a_stiff_drive_is_that_of_ideal_joints():
    noisy = driven_arms.servo(rs.drives.ComputedTorque(frequency=300.0), step=1e-4)
    noisy = noisy.with_(sensing=rs.Sensing(noise=0.5))
    ideal = rs.advise(noisy.with_(actuation=rs.Actuation()))
    assert rs.advise(noisy).noise.pixels == pytest.approx(ideal.noise.pixels, rel=0.02)
    assert ideal.drive is None
