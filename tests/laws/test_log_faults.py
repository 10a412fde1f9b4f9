"""`explain` of logs of a robot that RobSim did not write: the fault is named, or there is none."""

import math
from dataclasses import replace

import numpy as np
import pandas
import plant
import pytest

import robsim as rs
from robsim.analysis.log_faults.fault_choice import GAP, choose_fault
from robsim.analysis.log_faults.hypothesis import Hypothesis, fit_hypothesis
from robsim.analysis.log_faults.motion_comparison import HeldSignal


def explain_drive(made, real, drive, seed=0):
    """The explanation of a drive that is recorded as a table."""
    table = pandas.DataFrame(plant.record(made, real, drive, seed))
    return rs.explain(rs.logs.read_log(table, made), trials=False)


def drive_with(kind, seed):
    """The explanation of a drive with a fault, and whether a finding has the words for it."""
    rng = np.random.default_rng(seed)
    cell = plant.cell(in_hand=bool(rng.random() < 0.6))
    made = plant.experiment(cell, plant.start_near(rng))
    quiet = plant.Drive(noise=rng.choice([0.0, 0.3, 1.0, 2.0]), jitter=rng.choice([0.0, 0.01, 0.2]))
    real, drive, words = plant.FAULTS[kind](cell, quiet, rng)
    told = explain_drive(made, real, drive, seed)
    texts = [f"{each.about} | {each.sentence}" for each in told.causes]
    return told, any(all(word in text for word in words) for text in texts)


def healthy_drive(seed, steps=220):
    """The explanation of a drive without a fault: with noise, a clock that jitters, lost images."""
    rng = np.random.default_rng(seed)
    cell = plant.cell(in_hand=bool(rng.random() < 0.6))
    made = plant.experiment(cell, plant.start_near(rng))
    jitter, dropped = rng.choice([0.0, 1e-6, 0.01, 0.2, 0.4]), rng.choice([0.0, 0.05, 0.1, 0.2])
    drive = plant.Drive(rng.uniform(0.0, 3.0), jitter, dropped, steps=steps)
    return explain_drive(made, cell, drive, seed)


@pytest.mark.full
@pytest.mark.parametrize("kind", plant.FAULTS)
def test_a_fault_is_named_alone(kind):
    told, named = drive_with(kind, 77)
    assert named and len(told.causes) == 1, str(told)


@pytest.mark.full
def test_a_healthy_drive_has_no_finding():
    for seed in range(5):
        assert healthy_drive(100 + seed, steps=100).causes == ()


@pytest.mark.full
def test_of_26_drives_at_least_24_are_named():
    """Thirteen kinds of faults, each twice."""
    kinds = list(plant.FAULTS)
    named = [drive_with(kinds[i % len(kinds)], 500 + i)[1] for i in range(26)]
    assert sum(named) >= 24, [kinds[i % len(kinds)] for i in np.flatnonzero(~np.array(named))]


@pytest.mark.full
def test_of_15_healthy_drives_none_has_a_finding():
    found = [bool(healthy_drive(1000 + seed).causes) for seed in range(15)]
    assert not any(found), np.flatnonzero(found)


# ---- values ----


@pytest.mark.full
@pytest.mark.parametrize(("joint", "group"), [(0, "target pose"), (5, "mount")])
def test_faults_that_the_images_cannot_separate_are_one_group(joint, group):
    """An offset of the first joint turns the base, an offset of the last joint the mount."""
    cell = plant.cell()
    made = plant.experiment(cell, plant.start_near(np.random.default_rng(3)))
    drive = plant.Drive(noise=0.5, offset=np.radians(5.0) * (np.arange(6) == joint))
    (finding,) = explain_drive(made, cell, drive).causes
    assert finding.about == f"joint offset or {group}"
    assert finding.sentence.startswith("The log cannot separate 2 faults: the joint ")
    half = finding.evidence["offset_rad_half_width"]
    assert abs(finding.evidence["offset_rad"] - np.radians(5.0)) < 2 * half < 2e-3


@pytest.mark.full
def test_a_fitted_value_is_the_value_of_the_fault():
    cell = plant.cell()
    made = plant.experiment(cell, plant.start_near(np.random.default_rng(3)))
    long = replace(cell, K=cell.K * [[1.2, 1, 1], [1, 1.2, 1], [1, 1, 1]])
    (focal,) = explain_drive(made, long, plant.Drive(noise=0.3)).causes
    assert focal.evidence["factor"] == pytest.approx(1.2, abs=2e-3)
    assert focal.evidence["rms"] == pytest.approx(0.3, rel=0.1)
    assert focal.evidence["bic_gap"] > focal.evidence["next_gap"] > GAP
    assert "672 px (cameras.camera.focal)" in focal.sentence
    moved = replace(cell, place=cell.place @ plant.transform((0.03, 0.0, 0.01)))
    (target,) = explain_drive(made, moved, plant.Drive()).causes
    found = [target.evidence[name] for name in ("x_m", "y_m", "z_m", "rx_rad")]
    np.testing.assert_allclose(found, [0.03, 0.0, 0.01, 0.0], atol=1e-6)


