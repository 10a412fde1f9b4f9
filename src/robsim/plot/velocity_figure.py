"""Figure of the velocity of a camera or frame, and the error, over time (chapter, figs 14, 16)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.plot import palette, run_data
from robsim.plot.canvas import (
    AxesLike,
    figure_style,
    marker_of_single_point,
    prepare_panels,
    set_time_axis,
)
from robsim.plot.constraints_figure import (
    draw_constraints,
    measure_rows_height,
    select_drawn_constraints,
)

if TYPE_CHECKING:
    import xarray as xr

    from robsim.world.scene import Scene


def velocity(
    run: xr.Dataset,
    scene: Scene | None = None,
    frame: str | None = None,
    *,
    axes: AxesLike | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the camera velocity v (m/s) and omega (rad/s) and the error over time (s).

    The first two panels show the linear and angular velocity of the camera in camera axes. For a
    run without a camera, they show the velocity of the frame that the task moves, in the axes of
    this frame. If `frame` is given, they show the velocity of the origin of `frame` in world axes.

    The third panel shows the error on a logarithmic scale; an exponential decay is a straight line.
    The thick line is the norm of the error. The thin lines are the magnitudes of its components,
    with one line style for each unit.

    If constraints of the law act, a new figure has a fourth panel, as in `constraints`.

    Parameters
    ----------
    run : xarray.Dataset
        A single run.
    scene : Scene, optional
        Scene of the run. Required if `frame` is given.
    frame : str, optional
        Frame of the velocities, such as "rhino_xr4.tool". Default: the camera.
    axes : array_like of 3 matplotlib.axes.Axes, optional
        Axes to draw into. Default: the axes of a new figure.
    size : (float, float), optional
        Width and height of a new figure in inches.
    title : str, optional
        Title of a new figure. Default: the outcome of the run.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the figure that contains `axes`.

    Raises
    ------
    InputError
        If `frame` is given without a scene, is unknown, or the run belongs to another scene.

    Examples
    --------
    >>> from robsim import IBVS, Camera, MountedCamera, Object, Pose, Robot, Scene
    >>> from robsim.joints import Joint, Link
    >>> from robsim.run.simulate import simulate
    >>> fly = Robot("fly", [Link("base"), Link("body", "base", Joint("floating"))])
    >>> square = Object("square", marks=[[0, 0, 1], [0.1, 0, 1], [0.1, 0.1, 1], [0, 0.1, 1]])
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
    >>> scene = Scene(fly, square, MountedCamera("eye", camera, "fly.body"))
    >>> figure = velocity(simulate(scene, IBVS(), Pose.at(0.1, 0, -0.2), duration=1.0))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['v (m/s)', 'ω (rad/s)', 'error (–)']
    """
    one = run_data.extract_single_run(run)
    with figure_style():
        states = select_drawn_constraints(one) if axes is None else None
        strip = measure_rows_height(states) if states and states.names else 0.0
        heights = {"height_ratios": (2.0, 2.0, 2.4, strip)[: 4 if strip else 3]}
        how: dict[str, Any] = {"sharex": True, **({"gridspec_kw": heights} if strip else {})}
        figure, panels = prepare_panels(
            axes, 4 if strip else 3, size, (6.8 if strip else 5.6, 6.4 + strip), **how
        )
        draw_velocity(panels[:3], one, scene, frame)
        if strip and states:
            draw_constraints(panels[3], one["time"].values, states)
        if axes is None:
            for upper in panels[:-1]:
                upper.set_xlabel("")
            figure.align_ylabels(panels[:3])
            figure.suptitle(run_data.describe_ending(one) if title is None else title)
    return figure


def draw_velocity(
    panels: Sequence[Axes], one: xr.Dataset, scene: Scene | None, frame: str | None
) -> None:
    """Draw v, omega and the error of one run into three axes."""
    time, (twist, suffix) = one["time"].values, _select_twists(one, scene, frame)
    _draw_vector_components(panels[0], time, twist[:, :3], "v")
    _draw_vector_components(panels[1], time, twist[:, 3:], r"\omega")
    units = ["–" if unit == "1" else unit for unit in one["feature_unit"].values.tolist()]
    _draw_error_norm(panels[2], time, np.abs(one["error"].values), one["error_norm"].values, units)
    error = f"error ({', '.join(dict.fromkeys(units))})"
    labels = (f"v{suffix} (m/s)", f"ω{suffix} (rad/s)", error)
    for axes, label in zip(panels, labels, strict=True):
        set_time_axis(axes, time)
        axes.set_ylabel(label)
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1), ncols=4, frameon=False)


def _select_twists(one: xr.Dataset, scene: Scene | None, frame: str | None) -> tuple[Array, str]:
    """Return the twists (instants, 6) to draw, and the suffix of their labels."""
    if frame is None and "frame_velocity" in one:
        velocity_of_frame = one["frame_velocity"]
        return velocity_of_frame.values, f" of {velocity_of_frame.attrs['frame']}\nin its own axes"
    if frame is None:
        return one["camera_velocity"].values, ""
    if scene is None:
        raise InputError(f"the velocity of frame {frame!r} needs the scene: pass it as well")
    return run_data.compute_frame_velocity(one, scene, frame), f" of {frame}\nin world axes"


def _draw_vector_components(axes: Axes, time: Array, values: Array, symbol: str) -> None:
    """Draw three components (instants, 3), with different colours and line styles."""
    axes.axhline(0.0, color=palette.GREY, linewidth=0.6)
    for i, (color, line) in enumerate(palette.COMPONENTS):
        label = f"${symbol}_{'xyz'[i]}$"
        axes.plot(
            time,
            values[:, i],
            line,
            color=color,
            linewidth=1.4,
            label=label,
            **marker_of_single_point(time),
        )


def _draw_error_norm(axes: Axes, time: Array, sizes: Array, norm: Array, units: list[str]) -> None:
    """Draw the norm (instants,) and the magnitudes (instants, k), logarithmic unless all are 0."""
    axes.plot(
        time,
        norm,
        color=palette.BLACK,
        linewidth=2,
        label="norm",
        zorder=3,
        **marker_of_single_point(time),
    )
    different = list(dict.fromkeys(units))
    for unit, line in zip(different, cycle(palette.LINES)):
        of_unit = sizes[:, [u == unit for u in units]]
        lines = axes.plot(time, of_unit, line, color=palette.GREY, linewidth=0.6)
        lines[0].set_label("|components|" if len(different) == 1 else f"|{unit}|")
    positive = norm[(norm > 0) & np.isfinite(norm)]
    if positive.size:
        low, high = np.log10([positive.min() / 10, positive.max()])
        axes.set(yscale="log", ylim=(10 ** np.floor(low), 10 ** np.ceil(high + 1e-9)))
