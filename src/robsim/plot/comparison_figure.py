"""Figure of a comparison: images, errors, measures and paths, or the distributions of a batch."""

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
from robsim.plot.fitted_legend import add_fitted_legend
from robsim.plot.image_figure import set_image_axes
from robsim.plot.run_data import ROUNDING_ERROR, has_spread

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.gridspec import GridSpecBase

    from robsim.analysis.comparison import Comparison

IMAGES_PER_ROW, LOWER_HEIGHT = 7, 4.4  # height of the lower panels in inches
PATH_MEASURES = ("time", "image_excursion", "image_detour", "path_length", "retreat", "rotation")
EFFORT_MEASURES = ("effort_angular", "effort_linear")
MARGIN_MEASURES = ("border_margin", "limit_margin")
_MARKERS = "osD^v<>"


def comparison(
    comparison: Comparison, *, size: tuple[float, float] | None = None, title: str | None = None
) -> Figure:
    """Draw a comparison of control schemes on one slide.

    Every scheme keeps one colour, line style and marker in all panels.

    The slide of single runs has four parts:

    * Images: the feature point paths of each run. Asterisks are the start, squares the goal and
      circles the end.
    * Error: the distance of the farthest feature point from its goal over time, on a logarithmic
      scale. If a run has no goal image, the norm of the error relative to its start.
    * Measures: each as a share of the largest value among the schemes. A hollow marker is a run
      that did not converge.
    * Paths: the camera paths in the two world axes of largest extent.

    The slide of a batch shows the outcomes as stacked bars, and the distribution of each measure
    over the runs that converged: the median, the quartiles as a box, and the 5th and 95th
    percentiles as whiskers. Converged runs are blue, and failures have warm colours.

    Parameters
    ----------
    comparison : Comparison
        Result of `robsim.compare`.
    size : (float, float), optional
        Width and height of the figure in inches. Default: chosen from the number of schemes.
    title : str, optional
        Title of the figure. Default: no title for single runs, the number of starts for a batch.

    Returns
    -------
    matplotlib.figure.Figure
        The slide.

    Raises
    ------
    InputError
        If `comparison` is not a `Comparison`, or `size` is invalid.

    Examples
    --------
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


def _draw_single_runs(result: Comparison, size: tuple[float, float] | None) -> Figure:
    """Draw the slide of single runs: images above, three panels below."""
    rows = -(-len(result.names) // IMAGES_PER_ROW)
    columns = -(-len(result.names) // rows)
    height = rows * (2.8 if columns < 4 else 2.0)
    figure = new_figure(12.8, height + LOWER_HEIGHT, size)
    figure.set_layout_engine("constrained", h_pad=0.08, w_pad=0.08)
    grid = figure.add_gridspec(2, 1, height_ratios=(height, LOWER_HEIGHT))
    _draw_scheme_images(figure, grid[0].subgridspec(rows, columns), result)
    below = grid[1].subgridspec(1, 3, width_ratios=(1, 1.15, 1))
    for i, draw in enumerate((_draw_scheme_errors, _draw_measures, _draw_camera_paths)):
        draw(figure.add_subplot(below[i]), result)
    names = figure.axes[len(result.names)].get_legend_handles_labels()
    add_fitted_legend(figure, *names, loc="outside lower center", ncols=columns)
    return figure


def _draw_scheme_images(figure: Figure, grid: GridSpecBase, result: Comparison) -> None:
    """Draw the image of each run; images of the same size share their limits."""
    axes_by_size: dict[tuple[Any, ...], list[Axes]] = {}
    for i, (name, run) in enumerate(result.runs.items()):
        axes, one = (
            figure.add_subplot(grid[divmod(i, grid.ncols)]),
            run_data.extract_single_run(run),
        )
        view = run_data.select_camera_view(one, None)
        _draw_scheme_image(axes, view, palette.cycle_color(i))
        converged = int(run["outcome"]) == Outcome.CONVERGED
        axes.set_title(
            name if converged else f"{name}\n{run_data.describe_ending(one)}", fontsize=9
        )
        axes_by_size.setdefault((*np.ravel(view.attrs["image_size"]),), []).append(axes)
    for same_size in axes_by_size.values():
        low = np.min([(axes.get_xlim()[0], axes.get_ylim()[1]) for axes in same_size], axis=0)
        high = np.max([(axes.get_xlim()[1], axes.get_ylim()[0]) for axes in same_size], axis=0)
        for axes in same_size:
            axes.set(xlim=(low[0], high[0]), ylim=(high[1], low[1]))


def _draw_scheme_image(axes: Axes, view: xr.Dataset, color: str) -> None:
    """Draw the feature point paths of one run in the image of its first camera."""
    path, goal = view["pixels"].values, view["pixels_goal"].values
    for n in range(path.shape[1]):
        axes.plot(*path[:, n].T, color=color, linewidth=1.3)
    dots: dict[str, Any] = {"linestyle": "none", "zorder": 3}
    axes.plot(*path[0].T, color=palette.BLACK, marker=palette.ASTERISK, markersize=6, **dots)
    axes.plot(*path[-1].T, color=color, marker="o", markersize=4, **dots)
    axes.plot(*goal.T, color=palette.GOAL, marker="s", markersize=8, fillstyle="none", **dots)
    pixels = np.concatenate([path.reshape(-1, 2), goal])
    set_image_axes(axes, pixels, view.attrs["image_size"], None)
    axes.set(xticks=[], yticks=[], xlabel="", ylabel="")


def _draw_scheme_errors(axes: Axes, result: Comparison) -> None:
    """Draw the distance of the farthest feature point from its goal, or the error norm, over time.

    The error norm is drawn, relative to its start, if any run has no goal image.
    """
    has_image = all(np.isfinite(run["pixels_goal"]).all() for run in result.runs.values())
    low, high = np.inf, 0.0
    for i, (name, run) in enumerate(result.runs.items()):
        one = run_data.extract_single_run(run)
        norm = one["error_norm"].values
        values = (
            compute_pixel_distances(one)[0].max(axis=1) if has_image else norm / (norm[0] or 1.0)
        )
        axes.plot(one["time"].values, values, label=name, **style_scheme(i))
        positive = values[(values > 0) & np.isfinite(values)]
        low, high = min([low, *positive]), max([high, *positive])
    label = (
        "farthest feature point from its goal (px)" if has_image else "error / error at the start"
    )
    axes.set(xlabel="time (s)", ylabel=label)
    if high > 0:
        axes.set(yscale="log", ylim=(max(low, 1e-6 * high) / 2, 2 * high))
    axes.set_xlim(left=0)
    replace_frame_by_grid(axes)


def normalise_measures(result: Comparison) -> dict[str, tuple[float, Array]]:
    """Return {measure: (largest value, values as shares of it)} for the measures to minimise."""
    shares = {}
    for key in (*PATH_MEASURES, *EFFORT_MEASURES):
        values = result.data[key].values
        largest = float(np.nanmax([*values, 0.0]))
        if np.isfinite(largest) and largest > ROUNDING_ERROR:
            shares[key] = largest, values / largest
    return shares


def _draw_measures(axes: Axes, result: Comparison) -> None:
    """Draw each measure as a row with one dot for each scheme."""
    shares, count = normalise_measures(result), len(result.names)
    converged = result.data["outcome"].values == Outcome.CONVERGED
    for i in range(count):
        rows = np.arange(len(shares)) + 0.6 * ((i + 0.5) / count - 0.5)
        values = [share[i] for _, share in shares.values()]
        face = palette.cycle_color(i) if converged[i] else "none"
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
    if not converged.all():
        axes.set_title("hollow: did not converge", loc="right", fontsize=9)


def _format_measure_unit(key: str) -> str:
    """Return the unit of a measure as text for a label; "" for a measure without a unit."""
    unit = MEASURES[key].unit.replace("^2", "²")
    return "" if unit == "1" else unit


def _draw_camera_paths(axes: Axes, result: Comparison) -> None:
    """Draw the camera paths in the two world axes of largest extent."""
    runs = result.runs.items()
    paths = [
        collect_mover_positions(run_data.extract_single_run(run), result.scenes[name])[0]
        for name, run in runs
    ]
    spans = np.ptp(np.concatenate(paths), axis=0)
    across, up = sorted(np.argsort(-spans, kind="stable")[:2])
    for i, path in enumerate(paths):
        axes.plot(path[:, across], path[:, up], **style_scheme(i))
    starts = np.unique([path[0, [across, up]] for path in paths], axis=0)
    black: dict[str, Any] = {"color": palette.BLACK, "linestyle": "none"}
    axes.plot(*starts.T, marker=palette.ASTERISK, markersize=9, label="start", **black)
    axes.set(xlabel=f"{'xyz'[across]} (m)", ylabel=f"{'xyz'[up]} (m)")
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("path of the camera", fontsize=9)
    replace_frame_by_grid(axes)
    axes.legend(loc="best", frameon=True, framealpha=0.9, edgecolor="none")


# ---- batches ----


def _draw_batches(result: Comparison, size: tuple[float, float] | None) -> Figure:
    """Draw the slide of a batch: the outcomes as bars, and a box plot for each measure."""
    converged = result.data.where(result.data["outcome"] == Outcome.CONVERGED)
    keys = [
        k
        for k in (*PATH_MEASURES, *EFFORT_MEASURES, *MARGIN_MEASURES)
        if has_spread(converged[k].values)
    ][:7]
    rows = 1 + len(keys) // 4
    figure = new_figure(12.8, 1.2 + rows * (1.0 + 0.34 * len(result.names)), size)
    panels = np.atleast_2d(figure.subplots(rows, 4, sharey=True)).ravel()
    _draw_outcome_shares(panels[0], result)
    for axes, key in zip(panels[1:], keys, strict=False):
        _draw_boxes(axes, converged[key].values, key)
    for axes in panels[1 + len(keys) :]:
        axes.set_axis_off()
    count = result.data.sizes["run"]
    figure.suptitle(f"{count} starts; boxes: runs that converged")
    return figure


def _draw_outcome_shares(axes: Axes, result: Comparison) -> None:
    """Draw the share of each outcome as stacked bars, each with its own hatch."""
    outcomes = result.data["outcome"].values
    left = np.zeros(len(outcomes))
    occurring = [outcome for outcome in palette.OUTCOMES if (outcomes == outcome).any()]
    for outcome in occurring:
        share = (outcomes == outcome).mean(axis=1)
        color, hatch = palette.OUTCOMES[outcome]
        bar: dict[str, Any] = {"color": color, "hatch": hatch, "edgecolor": "white"}
        bars = range(len(share))
        axes.barh(bars, 100 * share, left=left, label=outcome.words, height=0.6, **bar)
        left += 100 * share
    axes.set(yticks=range(len(result.names)), yticklabels=result.names, xlim=(0, 100))
    axes.set(xlabel="share of the runs (%)", ylim=(len(result.names) - 0.4, -0.6))
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=2, frameon=False, fontsize=8)


def _draw_boxes(axes: Axes, values: Array, key: str) -> None:
    """Draw a box for each row of `values` (schemes, runs), without NaN."""
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
