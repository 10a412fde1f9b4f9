"""Command `compare`: simulate several scenarios and compare them."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from robsim.base.atomic_files import write_whole
from robsim.base.errors import InputError
from robsim.cli.figure_files import save_figure
from robsim.cli.options import output, set_option
from robsim.cli.output_files import claim_results_folder, remove_file
from robsim.cli.progress import exit_if_drawing_stops, run_and_save
from robsim.cli.scenarios import load_with_changes

if TYPE_CHECKING:
    from robsim.analysis.comparison import Comparison
    from robsim.run.experiment import Experiment

RESULT_FILES = ("comparison.nc", "comparison.csv", "comparison.png")


@click.command("compare")
@click.argument(
    "files", nargs=-1, required=True, metavar="FILE...", type=click.Path(path_type=Path)
)
@click.option(
    "--vary",
    "vary",
    multiple=True,
    metavar="KEY=V1,V2,...",
    help="Run one scheme for each value of a key.",
)
@output
@set_option
def compare_scenarios(
    files: tuple[Path, ...],
    vary: tuple[str, ...],
    output: Path | None,
    force: bool,
    no_figures: bool,
    changes: tuple[str, ...],
) -> None:
    """Simulate several scenarios and compare their measures.

    Each FILE is a scenario. With --vary, each scenario is run once for each value of a key. The
    results are the runs, the measures as CSV and NetCDF, and a figure.
    """
    from robsim.cli.variants import list_variants

    if len(vary) > 1:
        raise InputError(f"--vary: one key at a time, got {' and '.join(map(repr, vary))}")
    variants = list_variants(files, *vary)
    scenarios = {name: load_with_changes(file, (*changes, *more)) for name, file, more in variants}
    names = [*RESULT_FILES, *(f"{name}.nc" for name in scenarios)]
    with claim_results_folder(output, "robsim-compare", force, names) as folder:
        _run_comparison(scenarios, folder, not no_figures)


def _run_comparison(scenarios: dict[str, Experiment], folder: Path, figures: bool) -> None:
    """Run all schemes, write and draw the results, and print the table.

    After an interrupt, the runs so far are written.
    """
    from robsim.analysis.scheme_comparison import compare

    save = partial(_save_comparison, names=list(scenarios), folder=folder)
    result = run_and_save(partial(compare, scenarios), save, folder)
    if figures:
        with exit_if_drawing_stops("runs are"):
            from robsim import plot

            save_figure(plot.comparison(result), folder / "comparison.png")


def _save_comparison(result: Comparison, names: list[str], folder: Path) -> None:
    """Write runs, measures and table."""
    from robsim.files.netcdf import save_run

    for name in names:
        remove_file(folder / f"{name}.nc")  # of an earlier comparison
    for name, run in result.runs.items():
        save_run(run, folder / f"{name}.nc")
    save_run(result.data, folder / "comparison.nc")
    write_whole(folder / "comparison.csv", result.csv())
    remove_file(folder / "comparison.png")
