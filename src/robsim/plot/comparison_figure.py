"""Figures of a comparison: images, errors, measures and paths, or their distributions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robsim.analysis.measures import MEASURES, collect_mover_positions, compute_pixel_distances
from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.engine.outcome import Outcome
from robsim.plot import palette, run_data
from robsim.plot.canvas import figure_style, new_figure, replace_frame_by_grid
from robsim.plot.image_figure import set_image_axes as frame_image
from robsim.plot.run_data import NOTHING, has_spread

if TYPE_CHECKING:
    import xarray as xr

    from robsim.analysis.comparison import Comparison

IN_A_ROW, BELOW = 7, 4.4  # images in a row; height in inches of the panels below them
SHOWN = ("time", "image_excursion", "image_detour", "path_length", "retreat", "rotation")
EFFORTS = ("effort_angular", "effort_linear")
MARGINS = ("border_margin", "limit_margin")
_MARKERS = "osD^v<>"


def comparison(comparison: Comparison, *, size: Any = None, title: str | None = None) -> Figure:
    """Draw a comparison on one slide; each scheme keeps its colour, line and marker.

    For single runs: the image of each (asterisks are the start, squares the goal, circles the end),
    the distance of the farthest mark from its goal over time, the measures as shares of the largest
    among the schemes (hollow where the run did not converge), and the path of the camera in the two
    world axes in which it goes farthest. For batches: how the runs ended, and the distribution of
    each measure over those that converged: the median, the quartiles as a box, and 5 to 95 percent
    as whiskers. Converged runs are blue, and failures have warm colours. `size` is (width,
    height) of the figure in inches.

    >>> from robsim import IBVS, PBVS, compare, load_scenario
    >>> from robsim.files import examples
    >>> one = load_scenario(examples.path("camera_retreat"))
    >>> tasks = {"image": IBVS(one.task.goal), "pose": PBVS(one.task.goal)}
    >>> figure = comparison(compare(one.scene, tasks, one.start, duration=2))
    >>> [axes.get_title() for axes in figure.axes[:2]]
    ['image\\ntime limit after 2 s', 'pose\\ntime limit after 2 s']
    """
    if not {"runs", "data", "scenes"} <= set(dir(comparison)):
        raise InputError(
            f"expected a Comparison as compare returns it, got {format_value(comparison)}"
        )
    with figure_style():
        figure = (_draw_batches if comparison.batch else _draw_single_runs)(comparison, size)
        if title is not None:
            figure.suptitle(title)
    return figure


def style_scheme(i: int) -> dict[str, Any]:
    """Return the colour, line style and end marker of the i-th scheme."""
    line, marker = palette.LINES[i % len(palette.LINES)], _MARKERS[i % len(_MARKERS)]
    color = {"color": palette.cycle_color(i), "linewidth": 1.8}
    return {**color, "linestyle": line, "marker": marker, "markevery": [-1], "markersize": 6}


# ---- single runs ----


def _draw_single_runs(found: Comparison, size: Any) -> Figure:
    rows = -(-len(found.names) // IN_A_ROW)
    columns = -(-len(found.names) // rows)
    height = rows * (2.8 if columns < 4 else 2.0)
    figure = new_figure(12.8, height + BELOW, size)
    figure.set_layout_engine("constrained", h_pad=0.08, w_pad=0.08)
    grid = figure.add_gridspec(2, 1, height_ratios=(height, BELOW))
    _draw_scheme_images(figure, grid[0].subgridspec(rows, columns), found)
    below = grid[1].subgridspec(1, 3, width_ratios=(1, 1.15, 1))
    for i, draw in enumerate((_draw_scheme_errors, _draw_measures, _draw_camera_paths)):
        draw(figure.add_subplot(below[i]), found)
    names = figure.axes[len(found.names)].get_legend_handles_labels()
    figure.legend(*names, loc="outside lower center", ncols=columns, frameon=False)
    return figure


def _draw_scheme_images(figure: Figure, grid: Any, found: Comparison) -> None:
    """Draw the image of each run; all images of one camera have the same limits."""
    places: dict[tuple[Any, ...], list[Axes]] = {}
    for i, (name, run) in enumerate(found.runs.items()):
        axes, one = (
            figure.add_subplot(grid[divmod(i, grid.ncols)]),
            run_data.extract_single_run(run),
        )
        view = run_data.select_camera_view(one, None)
        _draw_scheme_image(axes, view, palette.cycle_color(i))
        ended = int(run["outcome"]) == Outcome.CONVERGED
        axes.set_title(name if ended else f"{name}\n{run_data.describe_ending(one)}", fontsize=9)
        places.setdefault((*np.ravel(view.attrs["image_size"]),), []).append(axes)
    for alike in places.values():
        low = np.min([(axes.get_xlim()[0], axes.get_ylim()[1]) for axes in alike], axis=0)
        high = np.max([(axes.get_xlim()[1], axes.get_ylim()[0]) for axes in alike], axis=0)
        for axes in alike:
            axes.set(xlim=(low[0], high[0]), ylim=(high[1], low[1]))


def _draw_scheme_image(axes: Axes, view: xr.Dataset, color: str) -> None:
    """Draw the paths of the marks of one run in the image of its first camera."""
    way, goal = view["pixels"].values, view["pixels_goal"].values
    for n in range(way.shape[1]):
        axes.plot(*way[:, n].T, color=color, linewidth=1.3)
    dots: dict[str, Any] = {"linestyle": "none", "zorder": 3}
    axes.plot(*way[0].T, color=palette.BLACK, marker=palette.ASTERISK, markersize=6, **dots)
    axes.plot(*way[-1].T, color=color, marker="o", markersize=4, **dots)
    axes.plot(*goal.T, color=palette.GOAL, marker="s", markersize=8, fillstyle="none", **dots)
    seen = np.concatenate([way.reshape(-1, 2), goal])
    frame_image(axes, seen, view.attrs["image_size"], None)
    axes.set(xticks=[], yticks=[], xlabel="", ylabel="")


def _draw_scheme_errors(axes: Axes, found: Comparison) -> None:
    """Draw the farthest mark's distance from its goal, or the error without a goal image."""
    seen = all(np.isfinite(run["pixels_goal"]).all() for run in found.runs.values())
    low, high = np.inf, 0.0
    for i, (name, run) in enumerate(found.runs.items()):
        one = run_data.extract_single_run(run)
        norm = one["error_norm"].values
        values = compute_pixel_distances(one)[0].max(axis=1) if seen else norm / (norm[0] or 1.0)
        axes.plot(one["time"].values, values, label=name, **style_scheme(i))
        shown = values[(values > 0) & np.isfinite(values)]
        low, high = min([low, *shown]), max([high, *shown])
    label = "farthest mark from its goal (px)" if seen else "error / error at the start"
    axes.set(xlabel="time (s)", ylabel=label)
    if high > 0:
        axes.set(yscale="log", ylim=(max(low, 1e-6 * high) / 2, 2 * high))
    axes.set_xlim(left=0)
    replace_frame_by_grid(axes)


