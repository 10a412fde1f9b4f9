"""The command `explain`: print why a run ended as it did."""

from __future__ import annotations

from pathlib import Path

import click

from robsim.base.errors import in_file
from robsim.cli.files import run_file
from robsim.cli.tell import tell


@click.command("explain")
@click.argument("run", type=click.Path(path_type=Path))
@click.option("--no-trials", is_flag=True, help="Only read the run; repeat nothing.")
@click.option("--unsealed", is_flag=True, help="Take a RUN without a right seal for what it says.")
def command(run: Path, no_trials: bool, unsealed: bool) -> None:
    """Explain why RUN, a run.nc or the folder of one, ended as it did, and what to try."""
    from robsim.analysis.explanation.explain import explain as explained
    from robsim.files.netcdf import open_run

    path = run_file(run)
    found = open_run(path, unsealed=unsealed)
    with in_file(path):
        explanation = explained(found, trials=not no_trials)
    tell(explanation)
