"""The figures of studies show each run, share and interval at its place, and count them."""

from itertools import combinations

import matplotlib
import numpy as np
import pandas as pd
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection, QuadMesh
from matplotlib.colors import to_hex
from scipy import stats

import robsim as rs
from robsim import plot
from robsim.plot import palette
from robsim.statistics.proportions import estimate_share
from robsim.studies.sensitivity import compute_sensitivity

matplotlib.use("agg")


def make_study(n=400):
    """Return a study of two tasks on n draws: the second fails for a large angle of the start."""
    rng = np.random.default_rng(4)
    half = {"draw": np.arange(n), "start_x": rng.uniform(-1, 1, n), "start_y": rng.random(n)}
    half |= {"start_angle": rng.uniform(0, 3, n), "task.gain": rng.choice([0.5, 1.0, 2.0], n)}
    frames = []
    for task, limit in (("IBVS", 2.9), ("PBVS", 1.5)):
        frame = pd.DataFrame({**half, "task": task})
        arrived = frame["start_angle"] < limit
        frame["outcome"] = np.where(arrived, "CONVERGED", "OUT_OF_IMAGE")
        frame["began"] = frame["start_x"] < 0.9
        frame["end_time"] = np.where(arrived, 2 + frame["start_angle"], 1.0)
        frame["path_length"] = rng.exponential(size=n)
        frames.append(frame)
    return pd.concat(frames, ignore_index=True)


TABLE = make_study()
BEGAN = TABLE[TABLE["began"]]


def dots(axes):
    """Return the dots of axes; first the starts that could not begin, if there are any."""
    return [each for each in axes.collections if isinstance(each, PathCollection)]


def texts(artist):
    return [text.get_text() for text in artist.get_texts()]


class Study:
    """A study for figures that read its table."""

    table = TABLE


@pytest.mark.parametrize("given", [TABLE, Study()])
def test_every_run_is_a_dot_in_the_colour_of_its_outcome(given):
    figure = plot.study(given, "start_x", "start_angle")
    apart, shown = dots(figure.axes[0])
    assert len(apart.get_offsets()) == (~TABLE["began"]).sum()
    assert not apart.get_facecolors().size  # hollow
    at = shown.get_offsets()
    expected = np.stack([BEGAN["start_x"], np.degrees(BEGAN["start_angle"])], axis=1)
    np.testing.assert_allclose(at[np.lexsort(at.T)], expected[np.lexsort(expected.T)])
    colors, counts = np.unique([to_hex(c) for c in shown.get_facecolors()], return_counts=True)
    ends = BEGAN["outcome"].value_counts()
    wanted = {palette.OUTCOMES[rs.Outcome[end]][0]: count for end, count in ends.items()}
    assert dict(zip(colors, counts, strict=True)) == wanted
    assert texts(figure.axes[0].get_legend()) == [
        f"converged ({ends['CONVERGED']})",
        f"out of image ({ends['OUT_OF_IMAGE']})",
        f"could not begin ({(~TABLE['began']).sum()})",
    ]
    assert figure.axes[0].get_ylabel() == "angle of the start to the goal (deg)"
    assert figure.axes[0].get_title() == "800 runs"


def test_dots_can_have_the_colours_of_a_number_or_of_a_choice():
    axes, bar = plot.study(TABLE, "start_x", "end_time", color="start_angle").axes
    shown = dots(axes)[1]
    at = dict(zip(BEGAN["start_x"], np.degrees(BEGAN["start_angle"]), strict=True))
    wanted = [at[x] for x in shown.get_offsets()[:, 0]]
    np.testing.assert_array_equal(shown.get_array(), wanted)
    assert bar.get_ylabel() == "angle of the start to the goal (deg)"
    [axes] = plot.study(TABLE, "start_x", "end_time", color="task").axes
    assert texts(axes.get_legend())[:2] == [
        f"IBVS ({len(BEGAN) // 2})",
        f"PBVS ({len(BEGAN) // 2})",
    ]
    assert {to_hex(c) for c in dots(axes)[1].get_facecolors()} == {
        palette.cycle_color(0),
        palette.cycle_color(1),
    }


