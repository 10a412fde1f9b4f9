"""Command `run`: simulate a scenario, and write the run, the scenario and the figures."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from robsim.base.atomic_files import write_whole
from robsim.base.errors import FileError
from robsim.cli.console import print_text
from robsim.cli.figure_files import write_mission_figure, write_run_figures
from robsim.cli.figure_kernels import compile_figure_kernels
from robsim.cli.options import output, set_option, views
from robsim.cli.output_files import CHECKPOINT, claim_results_folder, path_exists, remove_file
from robsim.cli.page_and_films import PAGE, VIEWS, check_views, write_views
from robsim.cli.progress import exit_if_drawing_stops, run_and_save
from robsim.cli.report import print_mission_report, print_run_report
from robsim.cli.scenarios import load_with_changes
from robsim.files.toml import read_toml_text

if TYPE_CHECKING:
    from robsim.run.experiment import Experiment

FIGURES = ("image.png", "scene.png", "velocity.png")
FILES = ("run.nc", "scenario.toml", *FIGURES, *VIEWS)


@click.command("run")
@click.argument("file", type=click.Path(path_type=Path))
@output
@views
@click.option("--camera", metavar="NAME", help="Camera whose pictures the films show.")
@click.option("--resume", is_flag=True, help="Continue an interrupted run; needs -o.")
@set_option
def simulate_scenario(
    file: Path,
    output: Path | None,
    force: bool,
    no_figures: bool,
    html: bool,
    gif: bool,
    mp4: bool,
    camera: str | None,
    resume: bool,
    changes: tuple[str, ...],
) -> None:
    """Simulate the scenario in FILE and write its results.

    The results are the run (run.nc), the scenario (scenario.toml) and figures; with --html, --gif
    or --mp4 also a page or films.

    After Ctrl-C, the run so far and a checkpoint are written. The same command with --resume
    continues the run, with the same results as without the interrupt. A long run writes a
    checkpoint every ten seconds.
    """
    scenario = load_with_changes(file, changes)
    names = tuple(compress(VIEWS, (html, gif, mp4)))
    check_views(scenario, names, camera)
    name, files = f"{file.stem}-run", (*FILES, CHECKPOINT)
    if resume:
        _check_checkpoint(output)
    with claim_results_folder(output, name, force or resume, files) as folder:
        if not resume:
            remove_file(folder / CHECKPOINT)
        checkpoint = folder / CHECKPOINT
        simulate_into_folder(scenario, folder, not no_figures, checkpoint, resume, names, camera)


def _check_checkpoint(folder: Path | None) -> None:
    """Raise FileError unless the folder has a checkpoint."""
    if folder is None or not path_exists(folder / CHECKPOINT):
        reason = f"{folder} has no checkpoint" if folder else "name the folder of the run with -o"
        raise FileError(f"nothing to resume: {reason}")


def simulate_into_folder(
    scenario: Experiment,
    folder: Path,
    figures: bool,
    checkpoint: Path | None = None,
    resume: bool = False,
    views: tuple[str, ...] = (),
    camera: str | None = None,
) -> None:
    """Run a scenario, write its results, figures and `views`, and print a report.

    `camera` is the camera whose pictures the films show; None for films of the scene.

    After an interrupt, the run so far is written.
    """
    print_text(scenario.title or "simulating")

    def report_end(result: Any) -> None:
        if checkpoint:
            remove_file(checkpoint)
        if _is_mission_run(result):
            print_mission_report(result, folder)
        else:
            print_run_report(result, folder, scenario.safety)

    work = partial(scenario.run, checkpoint=checkpoint, resume=resume)
    keep = partial(_save_run_and_scenario, scenario=scenario, folder=folder)
    with compile_figure_kernels(scenario, figures, PAGE in views):
        result = run_and_save(work, keep, folder, report_end)
        with exit_if_drawing_stops("run is"):
            if figures:
                write = write_mission_figure if _is_mission_run(result) else write_run_figures
                write(result, scenario, folder)
            write_views(result, scenario, folder, views, camera)


def _is_mission_run(result: Any) -> bool:
    """Return whether a result is the run of a mission."""
    from robsim.run.mission_run import MissionRun

    return isinstance(result, MissionRun)


def choose_scenario_text(scenario: Experiment, folder: Path) -> str:
    """Return the text of the scenario file if the scenario is unchanged, else a new text."""
    from robsim.run.experiment import Experiment

    source = folder / "scenario.toml"
    with suppress(FileError):
        text = read_toml_text(scenario.source)
        if Experiment.from_text(text, str(source)) == scenario:
            return text
    return scenario.to_toml(folder=folder)


def _save_run_and_scenario(result: Any, scenario: Experiment, folder: Path) -> None:
    """Write run and scenario; for a mission, the run is the motion of all phases."""
    from robsim.files.netcdf import save_run

    save_run(result.run if _is_mission_run(result) else result, folder / "run.nc")
    write_whole(folder / "scenario.toml", choose_scenario_text(scenario, folder))
    scenario.write_stored_data(folder)
    for name in (*FIGURES, *VIEWS):
        remove_file(folder / name)  # of an earlier run
