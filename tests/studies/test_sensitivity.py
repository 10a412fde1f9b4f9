"""Sensitivity: rank correlations and correlation ratios, their intervals, and clear errors."""

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from robsim.errors import InputError
from robsim.statistics.association import correlation_ratio, ranks, spearman
from robsim.studies.sensitivity import compute_sensitivity

RNG = np.random.default_rng(11)
X = RNG.normal(size=400)
Y = X + RNG.normal(size=400)
TIED = RNG.integers(0, 4, 400).astype(float)


def table(n=600, tasks=("IBVS",)):
    """Return a study: one number is decisive, one bends, one has no effect; and a choice."""
    rng = np.random.default_rng(2)
    drawn = {"gain": rng.random(n), "focal": rng.normal(1, 0.1, n), "noise": rng.random(n)}
    frames = []
    for i, task in enumerate(tasks):
        frame = pd.DataFrame({"run": i * n + np.arange(n), "draw": np.arange(n), **drawn})
        frame["lens"] = np.array(["short", "long", "wide"])[np.arange(n) % 3]
        frame["outcome"] = np.where(frame["gain"] < 0.7, "CONVERGED", "DIVERGED")
        frame["began"] = np.arange(n) % 20 > 0
        frame["task"] = task
        frame["distance_to_goal"] = abs(frame["focal"] - 1) + 0.01 * rng.random(n)
        frames.append(frame)
    return pd.concat(frames, ignore_index=True)


@pytest.mark.parametrize(("x", "y"), [(X, Y), (X, -np.exp(Y)), (TIED, Y), (TIED, np.sign(Y))])
def test_rank_correlations_agree_with_scipy(x, y):
    np.testing.assert_array_equal(ranks(y), stats.rankdata(y))
    assert spearman(x, y).value == pytest.approx(stats.spearmanr(x, y).statistic, abs=1e-14)


def test_the_interval_of_a_rank_correlation_agrees_with_bonett_and_wright():
    found = spearman(X, Y)
    rho, n = stats.spearmanr(X, Y).statistic, len(X)
    half = stats.norm.ppf(0.975) * np.sqrt((1 + rho**2 / 2) / (n - 3))
    ends = np.tanh([np.arctanh(rho) - half, np.arctanh(rho) + half])
    np.testing.assert_allclose((found.low, found.high), ends, rtol=1e-12)
    assert spearman(X, 3 - X).numbers == (-1.0, -1.0, -1.0)
    few = spearman(X[:4], Y[:4])
    assert (few.low, few.high, few.of) == (-1.0, 1.0, 4)


@pytest.mark.parametrize("y", [Y, np.sign(Y), TIED])
def test_the_correlation_ratio_agrees_with_kruskal_and_wallis(y):
    groups = np.arange(400) % 5
    statistic = stats.kruskal(*(y[groups == k] for k in range(5))).statistic
    raw = statistic / 399
    eta = np.sqrt(max(1 - (1 - raw) * 399 / 395, 0))
    assert correlation_ratio(groups, y).value == pytest.approx(eta, abs=1e-12)


def test_a_ratio_of_two_groups_is_a_rank_correlation_but_for_chance():
    groups = (X > 0).astype(int)
    eta, rho = correlation_ratio(groups, Y), spearman(groups.astype(float), Y)
    assert eta.value**2 == pytest.approx(1 - (1 - rho.value**2) * 399 / 398, abs=1e-12)
    assert (eta.low, eta.high) == pytest.approx((rho.low, rho.high), abs=5e-3)
    assert correlation_ratio(np.arange(40) % 4, np.arange(40.0) % 4).numbers == (1.0, 1.0, 1.0)


def falls(rng, n, slope):
    """Return a number, its bins and whether each of n runs converged, less often the larger."""
    x = rng.random(n)
    return x, np.minimum((5 * x).astype(int), 4), (rng.random(n) < 0.5 - slope * (x - 0.5)) + 0.0


@pytest.mark.full
@pytest.mark.parametrize("slope", [0.2, 0.6])
def test_the_intervals_hold_the_truth_at_their_level(slope):
    rng = np.random.default_rng(8)
    x, bins, y = falls(rng, 500_000, slope)
    rho, eta = spearman(x, y).value, correlation_ratio(bins, y).value
    held = np.zeros(2)
    for _ in range(1000):
        x, bins, y = falls(rng, 200, slope)
        a, b = spearman(x, y), correlation_ratio(bins, y)
        held += a.low <= rho <= a.high, b.low <= eta <= b.high
    assert (held >= 930).all() and (held <= 970).all(), held