def test_of_very_many_runs_a_fair_sample_is_drawn_and_that_is_reported():
    many = pd.concat([TABLE] * 150, ignore_index=True)
    axes = plot.study(many, "start_x", "start_y").axes[0]
    assert len(dots(axes)[1].get_offsets()) == 100_000
    apart = 150 * int((~TABLE["began"]).sum())
    assert axes.get_title() == f"{100_000 + apart:,} of 120,000 runs drawn".replace(",", " ")
    arrived = (BEGAN["outcome"] == "CONVERGED").sum() * 150
    assert texts(axes.get_legend())[0] == f"converged ({arrived:,})".replace(",", " ")


def test_a_basin_is_the_darker_the_longer_it_took_and_has_a_panel_for_each_choice():
    figure = plot.study_basin(TABLE, by="task")
    first, second, bar = figure.axes
    assert [first.get_title(), second.get_title()] == ["IBVS", "PBVS"]
    assert first.get_aspect() == 1 and bar.get_ylabel() == "time to converge (s)"
    time = BEGAN[BEGAN["outcome"] == "CONVERGED"]["end_time"]
    np.testing.assert_allclose(bar.get_ylim(), (time.min(), time.max()))
    shown = dots(first)[1]
    angle = dict(zip(BEGAN["start_x"], BEGAN["start_angle"], strict=True))
    angles = np.array([angle[x] for x in shown.get_offsets()[:, 0]])
    bright = shown.get_facecolors()[:, :3].sum(axis=1)
    order = np.argsort(angles[angles < 2.9])
    assert (np.diff(bright[angles < 2.9][order]) <= 0).all()
    failed = {to_hex(c) for c in shown.get_facecolors()[angles >= 2.9]}
    assert failed == {palette.OUTCOMES[rs.Outcome.OUT_OF_IMAGE][0]}


def test_shares_are_drawn_with_the_interval_of_wilson_and_their_counts():
    axes = plot.study_success(TABLE, "task.gain", by="task").axes[0]
    assert [label.get_text() for label in axes.get_xticklabels()] == ["0.5", "1", "2"]
    assert texts(axes.get_legend()) == ["IBVS", "PBVS"]
    for container, task in zip(axes.containers, ("IBVS", "PBVS"), strict=True):
        line, _, [bars] = container
        for i, gain in enumerate((0.5, 1.0, 2.0)):
            mine = BEGAN[(BEGAN["task"] == task) & (BEGAN["task.gain"] == gain)]
            found = estimate_share(int((mine["outcome"] == "CONVERGED").sum()), len(mine))
            assert line.get_ydata()[i] == pytest.approx(100 * found.value)
            ends = bars.get_segments()[i][:, 1]
            np.testing.assert_allclose(ends, [100 * found.low, 100 * found.high], atol=1e-9)
    counts = BEGAN.groupby(["task", "task.gain"]).size().astype(str).tolist()
    assert [text.get_text().removeprefix("n ") for text in axes.texts] == counts


def test_a_number_is_cut_into_bins_of_as_many_runs():
    axes = plot.study_success(TABLE, "start_angle", bins=4).axes[0]
    [line] = axes.lines
    edges = np.quantile(np.degrees(BEGAN["start_angle"]), np.linspace(0, 1, 5))
    assert ((edges[:-1] < line.get_xdata()) & (line.get_xdata() < edges[1:])).all()
    counts = [int(text.get_text().removeprefix("n ")) for text in axes.texts]
    assert sum(counts) == len(BEGAN) and np.ptp(counts) <= 2
    arrived = (BEGAN["outcome"] == "CONVERGED").to_numpy()
    low = arrived[np.degrees(BEGAN["start_angle"]) < edges[1]].mean()
    assert line.get_ydata()[0] == pytest.approx(100 * low)
    assert axes.get_title() == f"{len(BEGAN)} runs that began; {800 - len(BEGAN)} could not begin"


