"""Loading of scenarios for commands, and a check of their colours."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from robsim.base.errors import raise_file_errors

if TYPE_CHECKING:
    from robsim.run.experiment import Experiment


def load_with_changes(file: Path, changes: tuple[str, ...]) -> Experiment:
    """Return the experiment in a scenario file, with KEY=VALUE changes."""
    from robsim.run.experiment import load_scenario

    return load_scenario(file, set=list(changes))


def check_colors(scenario: Experiment) -> None:
    """Raise FileError for a colour that Matplotlib does not support."""
    from robsim.plot.palette import convert_color

    scene = scenario.scene
    parts = [(f"robots.{r.name}.links.{k.name}", k.shapes) for r in scene.robots for k in r.links]
    parts += [(f"objects.{obj.name}", obj.solids) for obj in scene.objects]
    parts += [(f"cameras.{c.name}", (c.camera.body,)) for c in scene.cameras if c.camera.body]
    for owner, shapes in parts:
        for shape in shapes:
            with raise_file_errors(f"{scenario.source}: {owner}"):
                convert_color(shape.color)
