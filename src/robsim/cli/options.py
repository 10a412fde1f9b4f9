"""Options that several commands share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

set_option = click.option(
    "--set",
    "changes",
    multiple=True,
    metavar="KEY=VALUE",
    help="Change a value of the scenario; can be repeated.",
)
Command = TypeVar("Command", bound=Callable[..., Any])
force_option = click.option("--force", is_flag=True, help="Overwrite an existing file.")


def views(command: Command) -> Command:
    """Add the options for the page and the films of a run."""
    for name, kind in (("mp4", "a film"), ("gif", "a film"), ("html", "a page")):
        text = f"Write {kind}, run.{name}{'; needs PyAV' if name == 'mp4' else ''}."
        command = click.option(f"--{name}", is_flag=True, help=text)(command)
    return command


def output(command: Command) -> Command:
    """Add the options for the output folder, for overwriting, and for figures."""
    command = click.option("--no-figures", is_flag=True, help="Write no figures.")(command)
    command = click.option("--force", is_flag=True, help="Overwrite existing results.")(command)
    return click.option(
        "-o", "--output", type=click.Path(path_type=Path), help="Folder for the results."
    )(command)
