"""Schemes on the same draws: exact tests, intervals that hold the truth, and clear errors."""

import csv
import io

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from robsim.errors import InputError
from robsim.statistics.paired_tests import (
    half_binomial,
    mcnemar,
    median_interval,
    paired_difference,
)
from robsim.studies.paired_comparison import compare_paired


def table(rows):
    """Return a study's table of (draw, task, outcome, end_time) rows; the outcome " " began not."""
    names = {"+": "CONVERGED", "-": "LOCAL_MINIMUM", " ": "OUT_OF_IMAGE"}
    frame = pd.DataFrame(rows, columns=["draw", "task", "outcome", "end_time"])
    frame["began"] = frame["outcome"] != " "
    frame["outcome"] = frame["outcome"].map(names)
    return frame


MIXED = table(
    [
        *[(i, "IBVS", "+", 3.0 + i / 10) for i in range(10)],
        *[(i, "PBVS", "+", 2.0) for i in range(8)],
        (8, "PBVS", "-", 30.0),
        (9, "PBVS", " ", 0.0),
        (10, "IBVS", "-", 30.0),
        (10, "PBVS", "-", 30.0),
        (11, "PBVS", "+", 1.0),
    ]
)


@pytest.mark.parametrize(
    ("first", "second", "p"),
    [
        (12, 2, 0.0129),  # Armitage and Berry 1994, "Statistical Methods", p. 127
        (1, 7, 0.0703),  # Fagerland, Lydersen and Laake 2013, doi 10.1186/1471-2288-13-91
        (0, 0, 1.0),
        (5, 5, 1.0),
    ],
)
def test_mcnemar_gives_published_numbers(first, second, p):
    assert mcnemar(first, second) == pytest.approx(p, abs=5e-5)
    assert mcnemar(second, first) == mcnemar(first, second)


@pytest.mark.parametrize(("k", "n"), [(3, 17), (40, 100), (996, 2101), (499_000, 1_000_000)])
def test_mcnemar_is_the_binomial_test_also_of_a_million_pairs(k, n):
    assert mcnemar(k, n - k) == pytest.approx(stats.binomtest(k, n).pvalue, rel=1e-11)


def test_a_probability_below_any_number_is_zero_not_nan():
    assert mcnemar(0, 1_000_000) == 0.0
    np.testing.assert_allclose(half_binomial(21), stats.binom.cdf(range(11), 21, 0.5), rtol=1e-13)


def test_the_interval_of_newcombe_gives_published_numbers():
    found = paired_difference(59, 6, 16, 80)  # Cavo et al. 2012, in the R package contingencytables
    assert found.numbers == pytest.approx((-0.0621, -0.1186, -0.0046), abs=5e-5)


def test_the_difference_of_shares_changes_sign_with_the_order_and_stays_within_one():
    one, other = paired_difference(30, 9, 4, 7, 0.9), paired_difference(30, 4, 9, 7, 0.9)
    assert (one.value, one.low, one.high) == (-other.value, -other.high, -other.low)
    assert paired_difference(0, 5, 0, 0).high == 1.0
    none = paired_difference(0, 0, 0, 0)
    assert (none.low, none.high, none.of) == (-1.0, 1.0, 0)


@pytest.mark.parametrize("chances", [(0.5, 0.2, 0.1, 0.2), (0.05, 0.25, 0.25, 0.45)])
def test_newcombe_holds_the_true_difference_at_its_level(chances):
    counts = np.random.default_rng(3).multinomial(80, chances, 2000).tolist()
    truth = chances[1] - chances[2]
    found = [paired_difference(*each) for each in counts]
    held = np.mean([each.low <= truth <= each.high for each in found])
    assert 0.93 <= held <= 0.97


def test_the_interval_of_the_median_holds_it_at_its_level_whatever_the_distribution():
    values = np.random.default_rng(5).exponential(size=(2000, 101))
    found = [median_interval(row) for row in values]
    held = np.mean([each.low <= np.log(2) <= each.high for each in found])
    assert 0.93 <= held <= 0.97
    assert median_interval(np.arange(5.0)).low == -np.inf  # too few for 95 percent
    assert median_interval(np.arange(6.0)).numbers == (2.5, 0.0, 5.0)


