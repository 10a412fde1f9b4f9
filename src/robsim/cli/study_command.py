"""Command `study`: run a scenario many times, and write the table of the results."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, closing, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from robsim.base.atomic_files import write_whole
from robsim.base.errors import FileError, InputError, Interrupted
from robsim.cli.console import print_text
from robsim.cli.figure_files import save_figure
from robsim.cli.options import set_option
from robsim.cli.output_files import claim_results_folder, path_exists
from robsim.cli.progress import (
    exit_after_stop,
    exit_if_drawing_stops,
    print_warnings_as_lines,
    progress_bar,
)
from robsim.cli.scenarios import load_with_changes

if TYPE_CHECKING:
    from robsim.studies.study_plan import Plan
    from robsim.studies.study_result import StudyResult

CSV = 200_000  # tables with more runs are not written as CSV


@click.command("study")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Folder for the results.")
@click.option("--resume", is_flag=True, help="Continue an interrupted study; needs -o.")
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Scheduler of a Dask cluster to run on, such as tcp://host:8786.",
)
@click.option(
    "--chunk", type=int, default=4000, show_default=True, help="Number of runs in one file."
)
@click.option("--threads", type=int, help="Number of threads; one per processor by default.")
@click.option("--no-figures", is_flag=True, help="Write no figures.")
@set_option
def run_study_file(
    file: Path,
    output: Path | None,
    resume: bool,
    scheduler: str | None,
    chunk: int,
    threads: int | None,
    no_figures: bool,
    changes: tuple[str, ...],
) -> None:
    """Run a scenario many times, as its table [study] defines.

    FILE is the scenario. The rows of the results are written to Parquet files at intervals, which
    needs pip install 'robsim[store]'. After an interrupt, the same command with --resume continues
    the study.
    """
    from robsim.studies.study_text import read_plan

    if resume and (output is None or not path_exists(output / "study.json")):
        raise FileError("nothing to resume: name the folder of the study with -o")
    plan = read_plan(load_with_changes(file, changes))
    with (
        _open_client(scheduler) as client,
        claim_results_folder(output, f"{file.stem}-study", True, ()) as to,
    ):
        print_text(plan)
        result = _run_plan_with_progress(plan, to, resume, client, chunk, threads)
        print_text(result)
        if len(result.runs) <= CSV:
            write_whole(to / "table.csv", result.table.to_csv(index=False))
        print_text(f"results  {to}")
        if not no_figures:
            with exit_if_drawing_stops("study is"):
                _draw_study_figures(result, to)


def _open_client(scheduler: str | None) -> AbstractContextManager[Any]:
    """Return a context manager with a client of the scheduler, or with None."""
    if scheduler is None:
        return nullcontext()
    from robsim.studies.dask_cluster import connect_client

    return closing(connect_client(scheduler))


def _run_plan_with_progress(
    plan: Plan, folder: Path, resume: bool, client: Any, chunk: int, threads: int | None
) -> StudyResult:
    """Run a plan and write its rows into a folder; after an interrupt, end the command."""
    from robsim.studies.api import run_plan

    try:
        with print_warnings_as_lines(), progress_bar("simulating", plan.runs) as progress:
            return run_plan(plan, folder, resume, client, threads, chunk, progress)
    except Interrupted as stop:
        print_text(
            f"{len(stop.run.runs)} of {plan.runs} runs are done; continue with --resume", err=True
        )
        exit_after_stop(folder)


def _draw_study_figures(result: StudyResult, folder: Path) -> None:
    """Write the figures of the starts and the sensitivities; print why a figure is missing."""
    from robsim import plot

    first = next((axis.name for axis in result.plan.in_turn), None)
    figures: dict[str, Callable[[], Any]] = {
        "starts": lambda: plot.study_basin(result, "start_x", "start_y", by=first),
        "sensitivity": lambda: plot.study_sensitivity(result),
    }
    for name, draw in figures.items():
        try:
            figure = draw()
        except InputError as reason:
            print_text(f"no {name}.png: {reason}", err=True)
        else:
            save_figure(figure, folder / f"{name}.png")
