"""Figure of a diagnosis over time: Lyapunov function, condition numbers, stability and margins."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.plot import palette
from robsim.plot.canvas import (
    AxesLike,
    figure_style,
    marker_of_single_point,
    prepare_panels,
    set_time_axis,
)
from robsim.plot.torques_figure import DriveTorques, draw_torque_shares
from robsim.run.log_commands import LOG_ATTRIBUTE

if TYPE_CHECKING:
    import xarray as xr

LOWEST = 1e-16  # share of the largest value; smaller values are rounding errors
VARIABLES = (
    "lyapunov",
    "condition_interaction",
    "condition_task_jacobian",
    "stability_motion",
    "contraction",
    "border_margin",
    "limit_margin",
)
TITLES = ("Lyapunov function", "condition number", "", "margins")  # the legend is the third
OF_DRIVES = ("", "")  # the legends are the titles
DEEP = 3.0  # eigenvalues outside [-DEEP, DEEP] are cut off


def diagnosis(
    diagnosis: xr.Dataset,
    *,
    axes: AxesLike | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the diagnosis of a run over time (s) on one slide of four panels, or six with a drive.

    * Lyapunov function V, on a logarithmic scale.
    * Condition numbers of the interaction matrix L and of L J, as the law estimates them.
    * Stability: the smallest eigenvalue of the motion, and the contraction of the loop within one
      period. The law reduces every component of the error if the eigenvalue is above zero, outside
      of the shaded region. The loop contracts if the contraction is below one.
    * Margins: the distance to the border of the image (px, left axis) and to the nearest joint
      limit (percent of the range of the joint, right axis).
    * With a drive: the torques, in percent of their limits if all have one. The curves are broad in
      the periods in which the drive limits the torque.
    * With a drive: the commanded minus the actual velocity of each joint, at the end of the period
      of the command.

    Parameters
    ----------
    diagnosis : xarray.Dataset
        Result of `robsim.diagnose`.
    axes : array_like of 4 or 6 matplotlib.axes.Axes, optional
        Axes to draw into. Default: the axes of a new figure.
    size : (float, float), optional
        Width and height of a new figure in inches. Default: (9.6, 5.6), or (9.6, 8.2) with a drive.
    title : str, optional
        Title of a new figure. Default: the outcome and the end time of the run.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the figure that contains `axes`.

    Raises
    ------
    InputError
        If `diagnosis` is not a complete result of `diagnose`.

    Examples
    --------
    >>> from robsim import diagnose, load_scenario
    >>> from robsim.files import examples
    >>> run = load_scenario(examples.path("visp_tutorial")).run(duration=0.4)
    >>> figure = diagnosis(diagnose(run))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['V (–)', 'largest / smallest σ', 'eigenvalue', 'to the border (px)']
    """
    attrs = getattr(diagnosis, "attrs", {})
    if attrs.get("title") != "RobSim diagnosis":
        if LOG_ATTRIBUTE in attrs:
            raise InputError("a run read from a log has no diagnosis; use rs.explain instead")
        kind = type(diagnosis).__name__
        raise InputError(f"expected a diagnosis as diagnose returns it, got {kind}")
    lacking = [name for name in (*VARIABLES, "time") if name not in diagnosis.variables]
    if lacking or diagnosis["time"].ndim != 1 or diagnosis["time"].size == 0:
        missing = (
            ", ".join(lacking) or "instants; take some, as in diagnosis.isel(time=slice(0, 9))"
        )
        raise InputError(f"this diagnosis is incomplete: it has no {missing}")
    time = diagnosis["time"].values
    with figure_style():
        driven = "torque" in diagnosis
        draws = (*DRAWS, *DRIVE_DRAWS) if driven else DRAWS
        titles, height = ((*TITLES, *OF_DRIVES), 8.2) if driven else (TITLES, 5.6)
        figure, panels = prepare_panels(axes, len(draws), size, (9.6, height), 2, sharex=True)
        if axes is None:
            how = str(diagnosis.attrs["outcome"]).lower().replace("_", " ")
            figure.suptitle(f"{how} after {time[-1]:.3g} s" if title is None else title)
        for panel, draw, name in zip(panels, draws, titles, strict=True):
            draw(panel, diagnosis)
            panel.set_title(name, loc="left")
            set_time_axis(panel, time)
        for panel in panels[:-2]:
            panel.set_xlabel("")
    return figure


def _draw_lyapunov(axes: Axes, result: xr.Dataset) -> None:
    """Draw the Lyapunov function over time."""
    V, time = result["lyapunov"].values, result["time"].values
    unit = result["lyapunov"].attrs["units"].replace("^2", "²")
    axes.plot(time, V, color=palette.BLACK, linewidth=1.8, **marker_of_single_point(time))
    axes.set_ylabel(f"V ({'–' if unit == '1' else unit})" if "see" not in unit else "V")
    _set_logarithmic_axis(axes, V)