def test_a_declared_delay_is_no_fault():
    cell = plant.cell()
    made = plant.experiment(cell, plant.start_near(np.random.default_rng(4)))
    drive = plant.Drive(image_delay=4, noise=0.3)
    (late,) = explain_drive(made, cell, drive).causes
    assert late.evidence["delay_s"] == pytest.approx(4 * plant.DT, abs=0.1 * plant.DT)
    known = made.with_(sensing=rs.Sensing(latency=4 * plant.DT))
    assert explain_drive(known, cell, drive).causes == ()


def line(about, *powers, cost=0):
    """A hypothesis of a polynomial of time."""
    t = np.linspace(0, 1, 200)[:, None]

    def predict(values):
        return sum((x * t**k for x, k in zip(values, powers, strict=True)), np.zeros_like(t))

    names = tuple(f"a{k}" for k in powers)
    starts = [(0.0,) * len(powers)]
    return Hypothesis(about, "", predict, lambda *_: about, names, starts, cost=cost)


def test_the_criterion_and_the_intervals_are_of_linear_regression():
    rng, t = np.random.default_rng(1), np.linspace(0, 1, 200)
    y = 0.5 + 0.2 * t + 0.1 * rng.standard_normal(200)
    fit = fit_hypothesis(line("line", 0, 1), y[:, None])
    A = np.stack([np.ones(200), t], axis=1)
    expected, (squares,), *_ = np.linalg.lstsq(A, y)
    np.testing.assert_allclose(fit.values, expected, atol=1e-6)
    bic = 200 * math.log(squares / 200) + 2 * math.log(200)
    assert fit.compute_criterion(200.0, 0.0) == pytest.approx(bic, abs=1e-6)
    half = 1.96 * np.sqrt(squares / 200 * np.diag(np.linalg.inv(A.T @ A)))
    np.testing.assert_allclose(fit.compute_half_widths(200.0, 0.0), half, rtol=1e-4)


def test_correlated_errors_count_as_fewer_samples():
    """Of an autoregressive series with the correlation 0.8, one in nine is independent."""
    rng, y = np.random.default_rng(2), np.zeros((200, 50))
    for k in range(1, 200):
        y[k] = 0.8 * y[k - 1] + rng.standard_normal(50)
    same = Hypothesis("no fault", "", lambda values: np.zeros((200, 50)), lambda *_: "")
    choice = choose_fault([same], y, 0.0)
    assert choice.samples == pytest.approx(10_000 / 9, rel=0.1) and not choice.has_fault
    white = choose_fault([same], rng.standard_normal((200, 50)), 0.0)
    assert white.samples == pytest.approx(10_000, rel=0.05)


def test_a_lagged_signal_is_its_integral_in_small_steps():
    rng, times, tau = np.random.default_rng(3), np.arange(20) * 0.1, np.array([0.25, 0.0])
    u, v, area, step = rng.standard_normal((20, 2)), np.zeros(2), np.zeros(2), 1e-4
    for k in range(19_000):
        now = u[int(k * step / 0.1 + 1e-9)]
        v = now + (v - now) * np.array([math.exp(-step / 0.25), 0.0])
        area += step * v
    found = HeldSignal(times, u).integrate_until(np.array([1.9]), tau)[0]
    np.testing.assert_allclose(found, area, atol=2e-4)


# ---- logs of which little is known ----


@pytest.mark.parametrize("steps", [2, 4, 12])
def test_short_logs_have_an_explanation(steps):
    cell = plant.cell()
    made = plant.experiment(cell, plant.start_near(np.random.default_rng(5)))
    told = explain_drive(made, cell, plant.Drive(steps=steps, noise=1.0))
    assert told.causes == () and "nan" not in str(told)


def test_a_robot_at_rest_has_no_finding_of_its_drives():
    cell = plant.cell()
    made = plant.experiment(cell, plant.HOME)
    told = explain_drive(made, cell, plant.Drive(steps=60))
    assert told.causes == () and "nan" not in str(told)
    turned = replace(cell, mount=cell.mount @ plant.transform(w=(0.0, 0.2, 0.0)))
    still = plant.Drive(steps=60, factor=np.zeros(6), noise=0.2)
    abouts = " ".join(each.about for each in explain_drive(made, turned, still).causes)
    assert "mount" in abouts and "drive factor" in abouts


def test_a_robot_that_is_held_has_the_commands_of_its_controller():
    cell = plant.cell()
    start = plant.start_near(np.random.default_rng(6))
    made = plant.experiment(cell, start, safety=rs.Safety(hold_to_run=True))
    controller, q, rows = rs.Controller(made), np.array(start), []
    for k in range(120):
        command = controller.step(cell.look(q), q, k * plant.DT, run=not 30 <= k < 50)
        rows.append(controller.row())
        q = q + plant.DT * command.velocities
    told = rs.explain(rs.logs.read_log(rows, made), trials=False)
    assert told.causes == (), str(told)
