"""Command `explain`: print why a run ended with its outcome."""

from __future__ import annotations

from pathlib import Path

import click

from robsim.base.errors import raise_file_errors
from robsim.cli.console import print_text
from robsim.cli.output_files import find_run_file


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