def test_a_map_has_a_share_for_each_cell_and_nothing_where_nothing_ran():
    table = TABLE[(TABLE["start_x"] > 0) | (TABLE["start_y"] > 0.5)]
    axes, bar = plot.study_map(table, "start_x", "start_y", bins=2).axes
    [mesh] = [each for each in axes.collections if isinstance(each, QuadMesh)]
    shown = mesh.get_array()
    began = table[table["began"]]
    edges = began["start_x"].min(), began["start_x"].max(), began["start_y"].min()
    right = began["start_x"] >= (edges[0] + edges[1]) / 2
    up = began["start_y"] >= (edges[2] + began["start_y"].max()) / 2
    for i, row in enumerate((~up, up)):
        for j, column in enumerate((~right, right)):
            cell = (began["outcome"] == "CONVERGED")[row & column]
            assert shown.mask[i, j] == (not len(cell))
            assert shown.mask[i, j] or shown[i, j] == pytest.approx(100 * cell.mean())
    assert shown.mask[0, 0] and not shown.mask[0, 1]
    assert axes.texts[0].get_text().split("\n")[2] == f"n {(~up & right).sum()}"
    assert bar.get_ylabel() == "converged (%)"
    corner = TABLE[(TABLE["start_x"] > 0) == (TABLE["start_y"] > 0.5)]
    axes = plot.study_map(corner, "start_x", "start_y", bins=20).axes[0]
    assert not axes.texts and axes.collections[0].get_array().mask[0, -1]


def test_the_second_map_has_half_the_width_of_the_interval():
    left, right = plot.study_map(TABLE, "start_x", "start_y", bins=9).axes[:2]
    share_, half = (axes.collections[0].get_array() for axes in (left, right))
    assert half.max() <= 50 and (half.mask == share_.mask).all()
    one = plot.study_map(TABLE, "task", "start_y", bins=9).axes[1].collections[0].get_array()
    began = BEGAN[BEGAN["task"] == "IBVS"]
    edges = np.linspace(BEGAN["start_y"].min(), BEGAN["start_y"].max(), 10)
    cell = began[began["start_y"] < edges[1]]
    found = estimate_share(int((cell["outcome"] == "CONVERGED").sum()), len(cell))
    assert one[0, 0] == pytest.approx(50 * (found.high - found.low))


def test_a_distribution_rises_to_all_runs_and_has_its_median_at_the_half():
    figure = plot.study_distributions(TABLE, by="task")
    time, path = figure.axes
    assert (time.get_xlabel(), path.get_xlabel()) == ("time at the end (s)", "camera path (m)")
    arrived = BEGAN[BEGAN["outcome"] == "CONVERGED"]
    for line, task in zip(time.lines, ("IBVS", "PBVS"), strict=True):
        values = np.sort(arrived[arrived["task"] == task]["end_time"])
        np.testing.assert_array_equal(line.get_xdata()[1:], values)
        np.testing.assert_allclose(
            line.get_ydata()[1:], 100 * np.arange(1, len(values) + 1) / len(values)
        )
    assert time.get_title(loc="right") == f"n {len(arrived)}"
    counts = arrived.groupby("task").size()
    assert texts(figure.legends[0]) == [f"{task} ({counts[task]})" for task in ("IBVS", "PBVS")]
    every = plot.study_distributions(TABLE, ["path_length"], among="began").axes[0]
    assert every.get_title(loc="right") == f"n {len(BEGAN)}"


def find_overlaps(axes, renderer):
    """Pairs of texts below a panel that overlap by more than a pixel."""
    ticks = [t for t in axes.get_xticklabels(which="both") if t.get_text()]
    boxes = [(each.get_text(), each.get_window_extent(renderer)) for each in ticks]
    boxes = [
        (text, box) for text, box in boxes if axes.bbox.x0 <= box.x1 and box.x0 <= axes.bbox.x1
    ]
    for each in (axes.xaxis.get_offset_text(), axes.xaxis.label):
        if each.get_text() and each.get_visible():
            boxes.append((each.get_text(), each.get_window_extent(renderer)))
    return [
        (a, b)
        for (a, x), (b, y) in combinations(boxes, 2)
        if min(x.x1, y.x1) - max(x.x0, y.x0) > 1 and min(x.y1, y.y1) - max(x.y0, y.y0) > 1
    ]


