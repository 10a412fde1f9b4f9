"""Figure of the workspace of a link from the side and from above, coloured by manipulability."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.figure import Figure

from robsim.analysis.workspace import Workspace
from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.geometry.pose import IDENTITY
from robsim.plot import palette, wireframe
from robsim.plot.canvas import AxesLike, figure_style, prepare_panels
from robsim.plot.studies import run_dots
from robsim.world.scene import Scene

FLAT = 1e-6  # metres; a workspace with a smaller extent is flat and has one view
AREA, SMALLEST, LARGEST = 6e4, 3.0, 12.0  # square points: all dots together, least and largest dot
VIEWS = {"from the side": (0, 2), "from above": (0, 1), "from the front": (1, 2)}  # right, up


def workspace(
    workspace: Workspace,
    *,
    axes: AxesLike | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw the workspace of a link from the side and from above.

    Each dot is the position of the link in a sampled configuration. Its colour is the
    manipulability; dots of higher manipulability cover others. The robot is drawn in its home
    configuration. A flat workspace is drawn from one side only.

    Parameters
    ----------
    workspace : Workspace
        Result of `robsim.kinematics.sample_workspace`.
    axes : array_like of matplotlib.axes.Axes, optional
        Two axes to draw into, or one for a flat workspace. Default: the axes of a new figure.
    size : (float, float), optional
        Width and height of a new figure in inches.
    title : str, optional
        Title of a new figure. Default: the name of the robot and the number of configurations.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the figure that contains `axes`.

    Raises
    ------
    InputError
        If `workspace` is not a `Workspace`.

    Examples
    --------
    >>> from robsim import kinematics, robots
    >>> figure = workspace(kinematics.sample_workspace(robots.panda(), count=500))
    >>> [axes.get_title() for axes in figure.axes[:2]]
    ['from the side', 'from above']
    """
    if not isinstance(workspace, Workspace):
        raise InputError(
            f"expected a Workspace as workspace returns it, got {format_value(workspace)}"
        )
    views, lines = _choose_views(workspace.points), _build_robot_segments(workspace)
    with figure_style():
        many = len(views)  # both views have x to the right, and the same scale
        figure, panels = prepare_panels(
            axes, many, size, (1.2 + 5.2 * many, 5.2), many, sharex=True
        )
        if axes is None:
            heading = f"{workspace.robot.name}, {len(workspace.q)} configurations"
            figure.suptitle(heading if title is None else title)
        for panel, view in zip(panels, views, strict=True):
            points = _draw_workspace_view(panel, view, workspace, lines)
        kind = "" if workspace.axes == "all" else f"{workspace.axes} "
        label = f"{kind}manipulability of {workspace.link}"
        figure.colorbar(points, ax=panels, label=label, shrink=0.8, aspect=30)
    return figure


def _choose_views(points: Array) -> list[str]:
    """Return the views to draw: two, or the view along the normal of a flat workspace."""
    x, y, z = np.ptp(points, axis=0) > FLAT
    if x and y and z:
        return ["from the side", "from above"]
    return ["from above" if not z else "from the side" if not y else "from the front"]


def _build_robot_segments(result: Workspace) -> Array:
    """Return the segments (S, 2, 3) of the robot at home, in the axes of its base."""
    alone = Scene((replace(result.robot, base=IDENTITY, on="world"),))
    wires = wireframe.place_scene_parts(alone, alone.home, 0.0)
    return np.concatenate([np.empty((0, 2, 3)), *(wire.segments for wire in wires)])


def _draw_workspace_view(axes: Axes, view: str, result: Workspace, lines: Array) -> PathCollection:
    """Draw the dots to scale, the highest manipulability last, and the robot over them."""
    right, up = VIEWS[view]
    order = np.argsort(result.manipulability, kind="stable")
    size = np.clip(AREA / len(order), SMALLEST, LARGEST)
    most = float(result.manipulability.max()) or 1.0
    colors = {"c": result.manipulability[order], "cmap": run_dots.COLORS, "vmin": 0.0, "vmax": most}
    x, y = result.points[:, right], result.points[:, up]
    points = run_dots.draw_dots(axes, x, y, order, s=size, **colors)
    for color, width in (("white", 2.6), (palette.BLACK, 1.0)):  # readable on any colour
        axes.add_collection(
            LineCollection(list(lines[:, :, [right, up]]), colors=color, linewidths=width)
        )
    axes.autoscale_view()
    axes.set_aspect("equal")
    axes.set(title=view, xlabel=f"{'xyz'[right]} (m)", ylabel=f"{'xyz'[up]} (m)")
    axes.grid(visible=True)
    axes.set_axisbelow(True)
    return points