def normalise_measures(found: Comparison) -> dict[str, tuple[float, Array]]:
    """Return {measure: (largest value, shares of it (schemes,))} of measures to minimise."""
    shares = {}
    for key in (*SHOWN, *EFFORTS):
        values = found.data[key].values
        largest = float(np.nanmax([*values, 0.0]))
        if np.isfinite(largest) and largest > NOTHING:
            shares[key] = largest, values / largest
    return shares


def _draw_measures(axes: Axes, found: Comparison) -> None:
    """Draw each measure as a row with one dot for each scheme."""
    shares, count = normalise_measures(found), len(found.names)
    ended = found.data["outcome"].values == Outcome.CONVERGED
    for i in range(count):
        rows = np.arange(len(shares)) + 0.6 * ((i + 0.5) / count - 0.5)
        values = [share[i] for _, share in shares.values()]
        face = palette.cycle_color(i) if ended[i] else "none"
        own = style_scheme(i) | {"markerfacecolor": face, "linestyle": "none", "markevery": None}
        axes.plot(values, rows, **own)
    names = [
        f"{MEASURES[key].label}\n1 = {largest:.3g} {_format_measure_unit(key)}".rstrip()
        for key, (largest, _) in shares.items()
    ]
    axes.set(yticks=range(len(shares)), yticklabels=names, ylim=(len(shares) - 0.5, -0.5))
    axes.set(xlim=(-0.04, 1.06), xlabel="share of the largest (less is better)")
    for edge in np.arange(1, len(shares)) - 0.5:
        axes.axhline(edge, color=palette.LIGHT_GREY, linewidth=0.6)
    replace_frame_by_grid(axes, "x")
    if not ended.all():
        axes.set_title("hollow: did not converge", loc="right", fontsize=9)


