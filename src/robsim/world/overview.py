"""A scene in short: as a few lines of text, and as a table for notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from robsim.base import html
from robsim.robot.overview import named

if TYPE_CHECKING:
    from robsim.world.scene import Scene

MOST = 12  # lines of a text


def text(scene: Scene) -> str:
    """Return a line for each robot, object and camera; of more than twelve how many there are."""
    lines = [f"{kind} '{name}' on {on}: {what}" for kind, name, on, what in rows(scene)]
    more = [f"... ({len(lines)} in all)"] if len(lines) > MOST else []
    return "\n  ".join(["<Scene", *lines[:MOST], *more]) + ">"


def table(scene: Scene) -> str:
    """Return a table of robots, objects and cameras as HTML."""
    title = f"Scene: {scene.nq} coordinates, {scene.nv} velocities"
    return html.table(title, rows(scene), ("", "name", "stands on", ""))


def rows(scene: Scene) -> list[tuple[str, str, str, str]]:
    """Return the kind, name, what it stands on, and what it is."""
    movers = {motion.robot for motion in scene.motions}
    found = [
        (
            "robot",
            robot.name,
            robot.on,
            f"coordinates: {named(robot.coordinate_names)}"
            + (", moves on its own" if robot.name in movers else ""),
        )
        for robot in scene.robots
    ]
    for thing in scene.objects:
        count = len(thing.marks)
        marks = "one mark" if count == 1 else f"{count or 'no'} marks"
        found.append(("object", thing.name, thing.on, marks))
    for eye in scene.cameras:
        size = eye.camera.size
        pixels = "no image size" if size is None else f"{size[0]} x {size[1]} px"
        found.append(("camera", eye.name, eye.on, pixels))
    return found
