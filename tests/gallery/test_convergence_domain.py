"""Gallery: from where image-based servoing of four points is trapped."""

import pytest

import robsim as rs
from robsim.studies.study_text import read_plan
from robsim.units import deg


@pytest.fixture(scope="module")
def study():
    """The starts of docs/gallery/equilibria.md, a quarter of them: the first draws are the same."""
    laws = {"L current": "current", "L mean": "mean", "L desired": "desired"}
    start = rs.starts.LookAt(distance=(0.5, 1.5), axis=(0, 0, -1), cone=60 * deg)
    one = rs.load_scenario(rs.examples.path("local_minimum"))
    return rs.study(one, 1000, seed=1, start=start, vary={"task.interaction": laws})


def test_half_of_the_starts_are_trapped_under_the_current_matrix(study):
    rows = study.counts("task.interaction").rows
    trapped = rows["L current"][2]["LOCAL_MINIMUM"]
    assert trapped.low < 0.478 < trapped.high  # the share of all 4000
    assert "LOCAL_MINIMUM" not in rows["L mean"][2] and "LOCAL_MINIMUM" not in rows["L desired"][2]
    assert rows["L mean"][2]["CONVERGED"].value > 0.997
    assert rows["L desired"][2]["OUT_OF_IMAGE"].value == pytest.approx(0.406, abs=0.05)


def test_nothing_that_the_mean_loses_is_won_by_the_current_matrix(study):
    pair = study.paired("task.interaction").pairs[0]
    assert (pair.first, pair.second) == ("L current", "L mean")
    assert pair.counts.only_first == 0 and pair.counts.only_second > 430
    assert -0.51 < pair.difference.low < -0.479 < pair.difference.high < -0.44


def test_the_trap_is_one_place(study):
    table = study.table
    stuck = table[table["outcome"] == "LOCAL_MINIMUM"]
    assert stuck["distance_to_goal"].between(0.548, 0.550).all()
    assert (stuck["angle_to_goal"] / deg).between(31.6, 31.8).all()


def test_the_shipped_study_has_the_same_starts(study):
    plan = read_plan(rs.load_scenario(rs.examples.path("local_minimum")))
    assert plan.runs == 6000 and plan.seed == 1
    assert plan.start == study.plan.start
