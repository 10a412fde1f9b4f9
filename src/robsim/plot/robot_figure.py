"""Figure of a single robot in 3-D."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from numpy.typing import ArrayLike

from robsim.base.errors import InputError, format_value
from robsim.geometry.pose import IDENTITY, PoseLike
from robsim.plot import palette
from robsim.plot.scene_content import SceneContent, build_scene_content
from robsim.plot.scene_figure import draw_scene_figure
from robsim.plot.wireframe import WireSolid, compute_display_pose
from robsim.robot.robot import Robot
from robsim.world.scene import Scene

AXES = 0.1  # length in metres of the tip axes of a robot without shapes or links


def robot(
    robot: Robot,
    q: ArrayLike | None = None,
    *,
    goal: PoseLike | None = None,
    ax: Axes3D | None = None,
    view: tuple[float, float] | None = None,
    bounds: ArrayLike | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw a robot in 3-D at a configuration, in the frame of its base.

    A robot without shapes is drawn as lines between the frames of its links. A robot without such
    lines, for instance a flying camera, is drawn as the axes of its tip.

    Parameters
    ----------
    robot : Robot
        Robot to draw.
    q : array_like of shape (nq,), optional
        Configuration. Default: the home configuration.
    goal : array_like of shape (nq,) or Pose, optional
        Configuration or pose of the tip in the base frame, drawn as a dotted outline.
    ax : Axes3D, optional
        3-D axes to draw into. Default: the axes of a new figure.
    view : (float, float), optional
        Elevation and azimuth of the viewing direction in degrees. Default: (22, -55).
    bounds : array_like of shape (2, 3), optional
        Lowest and highest corner of the drawn box in metres. Default: chosen to fit the robot.
    size : (float, float), optional
        Width and height of a new figure in inches.
    title : str, optional
        Title of the figure.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the figure that contains `ax`.

    Raises
    ------
    InputError
        If `robot` is not a `Robot`, or an option is invalid.

    See Also
    --------
    scene : Figure of a scene with robots, cameras and objects, also over a run.

    Examples
    --------
    >>> from robsim.files import robots
    >>> figure = robot(robots.panda(), q=robots.panda().home)
    >>> [text.get_text() for text in figure.axes[0].get_legend().get_texts()][0]
    'panda'
    """
    if not isinstance(robot, Robot):
        raise InputError(f"expected a Robot, got {format_value(robot)}")
    alone = Scene((replace(robot, base=IDENTITY, on="world"),))
    content = build_scene_content(alone, q, None, goal)
    whole = content if content.solids else _add_tip_axes(alone, content, robot, q)
    return draw_scene_figure(whole, ax, view, bounds, size, title)


def _add_tip_axes(
    scene: Scene, content: SceneContent, robot: Robot, q: ArrayLike | None
) -> SceneContent:
    """Return the content of the figure with the axes of the tip as its solids."""
    T = compute_display_pose(
        scene, f"{robot.name}.{robot.tip}", scene.home if q is None else np.asarray(q)
    )
    ends = T[:3, 3] + AXES * T[:3, :3].T
    wires = [
        WireSolid(f"{name} of {robot.tip}", color, np.stack([T[:3, 3], end])[None])
        for name, (color, _), end in zip("xyz", palette.COMPONENTS, ends, strict=True)
    ]
    return replace(content, solids=wires)
