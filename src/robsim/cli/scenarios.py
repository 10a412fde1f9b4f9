"""Loading of scenarios for commands, with a check of their colours."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from robsim.base.errors import in_file

if TYPE_CHECKING:
    from robsim.run.experiment import Experiment


def load(file: Path, changes: tuple[str, ...]) -> Experiment:
    """Return the experiment in a scenario file, with KEY=VALUE changes."""
    from robsim.run.experiment import load_scenario

    return load_scenario(file, set=list(changes))


def check_colors(scenario: Experiment) -> None:
    """Raise FileError for a colour that Matplotlib does not know, before simulating."""
    from robsim.plot.palette import color

    scene = scenario.scene
    parts = [(f"robots.{r.name}.links.{k.name}", k.shapes) for r in scene.robots for k in r.links]
    parts += [(f"objects.{thing.name}", thing.shapes) for thing in scene.objects]
    parts += [(f"cameras.{c.name}", (c.camera.body,)) for c in scene.cameras if c.camera.body]
    for owner, shapes in parts:
        for shape in shapes:
            with in_file(f"{scenario.source}: {owner}"):
                color(shape.color)
