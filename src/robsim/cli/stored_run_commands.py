"""Commands of stored runs: `export` writes a page, `explain` prints the cause of the outcome."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from robsim.base.errors import raise_file_errors
from robsim.cli.console import print_text
from robsim.cli.options import force_option
from robsim.cli.output_files import choose_output_file, find_run_file

if TYPE_CHECKING:
    import xarray as xr

    from robsim.robot.robot import Robot
    from robsim.run.experiment import Experiment


@click.command("export")
@click.argument("shown", metavar="RUN", type=click.Path(path_type=Path))
@click.argument("page", required=False, type=click.Path(path_type=Path))
@force_option
def export_page(shown: Path, page: Path | None, force: bool) -> None:
    """Write a run, a scenario or a robot as one HTML page.

    RUN is a run.nc or its folder, a scenario (.toml), or a robot (.urdf). Scenarios and robots are
    shown at their start. PAGE is the file to write. Any browser shows the page, without a network.
    """
    from robsim.page.export import export_html

    path = find_run_file(shown)
    target = choose_output_file(page, f"{shown.stem}.html", force)
    with raise_file_errors(path):
        export_html(_load_shown_object(path), target)
    print_text(f"open {target} in any browser")


def _load_shown_object(path: Path) -> xr.Dataset | Experiment | Robot:
    """Return the run, experiment or robot in a file, by its suffix."""
    if path.suffix == ".toml":
        from robsim.run.experiment import load_scenario

        return load_scenario(path)
    if path.suffix == ".urdf":
        from robsim.robot.robot import Robot

        return Robot.from_urdf(path)
    from robsim.files.netcdf import open_run

    return open_run(path)


@click.command("explain")
@click.argument("run", type=click.Path(path_type=Path))
@click.option("--no-trials", is_flag=True, help="Do not simulate the suggested changes.")
@click.option("--unsealed", is_flag=True, help="Accept a RUN without a valid seal.")
def explain_run_file(run: Path, no_trials: bool, unsealed: bool) -> None:
    """Explain the outcome of a run, and suggest changes.

    RUN is a run.nc or its folder. The explanation names the cause and suggests changes of the
    experiment. The changes are tried by simulation, unless --no-trials is given.
    """
    from robsim.analysis.explanation.explanation import explain
    from robsim.files.netcdf import open_run

    path = find_run_file(run)
    result = open_run(path, unsealed=unsealed)
    with raise_file_errors(path):
        explanation = explain(result, trials=not no_trials)
    print_text(explanation)
