"""The command `warm`: compile all kernels in advance."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import click

from robsim.base.errors import FileError
from robsim.cli.tell import tell

if TYPE_CHECKING:
    from robsim.cli.uses import Use


@click.command("warm")
@click.option("-j", "--jobs", type=click.IntRange(1, 1000), help="Processes; one per core.")
def command(jobs: int | None) -> None:
    """Compile all kernels now, as for the computers of a class, so that nobody waits later.

    They are kept in the folder ROBSIM_CACHE_DIR, or in the user's folder for cache files.
    """
    from robsim.base.threads import processors
    from robsim.kernels.machine import store

    if not store.writable():
        raise FileError(f"cannot write {store.CACHE}, where kernels are kept")
    began = time.perf_counter()
    compiled, failed = _done(jobs or processors())
    for each in failed:
        tell(f"warning: {each}", err=True)
    tell(_told(compiled, time.perf_counter() - began))


def _done(jobs: int) -> tuple[set[str], list[str]]:
    """Do all that users do; return what was compiled for it, and what could not be done."""
    import multiprocessing
    import sys
    import tempfile
    from concurrent.futures import ProcessPoolExecutor, as_completed

    from robsim.cli.uses import uses

    compiled: set[str] = set()
    failed = []
    spawn = multiprocessing.get_context("spawn")
    with (
        tempfile.TemporaryDirectory() as folder,
        ProcessPoolExecutor(jobs, spawn, _prepare, (folder,)) as pool,
    ):
        waiting = [pool.submit(compiled_by, use) for use in uses()]
        try:
            with click.progressbar(
                as_completed(waiting), len(waiting), "compiling kernels", file=sys.stderr
            ) as bar:
                for each in bar:
                    names, error = each.result()
                    compiled |= names
                    failed += [error] if error else []
        finally:
            pool.shutdown(cancel_futures=True)
    return compiled, failed


def _prepare(folder: str) -> None:
    """Make a process of its own ready: what examples write goes where it is deleted."""
    import os
    import signal
    import warnings

    os.chdir(folder)
    os.environ |= {"MPLBACKEND": "agg", "ROBSIM_QUIET": "1"}
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends it without a word
    warnings.simplefilter("ignore")


def compiled_by(use: Use) -> tuple[set[str], str]:
    """Do one thing; return the files of the kernels that were compiled for it, and what failed."""
    from robsim.cli.uses import do
    from robsim.kernels.machine import store

    before = set(store.SAVED)
    try:
        do(use)
        error = ""
    except Exception as reason:  # noqa: BLE001  the rest of the list is to be compiled all the same
        error = f"{' '.join(use)}: {type(reason).__name__}: {reason}"
    return store.SAVED - before, error


def _told(compiled: set[str], seconds: float) -> str:
    """Return what was done, and where it is."""
    from robsim.kernels.machine import prebuilt, store

    kept = list(store.CACHE.glob("*.nbc"))
    size = sum(path.stat().st_size for path in kept) / 1e6
    there = f"{len(kept)} files, {size:.0f} MB, in {store.CACHE}"
    if compiled:
        return f"compiled {len(compiled)} kernels in {seconds:.0f} s; kept: {there}"
    if prebuilt.LEVEL:
        return f"nothing to do: what came with the package serves here ({prebuilt.LEVEL}); {there}"
    return f"nothing to do: {there}"
