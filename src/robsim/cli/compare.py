"""The command `compare`: simulate several scenarios and compare them."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from robsim.base.errors import InputError
from robsim.base.output import write_whole
from robsim.cli.figures import save_figure
from robsim.cli.files import remove, results_folder
from robsim.cli.options import changes, output
from robsim.cli.progress import drawing, finished
from robsim.cli.scenarios import check_colors, load

if TYPE_CHECKING:
    from robsim.analysis.comparison import Comparison
    from robsim.run.experiment import Experiment

COMPARED = ("comparison.nc", "comparison.csv", "comparison.png")


@click.command("compare")
@click.argument(
    "files", nargs=-1, required=True, metavar="FILE...", type=click.Path(path_type=Path)
)
@click.option(
    "--vary", "varied", multiple=True, metavar="KEY=V1,V2,...", help="One scheme for each value."
)
@output
@changes
def command(
    files: tuple[Path, ...],
    varied: tuple[str, ...],
    output: Path | None,
    force: bool,
    no_figures: bool,
    changes: tuple[str, ...],
) -> None:
    """Simulate the scenarios in FILE... and measure them beside each other."""
    from robsim.cli.variants import variants

    if len(varied) > 1:
        raise InputError(f"--vary: one key at a time, got {' and '.join(map(repr, varied))}")
    each = variants(files, *varied)
    scenarios = {name: load(file, (*changes, *more)) for name, file, more in each}
    if not no_figures:
        for scenario in scenarios.values():
            check_colors(scenario)
    names = [*COMPARED, *(f"{name}.nc" for name in scenarios)]
    with results_folder(output, "robsim-compare", force, names) as folder:
        _compare(scenarios, folder, not no_figures)


def _compare(scenarios: dict[str, Experiment], folder: Path, figures: bool) -> None:
    """Run all schemes, write and draw the results, and print the table.

    What was simulated before a stop is kept.
    """
    from robsim.analysis.compare import compare

    save = partial(_save_comparison, names=list(scenarios), folder=folder)
    found = finished(partial(compare, scenarios), save, folder)
    if figures:
        with drawing("runs are"):
            from robsim import plot

            save_figure(plot.comparison(found), folder / "comparison.png")


def _save_comparison(found: Comparison, names: list[str], folder: Path) -> None:
    """Write runs, measures and table."""
    from robsim.files.netcdf import save_run

    for name in names:
        remove(folder / f"{name}.nc")  # of the comparison that was here before
    for name, run in found.runs.items():
        save_run(run, folder / f"{name}.nc")
    save_run(found.data, folder / "comparison.nc")
    write_whole(folder / "comparison.csv", found.csv())
    remove(folder / "comparison.png")
