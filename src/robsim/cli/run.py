"""The command `run`: simulate one scenario, and write the run, the scenario and the figures."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from robsim.base.interrupt import undisturbed
from robsim.base.output import write_whole
from robsim.cli.figures import draw, draw_mission
from robsim.cli.files import remove, results_folder
from robsim.cli.options import changes, output
from robsim.cli.progress import STOPPED, drawing, finished
from robsim.cli.report import report, report_mission
from robsim.cli.scenarios import check_colors, load
from robsim.cli.tell import tell

if TYPE_CHECKING:
    from robsim.run.experiment import Experiment

FIGURES = ("image.png", "scene.png", "velocity.png")
FILES = ("run.nc", "scenario.toml", *FIGURES)


@click.command("run")
@click.argument("file", type=click.Path(path_type=Path))
@output
@changes
def command(
    file: Path, output: Path | None, force: bool, no_figures: bool, changes: tuple[str, ...]
) -> None:
    """Simulate the scenario in FILE and write the run, the scenario and the figures."""
    scenario = load(file, changes)
    with results_folder(output, f"{file.stem}-run", force, FILES) as folder:
        simulate_into(scenario, folder, not no_figures)


def simulate_into(scenario: Experiment, folder: Path, figures: bool) -> None:
    """Run a scenario, write and draw the results, and print a report.

    What was simulated before Ctrl-C is kept.
    """
    if figures:
        check_colors(scenario)
    tell(scenario.title or "simulating")
    result = finished(scenario.run, lambda run: _save(run, scenario, folder), folder)
    stopped = _save(result, scenario, folder)
    told, picture = (report_mission, draw_mission) if _staged(result) else (report, draw)
    told(result, folder)
    if stopped:
        sys.exit(STOPPED)
    if figures:
        with drawing("run is"):
            picture(result, scenario, folder)


def _staged(result: Any) -> bool:
    from robsim.run.mission_run import MissionRun

    return isinstance(result, MissionRun)


def _save(result: Any, scenario: Experiment, folder: Path) -> bool:
    """Write run and scenario completely; return whether Ctrl-C came meanwhile.

    The run of a mission is the joint motion of all its phases.
    """
    from robsim.files.netcdf import save_run

    with undisturbed() as stops:
        save_run(result.run if _staged(result) else result, folder / "run.nc")
        write_whole(folder / "scenario.toml", scenario.text)
        for name in FIGURES:
            remove(folder / name)  # of the run that was here before
    return bool(stops)
