"""The options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

changes = click.option(
    "--set", "changes", multiple=True, metavar="KEY=VALUE", help="Change a value."
)
force = click.option("--force", is_flag=True, help="Write over an existing file.")


def views(command: Any) -> Any:
    """Add the options for what shows a run in motion."""
    for name, what in (("mp4", "a film; needs PyAV"), ("gif", "a film"), ("html", "a page")):
        text = f"Write run.{name}, {what}."
        command = click.option(f"--{name}", is_flag=True, help=text)(command)
    return command


def output(command: Any) -> Any:
    """Add the options for the output folder, for overwriting, and for figures."""
    command = click.option("--no-figures", is_flag=True, help="Write the run only.")(command)
    command = click.option("--force", is_flag=True, help="Write over an existing run.")(command)
    return click.option(
        "-o", "--output", type=click.Path(path_type=Path), help="Folder for the results."
    )(command)
