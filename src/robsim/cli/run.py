"""The command `run`: simulate one scenario, and write the run, the scenario and the figures."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from robsim.base import interrupt
from robsim.base.errors import FileError
from robsim.cli.figures import draw, draw_mission
from robsim.cli.files import exists, folder_for, free_folder, write, writing
from robsim.cli.options import changes, output
from robsim.cli.progress import drawing, finished, stopped
from robsim.cli.report import report, report_mission
from robsim.cli.scenarios import check_colors, load

if TYPE_CHECKING:
    from robsim.run.experiment import Experiment

FIGURES = ("image.png", "scene.png", "velocity.png")
FILES = ("run.nc", "scenario.toml", *FIGURES)
CHECKPOINT = "checkpoint"


@click.command("run")
@click.argument("file", type=click.Path(path_type=Path))
@output
@click.option("--resume", is_flag=True, help="Go on with a run that was stopped; needs -o.")
@changes
def command(
    file: Path,
    output: Path | None,
    force: bool,
    no_figures: bool,
    resume: bool,
    changes: tuple[str, ...],
) -> None:
    """Simulate the scenario in FILE and write the run, the scenario and the figures.

    A run that is stopped leaves what was simulated so far, and a checkpoint from which the same
    command with --resume goes on, as if it had not been stopped. A long run leaves a checkpoint
    every ten seconds.
    """
    scenario = load(file, changes)
    wanted = output or free_folder(f"{file.stem}-run")
    if resume and not exists(wanted / CHECKPOINT):
        which = f"{output} has no checkpoint" if output else "say with -o which folder it is in"
        raise FileError(f"nothing to resume: {which}")
    folder = folder_for(wanted, force or resume, (*FILES, CHECKPOINT))
    if not resume:
        _remove(folder / CHECKPOINT)
    simulate_into(scenario, folder, not no_figures, folder / CHECKPOINT, resume)


def simulate_into(
    scenario: Experiment,
    folder: Path,
    figures: bool,
    checkpoint: Path | None = None,
    resume: bool = False,
) -> None:
    """Run a scenario, write and draw the results, and print a report.

    What was simulated before a stop is kept.
    """
    if figures:
        check_colors(scenario)
    click.echo(scenario.title or "simulating")
    work = partial(scenario.run, checkpoint=checkpoint, resume=resume)
    with interrupt.held(begun=False) as stops:
        result = finished(work, lambda run: _save(run, scenario, folder), folder)
        _save(result, scenario, folder)
        if checkpoint:
            _remove(checkpoint)
        tell, picture = (report_mission, draw_mission) if _staged(result) else (report, draw)
        tell(result, folder)
        if stops:
            stopped(folder)
    if figures:
        with drawing("run is"):
            picture(result, scenario, folder)


def _remove(path: Path) -> None:
    with writing(path):
        path.unlink(missing_ok=True)


def _staged(result: Any) -> bool:
    from robsim.run.mission_run import MissionRun

    return isinstance(result, MissionRun)


def _save(result: Any, scenario: Experiment, folder: Path) -> None:
    """Write run and scenario; the run of a mission is the joint motion of all its phases."""
    from robsim.files.netcdf import save_run

    save_run(result.run if _staged(result) else result, folder / "run.nc")
    write(folder / "scenario.toml", scenario.text)
    for name in FIGURES:
        _remove(folder / name)  # of the run that was here before
