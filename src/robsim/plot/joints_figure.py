"""Figure of the joint coordinates of a run over time, with their limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robsim.base.arrays import Array
from robsim.plot import palette, run_data
from robsim.plot.canvas import (
    AxesLike,
    figure_style,
    label_joint_panels,
    marker_of_single_point,
    prepare_joint_panels,
    set_time_axis,
)
from robsim.plot.fitted_legend import add_fitted_legend

if TYPE_CHECKING:
    import xarray as xr

    from robsim.world.scene import Scene

LEAST = {"deg": 1.0, "m": 0.001, "–": 0.01}  # smallest span of an axis
ROOM = 1.15  # span of an axis divided by the largest range of a coordinate


def joints(
    run: xr.Dataset,
    scene: Scene | None = None,
    *,
    axes: AxesLike | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw every joint coordinate of a single run over time (s), in degrees or metres.

    All panels of one unit have the same scale, so that motions can be compared. If a `scene` is
    given, the region beyond the limits of a joint is grey, and the title of its panel is the range
    of the joint.

    Parameters
    ----------
    run : xarray.Dataset
        A single run.
    scene : Scene, optional
        Scene of the run. If given, joint limits are drawn.
    axes : array_like of matplotlib.axes.Axes, optional
        One axes for each coordinate to draw into. Default: the axes of a new figure.
    size : (float, float), optional
        Width and height of a new figure in inches. Default: chosen from the number of coordinates.
    title : str, optional
        Title of a new figure. Default: the outcome of the run.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the figure that contains `axes`.

    Raises
    ------
    InputError
        If `run` is not a single run, or belongs to another scene.

    Examples
    --------
    >>> from robsim import load_scenario
    >>> from robsim.files import examples
    >>> one = load_scenario(examples.path("eye_in_hand"))
    >>> figure = joints(one.run(duration=0.4), one.scene)
    >>> figure.axes[0].get_ylabel()
    'link1 (deg)'
    """
    one = run_data.extract_single_run(run)
    limits = None if scene is None else run_data.read_coordinate_limits(one, scene)
    count = one.sizes["coordinate"]
    with figure_style():
        figure, panels = prepare_joint_panels(axes, count, size)
        draw_joints(panels[:count], one, limits)
        if axes is None:
            label_joint_panels(panels, count)
            figure.suptitle(run_data.describe_ending(one) if title is None else title)
    return figure


def _choose_display_units(one: xr.Dataset) -> list[tuple[str, float]]:
    """Return the display unit of each coordinate, and the factor from its unit to this unit."""
    shown = {"rad": ("deg", float(np.degrees(1.0))), "m": ("m", 1.0)}
    return [shown.get(unit, ("–", 1.0)) for unit in one["coordinate_unit"].values.tolist()]


def list_display_units(one: xr.Dataset) -> list[str]:
    """Return the display units of the coordinates of a run, without repetition."""
    return list(dict.fromkeys(unit for unit, _ in _choose_display_units(one)))


def draw_joints_by_unit(panels: list[Axes], one: xr.Dataset) -> None:
    """Draw the coordinates of a run into one axes for each unit of `list_display_units`."""
    time, names = one["time"].values, one["coordinate"].values.tolist()
    of_unit = dict(zip(list_display_units(one), panels, strict=True))
    for i, (unit, scale) in enumerate(_choose_display_units(one)):
        path = scale * one["q"].values[:, i]
        _draw_coordinate(of_unit[unit], time, path, palette.cycle_color(i), names[i])
    for unit, axes in of_unit.items():
        axes.set_ylabel(f"coordinates ({unit})")
        place: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0, 1), "ncols": 4}
        add_fitted_legend(axes, *axes.get_legend_handles_labels(), **place)


def draw_joints(panels: list[Axes], one: xr.Dataset, limits: Array | None) -> None:
    """Draw each coordinate of one run into its own axes."""
    time, names = one["time"].values, one["coordinate"].values.tolist()
    units = _choose_display_units(one)
    paths = [scale * q for q, (_, scale) in zip(one["q"].values.T, units, strict=True)]
    spans = dict(LEAST)
    for path, (unit, _) in zip(paths, units, strict=True):
        spans[unit] = max(spans[unit], ROOM * float(np.ptp(path)))
    for i, (axes, path, (unit, scale)) in enumerate(zip(panels, paths, units, strict=True)):
        _draw_coordinate(axes, time, path, palette.cycle_color(i % 7), names[i])
        middle = float(path.min() + path.max()) / 2
        half = spans[unit] / 2
        axes.set(ylabel=f"{names[i]} ({unit})", ylim=(middle - half, middle + half))
        if limits is not None:
            _draw_coordinate_limits(axes, scale * limits[i], unit)


def _draw_coordinate(axes: Axes, time: Array, path: Array, color: str, name: str) -> None:
    """Draw one coordinate over time."""
    axes.plot(time, path, color=color, linewidth=1.8, label=name, **marker_of_single_point(time))
    set_time_axis(axes, time)


def _draw_coordinate_limits(axes: Axes, limits: Array, unit: str) -> None:
    """Shade the region beyond the limits (lowest, highest), and write the limits above the axes."""
    if not np.isfinite(limits).any():
        return
    low, high = axes.get_ylim()
    for beyond, limit in ((low, limits[0]), (high, limits[1])):
        if low <= limit <= high:
            axes.axhspan(*sorted((beyond, limit)), color=palette.LIGHT_GREY, linewidth=0, zorder=0)
            axes.axhline(limit, color=palette.VERMILLION, linestyle="--", linewidth=1)
    axes.set_ylim(low, high)
    text = " to ".join(f"{limit:.4g}" for limit in limits)
    axes.set_title(f"within {text} {unit}", loc="right", fontsize=8, color="#666666")