def test_the_interval_of_a_number_without_effect_contains_zero():
    rng = np.random.default_rng(9)
    groups = np.arange(200) % 8
    lows = [correlation_ratio(groups, rng.random(200)).low for _ in range(300)]
    assert np.mean(np.array(lows) == 0) > 0.95


def test_the_decisive_number_comes_first_with_its_direction_and_a_bend_is_seen():
    outcome = compute_sensitivity(table())
    assert outcome.effects[0].name == "gain" and outcome.runs == 570
    assert outcome.effects[0].rho.high < -0.7 and outcome.effects[0].eta.value > 0.9
    first, *rest = compute_sensitivity(table(), "distance_to_goal").effects
    assert first.name == "focal" and first.eta.low > 0.85 and abs(first.rho.value) < 0.2
    assert all(each.eta.low < 0.15 for each in rest)
    [lens] = [each for each in rest if each.kind == "choice"]
    assert lens.groups == 3 and np.isnan(lens.rho.value) and "-" in lens.rho.text()


def test_runs_of_the_same_sample_count_once_except_for_differences_between_them():
    effects = {
        each.name: each for each in compute_sensitivity(table(tasks=("IBVS", "PBVS"))).effects
    }
    assert effects["gain"].eta.of == 570 and effects["task"].eta.of == 1140
    one = {each.name: each for each in compute_sensitivity(table()).effects}
    assert effects["gain"].rho == pytest.approx(one["gain"].rho, abs=1e-12)


def test_few_values_are_groups_and_many_are_bins_also_with_ties():
    few = table().assign(gain=lambda t: t["gain"].round(1).clip(0.2, 0.8))
    tied = table().assign(gain=lambda t: np.where(t["run"] < 580, 0.0, t["gain"]))
    assert compute_sensitivity(few, names="gain").effects[0].groups == 7
    assert compute_sensitivity(tied, names=["gain"]).effects[0].groups >= 2
    for n, bins in ((22, 2), (120, 11), (600, 46), (3000, 106)):  # 95 % of the runs begin
        assert compute_sensitivity(table(n), names=["gain"]).effects[0].groups == bins


def test_it_prints_as_a_table_in_every_form():
    found = compute_sensitivity(table())
    lines = str(found).split("\n")
    assert lines[0].split()[:2] == ["varied", "kind"] and lines[1].split()[:2] == ["gain", "number"]
    assert "converged, of 570 runs that began" in lines
    assert found.csv().startswith("varied,kind,groups,eta,eta_low,eta_high,rho,")
    assert "lens,choice,3" in found.csv() and "<td" in found._repr_html_()
    assert r"\begin{tabular}{llrrr}" in found.latex()


@pytest.mark.parametrize(
    ("change", "arguments", "message"),
    [
        (lambda t: t, {"of": "convergd"}, "no column 'convergd' in this study"),
        (lambda t: t, {"of": "lens"}, "column 'lens': expected numbers"),
        (lambda t: t, {"names": ["gian"]}, "no column 'gian' in this study; did you mean 'gain'"),
        (lambda t: t, {"names": []}, "names: expected names of columns"),
        (lambda t: t.assign(began=False), {}, "none of the 600 runs could begin"),
        (lambda t: t.assign(outcome="CONVERGED"), {}, "same result .1., independent of gain"),
        (lambda t: t.assign(outcome="DIVERGED"), {"of": "distance_to_goal"}, "among='began'"),
        (lambda t: t.assign(gain=1.0), {"names": "gain"}, "'gain' has one value only"),
        (lambda t: t.assign(lens="a"), {"names": "lens"}, "'lens' has one value only"),
        (lambda t: t[:20], {}, "expected 20 runs that count, or more, got 19"),
        (lambda t: t[["draw", "outcome", "began"]], {}, "nothing was varied"),
        (lambda t: t, {"among": "all"}, "among: expected 'converged' or 'began', got 'all'"),
        (lambda t: t, {"among": "converged"}, "is counted among the runs that began"),
    ],
)
def test_a_column_without_information_is_reported(change, arguments, message):
    with pytest.raises(InputError, match=message):
        compute_sensitivity(change(table()), **arguments)
