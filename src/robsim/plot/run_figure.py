"""Summary figure of a run: the scene, the image, the velocities and the error."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure, SubFigure

from robsim.plot import axes_box, run_data
from robsim.plot.canvas import figure_style, new_figure
from robsim.plot.constraints_figure import (
    draw_constraints,
    measure_rows_height,
    select_drawn_constraints,
)
from robsim.plot.goal_outlines import DrawableGoal
from robsim.plot.image_figure import draw_image
from robsim.plot.scene_content import build_scene_content
from robsim.plot.scene_figure import arrange_scene, draw_scene, measure_scene_width
from robsim.plot.velocity_figure import draw_velocity

if TYPE_CHECKING:
    import xarray as xr

    from robsim.world.scene import Scene

HEIGHT = 4.4  # height of the upper row, inches


def run(
    run: xr.Dataset,
    scene: Scene,
    camera: str | None = None,
    frame: str | None = None,
    *,
    goal: DrawableGoal | None = None,
    view: tuple[float, float] | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw a run on one slide: `scene`, `image` and `velocity` together.

    The upper row shows the scene over the run in 3-D, and the image of a camera if the run has one.
    The lower row shows the linear velocity, the angular velocity and the error over time. If
    constraints of the law act, a further row shows `constraints`, and the figure is higher.

    Parameters
    ----------
    run : xarray.Dataset
        A single run.
    scene : Scene
        Scene of the run.
    camera : str, optional
        Name of the camera of the image. Default: the first camera of the run.
    frame : str, optional
        Frame of the velocities, as in `velocity`. Default: the camera.
    goal : array_like of shape (nq,), Pose, ServoTask or the goal of a task, optional
        Goal to draw as an outline, as in `scene`. Default: the goal of the run.
    view : (float, float), optional
        Elevation and azimuth of the viewing direction in degrees. Default: (22, -55).
    size : (float, float), default (12.8, 7.2)
        Width and height of the figure in inches.
    title : str, optional
        Title of the figure. Default: the outcome of the run, and the length of the camera path.

    Returns
    -------
    matplotlib.figure.Figure
        The slide.

    Raises
    ------
    InputError
        If `run` is not a single run, or belongs to another scene.

    Examples
    --------
    >>> from robsim import IBVS, Camera, MountedCamera, Object, Pose, Robot, Scene
    >>> from robsim.joints import Joint, Link
    >>> from robsim.run.simulate import simulate
    >>> fly = Robot("fly", [Link("base"), Link("body", "base", Joint("floating"))])
    >>> square = Object("square", marks=[[0, 0, 1], [0.1, 0, 1], [0.1, 0.1, 1], [0, 0.1, 1]])
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
    >>> there = Scene(fly, square, MountedCamera("eye", camera, "fly.body"))
    >>> len(run(simulate(there, IBVS(), Pose.at(0.1, 0, -0.2), duration=1.0), there).axes)
    5
    """
    one = run_data.extract_single_run(run)
    with figure_style():
        states = select_drawn_constraints(one)
        strip = measure_rows_height(states) if states and states.names else 0.0
        figure = new_figure(12.8, 7.2 + strip, size)
        whole, last = split_strip(figure, strip)
        has_image = bool(one.sizes["mark"]) or camera is not None
        content = build_scene_content(scene, None, one, goal)
        box = axes_box.compute_axes_box(content.points)
        upper, below = split_slide(
            whole, measure_scene_width(content, HEIGHT, view, box), has_image
        )
        solid = draw_scene(upper[0], content, box, view).axes
        if has_image:
            draw_image(upper[1].add_subplot(), one, camera, scene, title="")
        draw_velocity(below.subplots(1, 3), one, scene, frame)
        if last and states:
            draw_constraints(last.add_subplot(), one["time"].values, states)
        heading = f"{run_data.describe_ending(one)}; path {float(one['path_length']):.3g} m"
        figure.suptitle(heading if title is None else title)
        figure.draw_without_rendering()  # computes the size of every part
        arrange_scene(upper[0], solid, content, box)
    return figure


def split_strip(figure: Figure, height: float) -> tuple[Figure | SubFigure, SubFigure | None]:
    """Return the part of a figure for a slide, and the row of `height` inches below it if any."""
    if not height:
        return figure, None
    rows: Any = figure.subfigures(2, 1, height_ratios=(7.2, height))
    return rows[0], rows[1]


def split_slide(
    figure: Figure | SubFigure, width: float, images: bool
) -> tuple[list[SubFigure], SubFigure]:
    """Return the subfigures of the upper row of a slide, and the subfigure of the lower row.

    The upper row has the scene, `width` inches wide, and the images if any.
    """
    rows: Any = figure.subfigures(2, 1, height_ratios=(1.9, 1))
    share = min(max(width / float(rows[0].get_figure(root=True).get_figwidth()), 0.35), 0.6)
    above = rows[0].subfigures(1, 2, width_ratios=(share, 1 - share)) if images else [rows[0]]
    return list(above), rows[1]
