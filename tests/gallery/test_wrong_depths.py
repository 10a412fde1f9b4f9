"""The gallery: depths that are wrong, all alike or each differently."""

import itertools

import numpy as np
import pytest

import robsim as rs
from robsim.features.feature import Observation


def run_of(name, *changes, **more):
    return rs.load_scenario(rs.examples.path(name), changes).run(**more)


def outcome(run):
    return rs.Outcome(int(run.outcome)).name


# depth_scale: gain 10 per second, dt 40 ms, a sideways start of 2 cm


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0, 3.0])
def test_translation_converges_at_the_factor_times_the_gain(factor):
    """Parallel to the square the loop is linear: x(k+1) = (1 - a gain dt) x(k), to rounding, and
    ln(1 - a gain dt) / dt is -a gain but for half a gain dt, which is 0.15 percent at most here.
    """
    dt, changes = 1e-4, [f"task.depth_scale={factor}"]
    x = run_of("depth_scale", *changes, dt=dt, duration=0.1).q.dropna("time").values[:, 0]
    np.testing.assert_allclose(x[1:] / x[:-1], 1 - factor * 10 * dt, rtol=1e-9)
    rate = -np.log(x[-1] / x[0]) / (dt * (len(x) - 1))
    assert rate == pytest.approx(factor * 10, rel=2e-3)


def test_the_sampled_loop_is_stable_while_a_gain_dt_is_below_two():
    """|1 - a gain dt| < 1. The bracket is tight because the loop is linear: 1 percent on each side
    shrinks 2 cm by e^(-0.02 k), and grows it as fast, over the 1500 periods of a minute.
    """
    below, at, above = (run_of("depth_scale", f"task.depth_scale={a}") for a in (4.95, 5.0, 5.05))
    assert outcome(below) == "CONVERGED"
    assert outcome(at) == "TIME_LIMIT"
    np.testing.assert_allclose(np.abs(at.q[:, 0]), 0.02, rtol=1e-9)  # to and fro for ever
    assert outcome(above) == "OUT_OF_IMAGE"


# uneven_depth: a square of half side 0.25 m, parallel at 1 m


SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
ALTERNATING = np.array([1, -1, 1, -1])


def eigenvalues(factors, slope):
    """(B, 6) of Lhat^+ L at the goal; `slope` is half side over distance."""
    Z = np.asarray(factors)
    marks = np.tile(slope * SQUARE, (len(Z), 1, 1))
    wrong, true = (
        rs.features.Points().interaction(Observation.of(marks, each, rs.Camera(np.eye(3))))
        for each in (Z, np.ones_like(Z))
    )
    return np.linalg.eigvals(np.linalg.pinv(wrong) @ true)


def limit(slope):
    return slope**2 / (1 + slope**2)


@pytest.mark.parametrize("slope", [0.1, 0.1 / 0.75, 0.25, 0.5])
@pytest.mark.parametrize("error", [0.005, 0.05, 0.15])
def test_eigenvalues_of_alternating_errors(slope, error):
    """For a square seen parallel, with q = 1 + p^2, two eigenvalues are (1 - e^2) p^2/(p^2 -+ e q):
    Lhat is singular at e = p^2/q, and one is negative beyond. The way along the axis has
    (1 - e^2)/(1 + e^2), and three are 1. (Take the components of L along 1 and s = +-1 of the
    marks in x and y: Lhat and L fall into blocks of two by two.)
    """
    found = np.sort(eigenvalues([1 + error * ALTERNATING], slope)[0].real)
    p2 = slope**2
    pair = [(1 - error**2) * p2 / (p2 + sign * error * (1 + p2)) for sign in (1, -1)]
    np.testing.assert_allclose(
        found, np.sort([1, 1, 1, (1 - error**2) / (1 + error**2), *pair]), rtol=1e-6
    )


def test_no_smaller_errors_were_found_that_destabilise_the_square():
    """All sixteen corners and 1000 random patterns are stable at 99 percent of the limit."""
    patterns = np.random.default_rng(0).uniform(-1, 1, (1000, 4))
    patterns = [*itertools.product((-1, 1), repeat=4), *patterns]
    largest = [p / np.abs(p).max() for p in np.array(patterns)]
    e = 0.99 * limit(0.25)
    assert eigenvalues([1 + e * p for p in largest], 0.25).real.min() > 0
    assert eigenvalues([1 + 1.01 * limit(0.25) * ALTERNATING], 0.25).real.min() < 0


def uneven(error):
    factors = np.round(1 + error * ALTERNATING, 6).tolist()
    return run_of("uneven_depth", f"task.depth_scale={factors}")


def test_the_loop_decays_as_the_eigenvalues_predict():
    """2 percent of the limit on each side: the fast eigenvalue is then 47, and 47 gain dt is below
    2, so that sampling is not what makes it unstable.
    """
    below, above = uneven(0.98 * limit(0.25)), uneven(1.02 * limit(0.25))
    assert outcome(below) == "CONVERGED"
    assert float(below.path_length) < 0.02
    assert outcome(above) == "LOCAL_MINIMUM"  # it leaves the goal, and comes to rest elsewhere


@pytest.mark.parametrize(("error", "away"), [(0.06, 0.093), (0.065, 0.210), (0.1, 0.487)])
def test_it_comes_to_rest_farther_away_the_larger_the_error(error, away):
    run = uneven(error)
    end = run.q_end.values[:3] - [0, 0, -1]
    assert outcome(run) == "LOCAL_MINIMUM"
    assert np.linalg.norm(end) == pytest.approx(away, rel=0.02)
