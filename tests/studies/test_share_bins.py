"""A basin of many starts shows shares: their squares count the runs, and few runs stay dots."""

import matplotlib
import numpy as np
import pandas as pd
import pytest
from matplotlib.collections import PathCollection, QuadMesh

from robsim import plot
from robsim.plot.studies.share_bins import FEWEST, ShareBins

matplotlib.use("agg")


def table(n):
    random = np.random.default_rng(3)
    x, y = random.normal(0, 0.1, (2, n))
    good = random.random(n) < np.exp(-20 * (x**2 + y**2))
    return pd.DataFrame(
        {
            "start_x": x,
            "start_y": y,
            "end_time": random.uniform(1, 9, n),
            "outcome": np.where(good, "CONVERGED", "LOCAL_MINIMUM"),
            "began": random.random(n) < 0.99,
        }
    )


def drawn(figure):
    axes = figure.axes[0]
    meshes = [each for each in axes.collections if isinstance(each, QuadMesh)]
    dots = [each for each in axes.collections if isinstance(each, PathCollection)]
    return meshes, sum(len(each.get_offsets()) for each in dots)


def test_a_square_has_the_share_of_its_runs():
    rows = table(20_000)
    figure = plot.study_basin(rows)
    [mesh], dots = drawn(figure)
    corners = mesh.get_coordinates()
    shown = np.ma.filled(mesh.get_array(), np.nan)
    began = rows[rows.began]
    x, y = began.start_x.values, began.start_y.values
    good = began.outcome.values == "CONVERGED"
    few = 0
    for j, i in np.ndindex(shown.shape):
        (x0, y0), (x1, y1) = corners[j, i], corners[j + 1, i + 1]
        right = (x < x1) | ((i == shown.shape[1] - 1) & (x <= x1))
        above = (y < y1) | ((j == shown.shape[0] - 1) & (y <= y1))
        inside = good[(x >= x0) & (y >= y0) & right & above]
        if len(inside) < FEWEST:
            assert np.isnan(shown[j, i])
            few += len(inside)
        else:
            assert shown[j, i] == inside.mean()
    assert dots == few + (~rows.began).sum()
    assert figure.axes[-1].get_ylabel().startswith("share converged (5 to ")


def test_few_starts_are_dots():
    meshes, dots = drawn(plot.study_basin(table(200)))
    assert meshes == [] and dots == 200


@pytest.mark.parametrize("x", [np.zeros(3000), np.r_[np.zeros(2999), 1.0]])
def test_starts_on_a_line_are_counted_once(x):
    rows = np.ones(3000, bool)
    bins = ShareBins.of((x, np.linspace(0, 1, 3000)), rows, rows)
    assert bins.counts.sum() == 3000 and np.nanmin(bins.shares) == 1.0
    assert plot.study_basin(table(3000).assign(start_x=x, began=True)).axes