def _format_measure_unit(key: str) -> str:
    """Return the unit of a measure as it is written in a figure; "" for none."""
    unit = MEASURES[key].unit.replace("^2", "²")
    return "" if unit == "1" else unit


def _draw_camera_paths(axes: Axes, found: Comparison) -> None:
    """Draw the camera paths in the two world axes of largest extent."""
    runs = found.runs.items()
    ways = [
        collect_mover_positions(run_data.extract_single_run(run), found.scenes[name])[0]
        for name, run in runs
    ]
    spans = np.ptp(np.concatenate(ways), axis=0)
    across, up = sorted(np.argsort(-spans, kind="stable")[:2])
    for i, way in enumerate(ways):
        axes.plot(way[:, across], way[:, up], **style_scheme(i))
    starts = np.unique([way[0, [across, up]] for way in ways], axis=0)
    black: dict[str, Any] = {"color": palette.BLACK, "linestyle": "none"}
    axes.plot(*starts.T, marker=palette.ASTERISK, markersize=9, label="start", **black)
    axes.set(xlabel=f"{'xyz'[across]} (m)", ylabel=f"{'xyz'[up]} (m)")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("way of the camera", fontsize=9)
    replace_frame_by_grid(axes)
    axes.legend(loc="best", frameon=True, framealpha=0.9, edgecolor="none")


# ---- batches ----


def _draw_batches(found: Comparison, size: Any) -> Figure:
    arrived = found.data.where(found.data["outcome"] == Outcome.CONVERGED)
    keys = [k for k in (*SHOWN, *EFFORTS, *MARGINS) if has_spread(arrived[k].values)][:7]
    rows = 1 + len(keys) // 4
    figure = new_figure(12.8, 1.2 + rows * (1.0 + 0.34 * len(found.names)), size)
    panels = np.atleast_2d(figure.subplots(rows, 4, sharey=True)).ravel()
    _draw_outcome_shares(panels[0], found)
    for axes, key in zip(panels[1:], keys, strict=False):
        _draw_boxes(axes, arrived[key].values, key)
    for axes in panels[1 + len(keys) :]:
        axes.set_axis_off()
    count = found.data.sizes["run"]
    figure.suptitle(f"{count} starts; boxes are of the runs that converged")
    return figure


def _draw_outcome_shares(axes: Axes, found: Comparison) -> None:
    """Draw the share of each outcome as stacked bars, each with its own hatch."""
    outcomes = found.data["outcome"].values
    left = np.zeros(len(outcomes))
    several = [outcome for outcome in palette.OUTCOMES if (outcomes == outcome).any()]
    for outcome in several:
        share = (outcomes == outcome).mean(axis=1)
        color, hatch = palette.OUTCOMES[outcome]
        look: dict[str, Any] = {"color": color, "hatch": hatch, "edgecolor": "white"}
        bars = range(len(share))
        axes.barh(bars, 100 * share, left=left, label=outcome.words, height=0.6, **look)
        left += 100 * share
    axes.set(yticks=range(len(found.names)), yticklabels=found.names, xlim=(0, 100))
    axes.set(xlabel="share of the runs (%)", ylim=(len(found.names) - 0.4, -0.6))
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, frameon=False, fontsize=8)


def _draw_boxes(axes: Axes, values: Array, key: str) -> None:
    """Draw a box for each scheme of values (schemes, runs); NaN is left out."""
    rows = [row[np.isfinite(row)] for row in values]
    line = {"linewidth": 1.2}
    boxes: Any = axes.boxplot(
        rows,
        positions=range(len(rows)),
        widths=0.6,
        orientation="horizontal",
        whis=(5, 95),
        showfliers=False,
        patch_artist=True,
        manage_ticks=False,
        boxprops=line,
        medianprops={"color": palette.BLACK, "linewidth": 2},
    )
    for i, box in enumerate(boxes["boxes"]):
        box.set(facecolor=palette.cycle_color(i), alpha=0.6)
    unit = f" ({_format_measure_unit(key)})" if _format_measure_unit(key) else ""
    axes.set_xlabel(f"{MEASURES[key].label}{unit}")
    replace_frame_by_grid(axes, "x")
