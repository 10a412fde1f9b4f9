"""Feedback while a command simulates: progress, warnings, and stops."""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import click

from robsim.base import interrupt
from robsim.base.errors import FileWarning, Interrupted, RankWarning
from robsim.cli.console import print_text


def run_and_save(
    work: Callable[..., Any],
    save: Callable[[Any], object],
    folder: Path,
    report: Callable[[Any], object] | None = None,
) -> Any:
    """Return the result of `work`, once it is saved and reported; else it is printed.

    What was simulated before a stop is saved, and the command ends.
    """
    with interrupt.defer_stops(begun=False) as stops:
        try:
            with print_warnings_as_lines(), progress_bar("simulating") as progress:
                found = work(progress=progress)
        except Interrupted as stop:
            print_text("stopping: saving what was simulated so far", err=True)
            save(stop.run)
            exit_after_stop(folder)
        save(found)
        print_text(f"{found}\nresults: {folder}") if report is None else report(found)
        if stops:
            exit_after_stop(folder)
    return found


def exit_after_stop(folder: Path) -> NoReturn:
    """End the command after a stop, once all that there is has been saved."""
    print_text(f"stopped; what was simulated so far is in {folder}", err=True)
    sys.exit(interrupt.get_exit_status())


@contextmanager
def exit_if_drawing_stops(what: str) -> Iterator[None]:
    """End the command when a stop comes while figures are drawn; the data are written by then."""
    try:
        yield
    except KeyboardInterrupt:
        print_text(f"stopped while drawing; the {what} complete", err=True)
        sys.exit(interrupt.get_exit_status())


@contextmanager
def progress_bar(label: str, runs: int = 0) -> Iterator[Any]:
    """Yield a function of the share done, which shows it on a terminal; None elsewhere.

    Of so many `runs` it shows those that are done, their rate and the time left as well.
    """
    if not sys.stderr.isatty():
        yield None
        return
    begun: list[tuple[float, float]] = []  # when, and which share was done already

    def rate(share: float | None) -> str:
        now = time.monotonic()
        if not begun or share is None or now <= begun[0][0]:
            return ""
        return f"{(share - begun[0][1]) * runs / (now - begun[0][0]):,.0f} runs/s"

    total = runs or 1000
    how: Any = {"show_pos": True, "item_show_func": rate} if runs else {}
    with click.progressbar(length=total, label=label, file=sys.stderr, **how) as shown:

        def show(share: float) -> None:
            if not begun:
                begun.append((time.monotonic(), share))
            shown.update(round(total * share) - shown.pos, share)

        yield show
        show(1.0)


@contextmanager
def print_warnings_as_lines() -> Iterator[None]:
    """Print warnings as lines for the user, without a line of source code."""
    with warnings.catch_warnings(record=True) as caught:
        for kind in (RankWarning, FileWarning):
            warnings.simplefilter("always", kind)
        try:
            yield
        finally:
            for warning in caught:
                print_text(f"warning: {warning.message}", err=True)
