"""Figure of the torques of drives over time, with their limits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
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

ROOM = 0.12  # room above and below a curve, as a share of its range
NEAR = 0.8  # a limit is in the picture if the torque exceeds this share of it
LEAST_RANGE, LEAST_SHARE = 1e-3, 0.1  # smallest range of an axis: N m or N, share of the torque
SATURATED: dict[str, Any] = {"color": palette.ORANGE, "alpha": 0.3, "linewidth": 0, "zorder": 0}
BAND: dict[str, Any] = {"linewidth": 6, "alpha": 0.3, "solid_capstyle": "butt"}  # of limited parts


@dataclass(frozen=True, eq=False)
class DriveTorques:
    """Torques of the driven joints of a single run.

    Attributes
    ----------
    time : ndarray of shape (T,)
        Instants in seconds.
    names, units : tuple of str
        Names of the n joints, and the unit "N m" or "N" of each torque.
    torque, saturation : ndarray of shape (T, n)
        Torques, and shares of the periods before the instants in which they were limited.
    limits : ndarray of shape (n,)
        Largest torques, infinite without a limit.
    """

    time: Array
    names: tuple[str, ...]
    units: tuple[str, ...]
    torque: Array
    saturation: Array
    limits: Array

    @classmethod
    def of(cls, one: xr.Dataset) -> DriveTorques:
        """Return the torques of a single run or its diagnosis."""
        limits = one["torque_limit"].values
        driven = np.flatnonzero(~np.isnan(limits))
        names = one["velocity"].values[driven].tolist()
        table = one["torque"].values[:, driven], one["saturation"].values[:, driven]
        units = _list_torque_units(one, names)
        return cls(one["time"].values, tuple(names), units, *table, limits[driven])

    def find_saturated_spans(self, joint: int) -> Iterator[slice]:
        """Yield the instants around the periods in which the torque of a joint is limited."""
        flags: NDArray[np.bool_] = self.saturation[1:, joint] > 0.0
        edges = np.diff(np.concatenate([[False], flags, [False]]).astype(int))
        starts, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
        for a, b in zip(starts, ends, strict=True):
            yield slice(int(a), int(b) + 1)


def _list_torque_units(one: xr.Dataset, names: list[str]) -> tuple[str, ...]:
    """Return the unit of the torque of each joint, given by name."""
    coordinates = one["coordinate"].values.tolist()
    kinds = dict(zip(coordinates, one["coordinate_unit"].values.tolist(), strict=True))
    return tuple("N" if kinds.get(name) == "m" else "N m" for name in names)


def torques(
    run: xr.Dataset,
    *,
    axes: AxesLike | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the torque of every driven joint of a single run over time (s), in N m or N.

    The periods in which the drive limits the torque are shaded. The title of a panel states the
    largest torque, which is a dashed line if the torque comes near. Each panel has its own scale,
    because the torques of the first joint of an arm are many times the torques of the last.

    Parameters
    ----------
    run : xarray.Dataset
        A single run with a drive.
    axes : array_like of matplotlib.axes.Axes, optional
        One axes for each driven joint to draw into. Default: the axes of a new figure.
    size : (float, float), optional
        Width and height of a new figure in inches. Default: chosen from the number of joints.
    title : str, optional
        Title of a new figure. Default: the outcome of the run.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the figure that contains `axes`.

    Raises
    ------
    InputError
        If `run` is not a single run, or has no drive.

    Examples
    --------
    >>> import robsim as rs
    >>> scene, drive = rs.Scene(rs.robots.planar_2r()), rs.drives.VelocityLoop()
    >>> task = rs.FollowJoints(by={"upper": 0.3}, duration=0.2)
    >>> run = rs.simulate(scene, task, duration=0.4, actuation=rs.Actuation(drive=drive))
    >>> [axes.get_ylabel() for axes in torques(run).axes]
    ['upper (N m)', 'fore (N m)']
    """
    one = run_data.extract_single_run(run)
    if "torque" not in one:
        raise InputError(
            "torques: this run has no drive; simulate it with "
            "actuation=rs.Actuation(drive=rs.drives.VelocityLoop())"
        )
    table = DriveTorques.of(one)
    count = len(table.names)
    with figure_style():
        figure, panels = prepare_joint_panels(axes, count, size)
        for i, panel in enumerate(panels[:count]):
            _draw_joint_torque(panel, table, i)
        if axes is None:
            label_joint_panels(panels, count)
            figure.suptitle(run_data.describe_ending(one) if title is None else title)
    return figure


def _draw_joint_torque(axes: Axes, table: DriveTorques, joint: int) -> None:
    """Draw the torque of one joint, its limits, and the periods of saturation."""
    time, torque, limit = table.time, table.torque[:, joint], float(table.limits[joint])
    color, unit = palette.cycle_color(joint % 7), table.units[joint]
    axes.plot(time, torque, color=color, linewidth=1.4, **marker_of_single_point(time))
    for span in table.find_saturated_spans(joint):
        axes.axvspan(*time[span][[0, -1]], **SATURATED)
    low, high = _choose_torque_range(torque, limit)
    for each in (-limit, limit):
        if low <= each <= high:
            axes.axhline(each, color=palette.VERMILLION, linestyle="--", linewidth=1)
    set_time_axis(axes, time)
    axes.set(ylabel=f"{table.names[joint]} ({unit})", ylim=(low, high))
    if np.isfinite(limit):
        share = float(np.nanmean(table.saturation[1:, joint])) if len(time) > 1 else 0.0
        saturated = f", limited for {100 * share:.3g} % of the time" if share > 0.0 else ""
        text = f"at most {limit:.4g} {unit}{saturated}"
        axes.set_title(text, loc="right", fontsize=8, color="#666666")


def _choose_torque_range(torque: Array, limit: float) -> tuple[float, float]:
    """Return the range of an axis of torques, which shows near limits."""
    low, high = float(np.nanmin(torque)), float(np.nanmax(torque))
    low = min(low, -limit) if low < -NEAR * limit else low
    high = max(high, limit) if high > NEAR * limit else high
    least = max(LEAST_SHARE * max(abs(low), abs(high)), LEAST_RANGE)
    room = max(ROOM * (high - low), (least - (high - low)) / 2)
    return low - room, high + room


def draw_torque_shares(axes: Axes, table: DriveTorques) -> None:
    """Draw all torques of a run into one axes, as shares of their limits if all have limits.

    The parts of a curve in which the torque is limited are broad.
    """
    limited = bool(np.isfinite(table.limits).all())
    values = 100.0 * table.torque / table.limits if limited else table.torque
    for i, name in enumerate(table.names):
        line: dict[str, Any] = {"color": palette.cycle_color(i), "linewidth": 1.4, "label": name}
        axes.plot(table.time, values[:, i], **line, **marker_of_single_point(table.time))
        for span in table.find_saturated_spans(i):
            axes.plot(table.time[span], values[span, i], color=line["color"], **BAND)
    if table.saturation[1:].any():
        axes.plot([], [], color=palette.GREY, label="limited", **BAND)
    if limited:
        for level in (-100.0, 100.0):
            axes.axhline(level, color=palette.VERMILLION, linestyle="--", linewidth=1)
        far = max(1.12 * 100.0, 1.05 * float(np.abs(values).max()))
        axes.set_ylim(-far, far)
    unit = "% of the limit" if limited else ", ".join(dict.fromkeys(table.units))
    axes.set_ylabel(f"torque ({unit})")
    place: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (-0.02, 1), "ncols": 4}
    add_fitted_legend(axes, *axes.get_legend_handles_labels(), **place, borderpad=0)
