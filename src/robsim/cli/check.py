"""The command `check`: read a scenario and check it without simulating."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from robsim.cli.options import changes
from robsim.cli.progress import warnings_as_lines
from robsim.cli.scenarios import check_colors, load
from robsim.cli.tell import tell

if TYPE_CHECKING:
    from robsim.run.experiment import Experiment


@click.command("check")
@click.argument("file", type=click.Path(path_type=Path))
@changes
def command(file: Path, changes: tuple[str, ...]) -> None:
    """Read FILE and check its goal, start and settings without simulating."""
    scenario = load(file, changes)
    with warnings_as_lines():
        scenario.check()
    check_colors(scenario)
    scene = scenario.scene
    study = _study(scenario)
    tell(f"{file}: all is well")
    if study:
        tell(f"  study    {study}")
    tell(f"  robots   {', '.join(f'{r.name} ({r.nv} velocities)' for r in scene.robots)}")
    tell(f"  cameras  {', '.join(c.name for c in scene.cameras)}")
    tell(f"  objects  {', '.join(f'{o.name} ({len(o.marks)} marks)' for o in scene.objects)}")


def _study(scenario: Experiment) -> str:
    """Return the line of a study in the file, once it is found to be valid; "" for none."""
    if scenario.study is None:
        return ""
    from robsim.studies.running import check
    from robsim.studies.text import plan_of

    plan = plan_of(scenario)
    check(plan)
    return str(plan)
