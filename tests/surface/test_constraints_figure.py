"""The figure of the constraints that act: each bar is compared with the multipliers of the run."""

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_hex
from page.borders import make_border_case

import robsim as rs
from robsim import plot
from robsim.plot import palette

matplotlib.use("agg")


@pytest.fixture(scope="module")
def run():
    return make_border_case().run()


def read_bars(axes, color):
    """Start and end of the bars of a colour, by the label of their row."""
    rows = [label.get_text() for label in axes.get_yticklabels()]
    found = {name: [] for name in rows}
    for bars in axes.collections:
        for path in bars.get_paths():
            (x0, y0), (x1, y1) = path.get_extents().get_points()
            if to_hex(bars.get_facecolor()[0]) == color:
                found[rows[round((y0 + y1) / 2)]].append((x0, x1))
    return found


def list_spans(time, flags):
    """Start and end of the periods with a flag, one after another."""
    spans = []
    for t in np.flatnonzero(flags):
        end = time[min(t + 1, len(time) - 1)]
        joined = spans and spans[-1][1] == time[t]
        spans[-1:] = [(spans[-1][0], end)] if joined else [*spans[-1:], (time[t], end)]
    return spans


def test_a_bar_lasts_while_a_constraint_holds(run):
    (axes,) = plot.constraints(run).axes
    bars = read_bars(axes, palette.ORANGE)
    active, time = run["active"].values > 0, run["time"].values
    names = [str(each) for each in run["constraint"].values]
    acting = {name: list_spans(time, active[:, i]) for i, name in enumerate(names)}
    acting = {name: spans for name, spans in acting.items() if spans}
    assert bars.keys() == acting.keys() and "left border for mark 1" in bars
    for name, spans in acting.items():
        np.testing.assert_allclose(bars[name], spans, atol=1e-12)
    starts = [spans[0][0] for spans in bars.values()]
    assert starts == sorted(starts)
    assert not any(read_bars(axes, palette.VERMILLION).values()) and axes.get_legend() is None


def test_a_constraint_that_gives_way_is_dark(run):
    given = run.copy(deep=True)
    slack = np.zeros_like(given["slack"].values)
    i = [str(each) for each in run["constraint"].values].index("left border for mark 1")
    slack[30:40, i] = 1.0
    given["slack"] = given["slack"].dims, slack
    (axes,) = plot.constraints(given).axes
    (span,) = read_bars(axes, palette.VERMILLION)["left border for mark 1"]
    assert span == pytest.approx((30 * 0.04, 40 * 0.04))
    words = [text.get_text() for text in axes.get_legend().get_texts()]
    assert words == ["holds the command back", "gives way"]


def test_many_constraints_are_counted_in_the_last_row(run):
    many = run.copy(deep=True)
    active = np.array(many["active"].values)
    active[10:12] = 1.0
    many["active"] = many["active"].dims, active
    (axes,) = plot.constraints(many).axes
    rows = [label.get_text() for label in axes.get_yticklabels()]
    assert len(rows) == 10 and rows[-1] == "19 more"


def test_figures_of_a_run_have_a_further_panel(run):
    scene = rs.Experiment.of(run).scene
    free = make_border_case(rs.constraints.JointSpeeds(9.0), duration=0.4).run()
    assert len(plot.velocity(free).axes) == 3
    for figure, count in ((plot.velocity(run), 4), (plot.run(run, scene), 6)):
        assert len(figure.axes) == count and figure.get_figheight() > 7.2
        assert read_bars(figure.axes[-1], palette.ORANGE)["left border for mark 1"]


def test_a_law_without_constraints_is_refused():
    plain = rs.load_scenario(rs.examples.path("visp_tutorial")).run(duration=0.4)
    with pytest.raises(rs.errors.InputError, match="the law of this run has no constraints"):
        plot.constraints(plain)