@pytest.mark.parametrize(
    "size", [1e-5, 3e4, *(pytest.param(size, marks=pytest.mark.full) for size in (2.7e-4, 1.0))]
)
def test_ticks_of_small_and_of_narrow_distributions_do_not_overlap(size):
    """Before, 0.00002 met 0.00004, and the power of ten met the label."""
    u = np.random.default_rng(1).random(300)
    columns = {
        "distance_to_goal": size * u,
        "path_length": size * (1 - 1e-3 * u),
        "error_norm": size * (1 + 0.2 * u),
        "end_time": size * np.exp(2 * stats.norm.ppf(u)),
    }
    figure = plot.study_distributions(
        pd.DataFrame({**columns, "outcome": "CONVERGED", "began": True})
    )
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    for axes in figure.axes:
        assert find_overlaps(axes, canvas.get_renderer()) == []
    [axes] = [each for each in figure.axes if each.get_xlabel().startswith("distance")]
    unit = {1e-5: "$10^{-5}$ m", 3e4: "$10^{4}$ m", 1.0: "m", 2.7e-4: "$10^{-4}$ m"}[size]
    assert axes.get_xlabel() == f"distance to the goal at the end ({unit})"


def test_bars_are_the_correlation_ratios_with_their_intervals():
    found = compute_sensitivity(TABLE)
    axes = plot.study_sensitivity(TABLE).axes[0]
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names == [each.name for each in found.effects] and names[0] == "start_angle"
    widths = [patch.get_width() for patch in axes.patches]
    assert widths == [each.eta.value for each in found.effects]
    assert to_hex(axes.patches[0].get_facecolor()) == palette.VERMILLION  # falls
    again = plot.study_sensitivity(found).axes[0]
    assert [text.get_text() for text in again.texts] == [text.get_text() for text in axes.texts]


@pytest.mark.parametrize(
    "draw",
    [
        lambda axes: plot.study(TABLE, "start_x", "start_y", axes=axes, title="mine"),
        lambda axes: plot.study_success(TABLE, "task", axes=axes, title="mine"),
        lambda axes: plot.study_sensitivity(TABLE, axes=axes, title="mine"),
    ],
)
def test_a_figure_is_drawn_into_the_axes_of_the_user(draw):
    figure = matplotlib.figure.Figure()
    axes = figure.add_subplot()
    assert draw(axes) is figure and axes.get_title() == "mine"


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (lambda t: plot.study(t, "start_w", "start_y"), "x: no column 'start_w'; did you mean"),
        (lambda t: plot.study(t, "task", "start_y"), "column 'task': expected numbers"),
        (lambda t: plot.study(t, "start_x", "start_y", color=3), "color: no column 3"),
        (lambda t: plot.study(t.assign(began=False), "start_x", "start_y"), "800 runs could begin"),
        (lambda t: plot.study(t.assign(start_x=np.nan), "start_x", "start_y"), "no run has both"),
        (lambda t: plot.study_basin(t.drop(columns="start_x")), "x: no column 'start_x'"),
        (lambda t: plot.study_basin(t, by="start_y"), "has 400 different values; expected a"),
        (lambda t: plot.study_success(t.assign(task="IBVS"), "task"), "one value only, IBVS"),
        (lambda t: plot.study_success(t, "task", bins=1), "bins must be a whole number"),
        (lambda t: plot.study_map(t, "task", "task"), "two columns, got 'task' twice"),
        (lambda t: plot.study_map(t, "task", "start_x", bins=1000), "bins must be below 61"),
        (lambda t: plot.study_distributions(t, "outcome"), "column 'outcome': expected numbers"),
        (lambda t: plot.study_distributions(t, []), "measures: expected names of columns"),
        (lambda t: plot.study_distributions(t.assign(end_time=1, path_length=1)), "no measure"),
        (lambda t: plot.study_sensitivity(5), "expected a study or its table"),
    ],
)
def test_a_figure_that_cannot_be_drawn_is_reported(draw, message):
    with pytest.raises(rs.errors.InputError, match=message):
        draw(TABLE)
