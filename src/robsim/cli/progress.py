"""A simulation in front of a user: progress, warnings as lines, and what Ctrl-C leaves."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import click

from robsim.base.errors import Interrupted, RankWarning, RobSimError

STOPPED = 130  # exit status: the shell's number for Ctrl-C


def finished(work: Callable[[Any], Any], save: Callable[[Any], bool], folder: Path) -> Any:
    """What `work` makes with a bar of progress. After Ctrl-C, what there is is saved."""
    try:
        with warnings_as_lines(), _progress() as progress:
            return work(progress)
    except Interrupted as stop:
        click.echo("stopping: saving what was simulated so far", err=True)
        save(stop.run)
        click.echo(f"stopped; what was simulated so far is in {folder}", err=True)
        sys.exit(STOPPED)
    except (RobSimError, KeyboardInterrupt):
        with suppress(OSError):
            folder.rmdir()  # if it is empty: nothing was simulated
        raise


@contextmanager
def drawing(what: str) -> Iterator[None]:
    """Ctrl-C ends the command; the files are there."""
    try:
        yield
    except KeyboardInterrupt:
        click.echo(f"stopped while drawing; the {what} complete", err=True)
        sys.exit(STOPPED)


@contextmanager
def _progress() -> Iterator[Any]:
    """A progress bar on a terminal, silence elsewhere."""
    if not sys.stderr.isatty():
        yield None
        return
    with click.progressbar(length=1000, label="simulating", file=sys.stderr) as bar:

        def show(share: float) -> None:
            bar.update(round(1000 * share) - bar.pos)

        yield show
        show(1.0)


@contextmanager
def warnings_as_lines() -> Iterator[None]:
    """A warning is a line for the user, not a line of our source."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", RankWarning)
        try:
            yield
        finally:
            for warning in caught:
                click.echo(f"warning: {warning.message}", err=True)
