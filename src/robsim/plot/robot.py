"""A single robot in 3-D."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from robsim.base.errors import InputError, said
from robsim.geometry.pose import IDENTITY
from robsim.plot import palette
from robsim.plot.picture import Picture, picture_of
from robsim.plot.scene import drawn
from robsim.plot.wireframe import Wire, displayed
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
        raise InputError(f"expected a Robot, got {said(robot)}")
    alone = Scene((replace(robot, base=IDENTITY, on="world"),))
    picture = picture_of(alone, q, None, goal)
    whole = picture if picture.solid else _axes(alone, picture, robot, q)
    return drawn(whole, ax, view, bounds, size, title)


def _axes(scene: Scene, picture: Picture, robot: Robot, q: Any) -> Picture:
    """Return the picture with the axes of the tip added."""
    T = displayed(scene, f"{robot.name}.{robot.tip}", scene.home if q is None else q)
    ends = T[:3, 3] + AXES * T[:3, :3].T
    wires = [
        Wire(f"{name} of {robot.tip}", color, np.stack([T[:3, 3], end])[None])
        for name, (color, _), end in zip("xyz", palette.COMPONENTS, ends, strict=True)
    ]
    return replace(picture, solid=wires)
