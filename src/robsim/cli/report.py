"""How a run went, in a few lines."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from robsim.run.outcome import Outcome

if TYPE_CHECKING:
    import xarray as xr


def report(result: xr.Dataset, folder: Path) -> None:
    """Print outcome, time and final error; of a batch, how many ended in which way."""
    if "run" in result.dims:
        counts = [(o, int((result.outcome == o).sum())) for o in Outcome]
        for outcome, count in counts:
            if count:
                click.echo(f"{count:7} {outcome.name}")
    else:
        click.echo(f"outcome      {Outcome(int(result.outcome)).message}")
        if int(result.outcome) != Outcome.CONVERGED and result.sizes["mark"]:
            click.echo(f"why          robsim explain {folder}")
        click.echo(f"time         {float(result.end_time):.2f} s")
        away = float(result.pixel_error)
        if not math.isnan(away):  # a goal given as numbers has no image
            click.echo(f"final error  {away:.3g} px")
        click.echo(f"path length  {100 * float(result.path_length):.2f} cm")
    click.echo(f"results      {folder}")
