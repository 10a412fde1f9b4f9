"""A user's own effects on the commands of the joints."""

from dataclasses import dataclass

import numpy as np
import pytest

import robsim as rs
from robsim import examples


class Weak:
    """The joints move at a share of the commanded speed."""

    def driven(self, wanted, drive):
        return 0.8 * wanted


class Shaking:
    def driven(self, wanted, drive):
        return wanted + 0.01 * drive.normal(wanted.shape[1])


class Heavy:
    """The joints keep half of the velocity that they had."""

    def driven(self, wanted, drive):
        return 0.5 * (wanted + drive.moved)


@pytest.fixture
def experiment():
    return rs.load_scenario(examples.path("eye_in_hand")).with_(duration=2.0)


def with_effects(experiment, *effects, **more):
    return experiment.with_(actuation=rs.Actuation(effects=effects, **more))


def get_velocities(run, dt):
    """The actual velocities of the joints in each period, and the commanded ones."""
    q, qd = run.q.values, run.qd.values
    live = ~np.isnan(q[1:, 0])
    return (np.diff(q, axis=0) / dt)[live], qd[:-1][live]


def test_joints_move_as_the_effect_prescribes(experiment):
    rates, commanded = get_velocities(with_effects(experiment, Weak()).run(), experiment.dt)
    np.testing.assert_allclose(rates, 0.8 * commanded, atol=1e-13)
    assert len(rates) > 20


def test_effects_follow_one_another_and_the_lag_comes_after_them(experiment):
    rates, commanded = get_velocities(with_effects(experiment, Weak(), Weak()).run(), experiment.dt)
    np.testing.assert_allclose(rates, 0.64 * commanded, atol=1e-13)
    late = with_effects(experiment, Weak(), lag=0.05).run()
    rates, commanded = get_velocities(late, experiment.dt)
    share = 0.05 / experiment.dt * (1 - np.exp(-experiment.dt / 0.05))
    v = np.zeros(commanded.shape[1])
    for rate, qd in zip(rates, commanded, strict=True):  # v' = (0.8 qd - v) / lag, exactly
        np.testing.assert_allclose(rate, 0.8 * qd + (v - 0.8 * qd) * share, atol=1e-12)
        v = 0.8 * qd + (v - 0.8 * qd) * np.exp(-experiment.dt / 0.05)


def test_an_effect_receives_the_past_motion_of_the_joints(experiment):
    rates, commanded = get_velocities(with_effects(experiment, Heavy()).run(), experiment.dt)
    before = np.concatenate([np.zeros((1, rates.shape[1])), rates[:-1]])
    np.testing.assert_allclose(rates, 0.5 * (commanded + before), atol=1e-12)


def test_its_random_numbers_agree_with_the_run(experiment):
    starts = np.stack([experiment.start] * 4)
    runs = with_effects(experiment, Shaking()).with_(start=starts).run(chunk=3, threads=2)
    alone = with_effects(experiment, Shaking()).with_(first_run=2).run()
    steps = alone.sizes["time"]
    np.testing.assert_array_equal(runs.q.values[2, :steps], alone.q.values)
    assert len(np.unique(runs.q.values[:, 5, 0])) == 4
    rates, commanded = get_velocities(alone, experiment.dt)
    assert np.std(rates - commanded) == pytest.approx(0.01, rel=0.2)


class Stuck:
    def driven(self, wanted, drive):
        return np.zeros_like(wanted)


def test_explain_names_it(experiment):
    made = with_effects(experiment, Stuck()).with_(duration=20.0)
    causes = rs.explain(made.run(), made).causes
    assert "Stuck" in causes[0].sentence


class Flat:
    def driven(self, wanted, drive):
        return wanted[0]


class Gone:
    def driven(self, wanted, drive):
        return np.full(wanted.shape, np.nan)


@dataclass
class No:
    value: float = 1.0


@pytest.mark.parametrize(
    ("effect", "message"),
    [
        (Flat(), r"Flat.driven: expected shape \(1, 7\), got \(7,\)"),
        (Gone(), "Gone.driven: nan"),
        (No(), "effects"),
        ("sticky", "no joint effect 'sticky'"),
    ],
)
def test_an_invalid_effect_is_refused(experiment, effect, message):
    with pytest.raises(rs.errors.InputError, match=message):
        with_effects(experiment, effect).run()
