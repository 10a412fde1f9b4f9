"""The command `study`: many runs of a scenario, and what came out of them."""

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
from robsim.cli.options import changes
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

CSV = 200_000  # runs up to which the table is written as text, too


@click.command("study")
@click.argument("file", type=click.Path(path_type=Path))
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Folder for the results.")
@click.option("--resume", is_flag=True, help="Go on with a study that was stopped; needs -o.")
@click.option("--scheduler", metavar="ADDRESS", help="Run on a Dask cluster: tcp://host:8786.")
@click.option("--chunk", type=int, default=4000, show_default=True, help="Runs in one file.")
@click.option("--threads", type=int, help="How many; by default one per processor.")
@click.option("--no-figures", is_flag=True, help="Write the rows and the table only.")
@changes
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
    """Run the scenario in FILE many times, as its table [study] says.

    The rows go into a folder as Parquet files, some at a time: what is stopped or killed goes on
    with --resume, to the same bits.
    """
    from robsim.studies.study_text import read_plan

    if resume and (output is None or not path_exists(output / "study.json")):
        raise FileError("nothing to resume: say with -o which folder holds the study")
    plan = read_plan(load_with_changes(file, changes))
    with (
        _open_client(scheduler) as client,
        claim_results_folder(output, f"{file.stem}-study", True, ()) as to,
    ):
        print_text(plan)
        found = _run_plan_with_progress(plan, to, resume, client, chunk, threads)
        print_text(found)
        if len(found.runs) <= CSV:
            write_whole(to / "table.csv", found.table.to_csv(index=False))
        print_text(f"results  {to}")
        if not no_figures:
            with exit_if_drawing_stops("study is"):
                _draw_study_figures(found, to)


def _open_client(scheduler: str | None) -> AbstractContextManager[Any]:
    """Return a client of the scheduler at an address, or None, for a `with` block."""
    if scheduler is None:
        return nullcontext()
    from robsim.studies.dask_cluster import connect_client

    return closing(connect_client(scheduler))


def _run_plan_with_progress(
    plan: Plan, folder: Path, resume: bool, client: Any, chunk: int, threads: int | None
) -> StudyResult:
    """Run a plan into a folder, with a progress bar; after a stop, end the command."""
    from robsim.studies.api import run_plan

    try:
        with print_warnings_as_lines(), progress_bar("simulating", plan.runs) as progress:
            return run_plan(plan, folder, resume, client, threads, chunk, progress)
    except Interrupted as stop:
        print_text(
            f"{len(stop.run.runs)} of {plan.runs} runs are done; go on with --resume", err=True
        )
        exit_after_stop(folder)


def _draw_study_figures(found: StudyResult, folder: Path) -> None:
    """Write the map of the starts, and what the outcome depends on, where there is any of it."""
    from robsim import plot

    first = next((axis.name for axis in found.plan.in_turn), None)
    figures: dict[str, Callable[[], Any]] = {
        "starts": lambda: plot.study_basin(found, "start_x", "start_y", by=first),
        "sensitivity": lambda: plot.study_sensitivity(found),
    }
    for name, draw in figures.items():
        try:
            figure = draw()
        except InputError as reason:
            print_text(f"no {name}.png: {reason}", err=True)
        else:
            save_figure(figure, folder / f"{name}.png")