def test_draws_are_counted_by_who_converged_and_those_that_could_not_begin_apart():
    [pair] = compare_paired(MIXED).pairs
    assert (pair.first, pair.second) == ("IBVS", "PBVS")
    assert tuple(pair.counts) == (8, 1, 0, 1, 1, 1)
    assert pair.difference.value == pytest.approx(0.1) and pair.difference.of == 10
    assert pair.median.value == pytest.approx(1.35) and pair.median.of == 8
    assert (pair.median.low, pair.median.high) == pytest.approx((1.0, 1.7))
    assert pair.p == pair.p_holm == 1.0
    mixed = MIXED.sample(frac=1, random_state=1)
    [other] = compare_paired(mixed).pairs
    sign = 1 if other.first == "IBVS" else -1
    assert sign * other.median.value == pair.median.value


def test_several_pairs_are_corrected_as_holm_has_it():
    endings = {"a": "+" * 40, "b": "+" * 30 + "-" * 10, "c": "+" * 20 + "-" * 20}
    rows = [(i, task, end, 1.0) for task, ends in endings.items() for i, end in enumerate(ends)]
    p = {(one.first, one.second): (one.p, one.p_holm) for one in compare_paired(table(rows)).pairs}
    assert p["a", "b"] == p["b", "c"] == pytest.approx((2 * 0.5**10, 2 * 2 * 0.5**10))
    assert p["a", "c"] == pytest.approx((2 * 0.5**20, 3 * 2 * 0.5**20))


def test_it_prints_as_a_table_in_every_form():
    found = compare_paired(MIXED)
    head, row, *notes = str(found).split("\n")
    assert head.split("  ")[:1] == ["first"] and "end_time, s [95 %]" in head
    assert row.split()[:7] == ["IBVS", "PBVS", "10", "8", "1", "0", "1"]
    assert notes[-1].startswith("note: 1 draws have a run that could not begin, 1 draws lack a run")
    assert repr(found) == str(found) and "<td" in found._repr_html_()
    [line] = csv.DictReader(io.StringIO(found.csv()))
    assert line["apart"] == "1" and float(line["difference"]) == found.pairs[0].difference.value
    assert found.latex().count(r"\\") == 2 and r"end\_time" in found.latex()
    assert "end_time" not in str(compare_paired(MIXED, measure=None))


@pytest.mark.parametrize(
    ("change", "arguments", "message"),
    [
        (lambda t: 5, {}, "expected a study or its table, a DataFrame, got 5"),
        (lambda t: t.drop(columns="began"), {}, "no column 'began' in this study"),
        (lambda t: t[:0], {}, "this table has no runs"),
        (lambda t: t, {"by": "tsk"}, "no column 'tsk' in this study; did you mean 'task'"),
        (lambda t: t[t.task == "IBVS"], {}, "column 'task' has one value only, IBVS"),
        (lambda t: t, {"by": "draw"}, "compare another column"),
        (lambda t: pd.concat([t, t]), {}, "draw 0 has several runs with task IBVS"),
        (lambda t: t.assign(draw=range(len(t))), {}, "no draw has runs with two values of 'task'"),
        (lambda t: t, {"measure": "outcome"}, "column 'outcome': expected numbers"),
        (lambda t: t, {"level": 95}, "level: expected a number above 0 and below 1"),
        (lambda t: t.assign(outcome="ARRIVED"), {}, "no outcome 'ARRIVED'"),
        (lambda t: t.assign(task=[[]] * len(t)), {}, "values that are neither texts nor numbers"),
        (lambda t: t.assign(began="yes"), {}, "column 'began': expected true or false"),
        (lambda t: t.assign(task=[f"{i}" for i in range(len(t))]), {}, "expected a choice"),
    ],
)
def test_columns_that_cannot_be_compared_are_reported(change, arguments, message):
    with pytest.raises(InputError, match=message):
        compare_paired(change(MIXED), **arguments)
