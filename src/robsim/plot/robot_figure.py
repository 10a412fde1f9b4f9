"""A single robot in 3-D."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from robsim.base.errors import InputError, format_value
from robsim.geometry.pose import IDENTITY
from robsim.plot import palette
from robsim.plot.scene_content import SceneContent, build_scene_content
from robsim.plot.scene_figure import draw_scene_figure
from robsim.plot.wireframe import WireSolid, compute_display_pose
from robsim.robot.robot import Robot
from robsim.world.scene import Scene

AXES = 0.1  # metres, the length of the axes of a robot that has nothing else to show


def robot(
    robot: Robot,
    q: Any = None,
    *,
    goal: Any = None,
    ax: Any = None,
    view: Any = None,
    bounds: Any = None,
    size: Any = None,
    title: str | None = None,
) -> Figure:
    """Draw a robot in 3-D at q (nq,), home by default: its links, in the axes of its base.

    A robot with neither shapes nor links to draw lines between, such as a flying camera, is shown
    by the axes of its tip. The keywords are those of `scene`; a goal is q (nq,), or a pose of the
    tip.

    >>> from robsim.files import robots
    >>> figure = robot(robots.panda(), q=robots.panda().home)
    >>> [text.get_text() for text in figure.axes[0].get_legend().get_texts()][0]
    'panda'
    """
    if not isinstance(robot, Robot):
        raise InputError(f"expected a Robot, got {format_value(robot)}")
    alone = Scene((replace(robot, base=IDENTITY, on="world"),))
    picture = build_scene_content(alone, q, None, goal)
    whole = picture if picture.solid else _add_tip_axes(alone, picture, robot, q)
    return draw_scene_figure(whole, ax, view, bounds, size, title)


def _add_tip_axes(scene: Scene, picture: SceneContent, robot: Robot, q: Any) -> SceneContent:
    """Return the picture with the axes of the tip added."""
    T = compute_display_pose(scene, f"{robot.name}.{robot.tip}", scene.home if q is None else q)
    ends = T[:3, 3] + AXES * T[:3, :3].T
    wires = [
        WireSolid(f"{name} of {robot.tip}", color, np.stack([T[:3, 3], end])[None])
        for name, (color, _), end in zip("xyz", palette.COMPONENTS, ends, strict=True)
    ]
    return replace(picture, solid=wires)
