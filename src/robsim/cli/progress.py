"""Output while a command simulates: progress, warnings, and interrupts."""

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
    """Call `work`, save and report its result, and return it; by default it is printed.

    After an interrupt, the results so far are saved, and the command ends.
    """
    with interrupt.defer_stops(begun=False) as stops:
        try:
            with print_warnings_as_lines(), progress_bar("simulating") as progress:
                result = work(progress=progress)
        except Interrupted as stop:
            print_text("stopping: saving what was simulated so far", err=True)
            save(stop.run)
            exit_after_stop(folder)
        save(result)
        print_text(f"{result}\nresults: {folder}") if report is None else report(result)
        if stops:
            exit_after_stop(folder)
    return result


def exit_after_stop(folder: Path) -> NoReturn:
    """End the command after an interrupt; all results are saved."""
    print_text(f"stopped; what was simulated so far is in {folder}", err=True)
    sys.exit(interrupt.get_exit_status())


@contextmanager
def exit_if_drawing_stops(data: str) -> Iterator[None]:
    """End the command if an interrupt arrives during drawing; the data are already saved."""
    try:
        yield
    except KeyboardInterrupt:
        print_text(f"stopped while drawing; the {data} complete", err=True)
        sys.exit(interrupt.get_exit_status())


@contextmanager
def progress_bar(label: str, runs: int = 0) -> Iterator[Any]:
    """Yield a function that shows the completed share on a terminal; None without a terminal.

    If `runs` is given, it shows the number of completed runs, their rate and the remaining time.
    """
    if not sys.stderr.isatty():
        yield None
        return
    first: list[tuple[float, float]] = []  # time and share of the first call

    def rate(share: float | None) -> str:
        now = time.monotonic()
        if not first or share is None or now <= first[0][0]:
            return ""
        return f"{(share - first[0][1]) * runs / (now - first[0][0]):,.0f} runs/s"

    total = runs or 1000
    how: Any = {"show_pos": True, "item_show_func": rate} if runs else {}
    with click.progressbar(length=total, label=label, file=sys.stderr, **how) as progressbar:

        def show(share: float) -> None:
            if not first:
                first.append((time.monotonic(), share))
            progressbar.update(round(total * share) - progressbar.pos, share)

        yield show
        show(1.0)


@contextmanager
def print_warnings_as_lines() -> Iterator[None]:
    """Print warnings as single lines, without source code."""
    with warnings.catch_warnings(record=True) as caught:
        for kind in (RankWarning, FileWarning):
            warnings.simplefilter("always", kind)
        try:
            yield
        finally:
            for warning in caught:
                print_text(f"warning: {warning.message}", err=True)