def _draw_conditions(axes: Axes, result: xr.Dataset) -> None:
    """Draw the condition numbers of L and L J over time."""
    time = result["time"].values
    for name, label, color, line in (
        ("condition_interaction", "$\\hat{L}$", palette.BLUE, "-"),
        ("condition_task_jacobian", "$\\hat{L}\\,\\hat{J}$", palette.VERMILLION, "--"),
    ):
        axes.plot(
            time,
            result[name].values,
            line,
            color=color,
            label=label,
            linewidth=1.8,
            **marker_of_single_point(time),
        )
    axes.set_ylabel("largest / smallest σ")
    both = [result[f"condition_{name}"].values for name in ("interaction", "task_jacobian")]
    _set_logarithmic_axis(axes, np.concatenate(both), wide=True)
    _draw_legend_above(axes)


def _draw_stability(axes: Axes, result: xr.Dataset) -> None:
    """Draw the eigenvalues of stability and contraction over time; shade values below zero."""
    time, least = result["time"].values, result["stability_motion"].values
    radius = result["contraction"].values
    axes.plot(
        time,
        least,
        color=palette.GREEN,
        label="stability (above 0)",
        linewidth=1.8,
        **marker_of_single_point(time),
    )
    below = "contraction (below 1)"
    axes.plot(
        time,
        radius,
        "--",
        color=palette.PURPLE,
        label=below,
        linewidth=1.8,
        **marker_of_single_point(time),
    )
    for level in (0.0, 1.0):
        axes.axhline(level, color=palette.GREY, linewidth=0.8)
    levels = np.concatenate([least, radius, [-0.1, 1.1]])
    low, high = np.nanmin(levels), np.nanmax(levels)
    axes.set(ylabel="eigenvalue", ylim=(max(low, -DEEP) - 0.05, min(high, DEEP) + 0.05))
    axes.axhspan(axes.get_ylim()[0], 0.0, color=palette.FAINT, zorder=0)
    _draw_legend_above(axes)


def _draw_margins(axes: Axes, result: xr.Dataset) -> None:
    """Draw the margins to the image border and to the nearest joint limit over time."""
    time = result["time"].values
    border, limit = result["border_margin"].values, 100 * result["limit_margin"].values
    axes.plot(time, border, color=palette.BLUE, linewidth=1.8, **marker_of_single_point(time))
    axes.set_ylabel("to the border (px)", color=palette.BLUE)
    _set_axis_from_zero(axes, border)
    if np.isfinite(limit).any():
        right = axes.twinx()
        right.plot(
            time,
            limit,
            "--",
            color=palette.VERMILLION,
            linewidth=1.8,
            **marker_of_single_point(time),
        )
        right.set_ylabel("to a joint limit (% of its range)", color=palette.VERMILLION)
        right.spines["top"].set_visible(False)
        _set_axis_from_zero(right, limit)
    elif not np.isfinite(border).any():
        axes.text(0.5, 0.5, "no borders, no limits", transform=axes.transAxes, ha="center")


def _draw_torques(axes: Axes, result: xr.Dataset) -> None:
    """Draw the torques of the drives over time."""
    draw_torque_shares(axes, DriveTorques.of(result))


def _draw_velocity_errors(axes: Axes, result: xr.Dataset) -> None:
    """Draw the commanded minus the actual velocities of the driven joints over time."""
    if "velocity_error" not in result:
        axes.text(0.5, 0.5, "the law commands torques", transform=axes.transAxes, ha="center")
        return
    time, error = result["time"].values, result["velocity_error"].values
    driven = np.flatnonzero(~np.isnan(result["torque_limit"].values))
    for i, joint in enumerate(driven):
        color, name = palette.cycle_color(i), str(result["velocity"].values[joint])
        axes.plot(time, error[:, joint], color=color, linewidth=1.4, label=name)
    axes.axhline(0.0, color=palette.GREY, linewidth=0.8, zorder=1)
    axes.set_ylabel(f"lag of the velocity ({result['velocity_error'].attrs['units']})")


DRAWS = _draw_lyapunov, _draw_conditions, _draw_stability, _draw_margins
DRIVE_DRAWS = _draw_torques, _draw_velocity_errors


def _set_axis_from_zero(axes: Axes, values: Array) -> None:
    """Start the vertical axis at zero, or at the smallest value if it is negative."""
    finite = values[np.isfinite(values)]
    if finite.size:
        axes.set_ylim(min(0.0, 1.05 * finite.min()), 1.05 * max(finite.max(), 1e-9))


def _set_logarithmic_axis(axes: Axes, values: Array, wide: bool = False) -> None:
    """Set a logarithmic axis of at least one decade; `wide` leaves room for a legend."""
    finite = values[np.isfinite(values) & (values > LOWEST * np.nanmax(values, initial=0.0))]
    if finite.size and finite.max() > 0:
        low, high = np.floor(np.log10(finite.min())), np.ceil(np.log10(finite.max()) + 1e-9)
        axes.set(yscale="log", ylim=(10.0**low, 10.0 ** (high + (0.3 if wide else 0))))


def _draw_legend_above(axes: Axes) -> None:
    """Add a legend without a frame above the right corner of the axes."""
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncols=2, frameon=False, borderpad=0)
