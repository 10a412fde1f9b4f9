"""Overviews of a scene: a text of a few lines, and a table for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robsim.base import html
from robsim.robot.robot_overview import join_names

if TYPE_CHECKING:
    from robsim.world.scene import Scene

MOST_LINES = 12  # lines of a text


def format_scene(scene: Scene) -> str:
    """Return one line for each robot, object and camera; the total number beyond twelve lines."""
    lines = [f"{kind} '{name}' on {on}: {what}" for kind, name, on, what in _list_parts(scene)]
    more = [f"... ({len(lines)} in all)"] if len(lines) > MOST_LINES else []
    return "\n  ".join(["<Scene", *lines[:MOST_LINES], *more]) + ">"


def format_scene_html(scene: Scene) -> str:
    """Return a table of robots, objects and cameras as HTML."""
    title = f"Scene: {scene.nq} coordinates, {scene.nv} velocities"
    return html.format_html_table(title, _list_parts(scene), ("", "name", "stands on", ""))


def _list_parts(scene: Scene) -> list[tuple[str, str, str, str]]:
    """Return kind, name, parent frame and a description of each robot, object and camera."""
    movers = {motion.robot for motion in scene.motions}
    parts = [
        (
            "robot",
            robot.name,
            robot.on,
            f"coordinates: {join_names(robot.coordinate_names)}"
            + (", moves on its own" if robot.name in movers else ""),
        )
        for robot in scene.robots
    ]
    for thing in scene.objects:
        count = len(thing.marks)
        marks = "one mark" if count == 1 else f"{count or 'no'} marks"
        parts.append(("object", thing.name, thing.on, marks))
    for eye in scene.cameras:
        size = eye.camera.size
        pixels = "no image size" if size is None else f"{size[0]} x {size[1]} px"
        parts.append(("camera", eye.name, eye.on, pixels))
    return parts
