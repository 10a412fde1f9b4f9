"""Command `check`: check a scenario without simulating it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from robsim.base.errors import InputError
from robsim.cli.console import print_text
from robsim.cli.options import set_option
from robsim.cli.progress import print_warnings_as_lines
from robsim.cli.scenarios import load_with_changes

if TYPE_CHECKING:
    from robsim.run.experiment import Experiment


@click.command("check")
@click.argument("file", type=click.Path(path_type=Path))
@set_option
def check_scenario(file: Path, changes: tuple[str, ...]) -> None:
    """Check the scenario in FILE without simulating it.

    The goal, the start and the settings are checked, and the robots, cameras and objects are
    listed. If a camera does not see its target at the start, a start from which it does is printed.
    """
    scenario = load_with_changes(file, changes)
    with print_warnings_as_lines():
        _check_scenario(scenario)
    scene = scenario.scene
    study = _describe_study_plan(scenario)
    print_text(f"{file}: no problems")
    if study:
        print_text(f"  study    {study}")
    print_text(f"  robots   {', '.join(f'{r.name} ({r.nv} velocities)' for r in scene.robots)}")
    print_text(f"  cameras  {', '.join(c.name for c in scene.cameras)}")
    print_text(f"  objects  {', '.join(f'{o.name} ({len(o.marks)} marks)' for o in scene.objects)}")


def _check_scenario(scenario: Experiment) -> None:
    """Check a scenario; the error of a start without its target contains another start."""
    try:
        scenario.check()
    except InputError as error:
        from robsim.studies.visible_starts import find_visible_start

        start = find_visible_start(scenario)
        if start is None:
            raise
        _, section = scenario.with_(start=start).text.split("\n[start]\n")
        table = section.partition("\n\n")[0]
        raise type(error)(f"{error}; a start that sees it:\n\n[start]\n{table}") from None


def _describe_study_plan(scenario: Experiment) -> str:
    """Return the description of the checked study of a scenario; "" without a study."""
    if scenario.study is None:
        return ""
    from robsim.studies.plan_execution import check_plan
    from robsim.studies.study_text import read_plan

    plan = read_plan(scenario)
    check_plan(plan)
    return str(plan)
