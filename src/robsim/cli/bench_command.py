"""The command `bench`: compare schemes on the suites that ship with RobSim."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from robsim.base.atomic_files import write_whole
from robsim.base.errors import InputError
from robsim.cli.console import print_text
from robsim.cli.options import force
from robsim.cli.output_files import claim_results_folder
from robsim.cli.progress import run_and_save
from robsim.cli.user_schemes import load_user_schemes

if TYPE_CHECKING:
    from robsim.suites.benchmark import Benchmark

WRITTEN = ("bench.csv", "bench.tex", "runs.csv")


@click.command("bench")
@click.argument("suites", nargs=-1, metavar="[SUITE]...")
@click.option(
    "--task",
    "tasks",
    multiple=True,
    metavar="FILE.py:NAME",
    help="A scheme of your own: a task, or what is called with a goal and a gain.",
)
@click.option("--alone", is_flag=True, help="Without the schemes of the suites.")
@click.option("--list", "listed", is_flag=True, help="List the suites.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Folder for the results.")
@force
def compare_suites(
    suites: tuple[str, ...],
    tasks: tuple[str, ...],
    alone: bool,
    listed: bool,
    output: Path | None,
    force: bool,
) -> None:
    """Compare schemes on the suites SUITE..., or on all of them."""
    from robsim.suites.suite_registry import list_suites, load_suite

    chosen = [load_suite(name) for name in suites or list_suites()]
    if listed:
        for suite in chosen:
            print_text(f"{suite.name:15} {suite.title}")
        return
    if alone and not tasks:
        raise InputError("--alone: which scheme is compared? name one by --task FILE.py:NAME")
    own = load_user_schemes(tasks)
    with claim_results_folder(output, "robsim-bench", force, WRITTEN) as folder:
        _run_suites(chosen, own, not alone, folder)


def _run_suites(suites: list[Any], own: dict[str, Any], builtin: bool, folder: Path) -> None:
    """Run all schemes, write the results, and print the tables; a stop keeps what is done."""
    from robsim.suites.bench import bench

    def save(found: Benchmark) -> None:
        write_whole(folder / "bench.csv", found.csv())
        write_whole(folder / "bench.tex", found.latex())
        write_whole(folder / "runs.csv", found.data.to_csv(index=False, lineterminator="\n"))

    run_and_save(partial(bench, suites, own, builtin=builtin), save, folder)
