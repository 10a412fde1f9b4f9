"""Command `bench`: compare control schemes on the suites shipped with RobSim."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from robsim.base.atomic_files import write_whole
from robsim.base.errors import InputError
from robsim.cli.console import print_text
from robsim.cli.options import force_option
from robsim.cli.output_files import claim_results_folder
from robsim.cli.progress import run_and_save
from robsim.cli.user_schemes import load_user_schemes

if TYPE_CHECKING:
    from robsim.suites.benchmark import Benchmark
    from robsim.suites.reproduction import Reproduction
    from robsim.suites.suite import Suite

RESULT_FILES = ("bench.csv", "bench.tex", "runs.csv")


@click.command("bench")
@click.argument("suites", nargs=-1, metavar="[SUITE]...")
@click.option(
    "--task",
    "tasks",
    multiple=True,
    metavar="FILE.py:NAME",
    help="Scheme to add: a task, or a function of a goal and a gain.",
)
@click.option("--alone", is_flag=True, help="Leave out the schemes of the suites.")
@click.option("--list", "list_only", is_flag=True, help="List the suites and exit.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Folder for the results.")
@force_option
def compare_suites(
    suites: tuple[str, ...],
    tasks: tuple[str, ...],
    alone: bool,
    list_only: bool,
    output: Path | None,
    force: bool,
) -> None:
    """Compare control schemes on the suites shipped with RobSim.

    SUITE is the name of a suite; without a name, all suites without pictures are run. The results
    are tables as CSV and LaTeX, and the measures of all runs.
    """
    from robsim.suites.suite_registry import list_suites, load_quick_suites, load_suite

    names = suites or (list_suites() if list_only else ())
    chosen = [load_suite(name) for name in names] or load_quick_suites()
    if list_only:
        for suite in chosen:
            print_text(f"{suite.name:15} {suite.title}")
        return
    if alone and not tasks:
        raise InputError("--alone needs a scheme: add it with --task FILE.py:NAME")
    own = load_user_schemes(tasks)
    with claim_results_folder(output, "robsim-bench", force, RESULT_FILES) as folder:
        _run_suites(chosen, own, not alone, folder)


def _run_suites(
    suites: list[Suite | Reproduction], own: dict[str, Any], builtin: bool, folder: Path
) -> None:
    """Run all schemes, write the results, and print the tables.

    After an interrupt, the results so far are written.
    """
    from robsim.suites.bench import bench

    def save(result: Benchmark) -> None:
        write_whole(folder / "bench.csv", result.csv())
        write_whole(folder / "bench.tex", result.latex())
        write_whole(folder / "runs.csv", result.data.to_csv(index=False, lineterminator="\n"))

    run_and_save(partial(bench, suites, own, builtin=builtin), save, folder)
