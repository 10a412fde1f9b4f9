"""A legend takes at most a fifth of its figure, for any number of names of any length."""

import matplotlib
import numpy as np
import pandas as pd
import pytest

import robsim as rs
from robsim import plot
from robsim.plot.fitted_legend import shorten_name

matplotlib.use("agg")

NAMES = [
    f"a scheme with a rather long name and number {i}, as people write them" for i in range(29)
]


def legends(figure):
    return [*figure.legends, *filter(None, (axes.get_legend() for axes in figure.axes))]


def assert_small(figure):
    figure.canvas.draw()
    whole = figure.bbox.width * figure.bbox.height
    for legend in legends(figure):
        box = legend.get_window_extent()
        assert box.width * box.height <= 0.2 * whole
    assert legends(figure)


def table(count):
    names = np.resize(NAMES[:count], 400)
    random = np.random.default_rng(1)
    return pd.DataFrame(
        {
            "task": names,
            "start_x": random.normal(size=400),
            "start_y": random.normal(size=400),
            "end_time": random.uniform(1, 9, 400),
            "outcome": "CONVERGED",
            "began": True,
        }
    )


@pytest.mark.parametrize("count", [2, 7])
def test_names_of_studies(count):
    rows = table(count)
    assert_small(plot.study(rows, "start_x", "start_y", color="task"))
    assert_small(plot.study_distributions(rows, "end_time", by="task"))


@pytest.mark.full
def test_a_comparison_of_many_schemes_counts_the_names_that_are_left_out():
    one = rs.load_scenario(rs.examples.path("camera_retreat"))
    tasks = {name: rs.IBVS(one.task.goal) for name in NAMES}
    figure = plot.comparison(rs.compare(one.scene, tasks, one.start, duration=0.2))
    assert_small(figure)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts[0] == shorten_name(NAMES[0]) and len(texts) <= 30
