"""Command `warm`: compile all kernels in advance."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import click

from robsim.base.errors import FileError
from robsim.cli.console import print_text

if TYPE_CHECKING:
    from robsim.cli.warm_workload import WorkloadItem

MOST_PROCESSES = 61  # of a pool on Windows


@click.command("warm")
@click.option(
    "-j",
    "--jobs",
    type=click.IntRange(1, 1000),
    help="Number of processes; one per core by default.",
)
def compile_kernels(jobs: int | None) -> None:
    """Compile all kernels now, so that no later run waits.

    This is useful for the computers of a class. The kernels are stored in the folder
    ROBSIM_CACHE_DIR, or in the cache folder of the user.
    """
    from robsim.base.processors import count_processors
    from robsim.kernels.machine import cache_files
    from robsim.kernels.machine.machine_code import PACKAGE_CODE

    if not PACKAGE_CODE.objects and not cache_files.is_cache_writable():
        raise FileError(f"cannot write {cache_files.CACHE}, the folder for kernels")
    began = time.perf_counter()
    if PACKAGE_CODE.objects:
        compiled, failed = set[str](), list[str]()
    elif PACKAGE_CODE.is_bitcode_readable:
        compiled, failed = _translate_bitcode(jobs or count_processors()), []
    else:
        compiled, failed = _run_workload(jobs or count_processors())
    for each in failed:
        print_text(f"warning: {each}", err=True)
    print_text(_format_compilation_summary(compiled, time.perf_counter() - began))


def _run_workload(jobs: int) -> tuple[set[str], list[str]]:
    """Run the workload; return the compiled files, and the error messages of failed items."""
    import multiprocessing
    import sys
    import tempfile
    from concurrent.futures import ProcessPoolExecutor, as_completed

    from robsim.cli.warm_workload import list_workload

    compiled: set[str] = set()
    failed = []
    spawn = multiprocessing.get_context("spawn")
    with (
        tempfile.TemporaryDirectory() as folder,
        ProcessPoolExecutor(min(jobs, MOST_PROCESSES), spawn, _prepare_worker, (folder,)) as pool,
    ):
        waiting = [pool.submit(compile_for_item, item) for item in list_workload()]
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


def _translate_bitcode(jobs: int) -> set[str]:
    """Translate the bitcode of the package for this processor; return the written files."""
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    from robsim.kernels.machine.machine_code import PACKAGE_CODE, translate_parts

    assert PACKAGE_CODE.bitcode
    parts = sorted(PACKAGE_CODE.bitcode.parts)
    jobs = min(jobs, MOST_PROCESSES)
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, spawn) as pool:
        return set().union(*pool.map(translate_parts, [parts[i::jobs] for i in range(jobs)]))


def _prepare_worker(folder: str) -> None:
    """Set up a worker process that writes to a temporary folder."""
    import os
    import signal
    import warnings

    os.chdir(folder)
    os.environ |= {"MPLBACKEND": "agg", "ROBSIM_QUIET": "1"}
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends it without a message
    warnings.simplefilter("ignore")


def compile_for_item(item: WorkloadItem) -> tuple[set[str], str]:
    """Run one item; return the files of its compiled kernels, and its error message or ""."""
    from robsim.cli.warm_workload import run_workload_item
    from robsim.kernels.machine import cache_files

    before = set(cache_files.SAVED)
    try:
        run_workload_item(item)
        error = ""
    except Exception as reason:  # noqa: BLE001  the other items are compiled nevertheless
        error = f"{' '.join(item)}: {type(reason).__name__}: {reason}"
    return cache_files.SAVED - before, error


def _format_compilation_summary(compiled: set[str], seconds: float) -> str:
    """Return a summary of the compiled kernels and of the cache."""
    from robsim.kernels.machine import cache_files
    from robsim.kernels.machine.machine_code import PACKAGE_CODE

    files = list(cache_files.CACHE.glob("*.nbc"))
    size = sum(path.stat().st_size for path in files) / 1e6
    stored = f"{len(files)} files, {size:.0f} MB, in {cache_files.CACHE}"
    if compiled:
        return f"compiled {len(compiled)} kernels in {seconds:.0f} s; stored: {stored}"
    if PACKAGE_CODE.objects:
        return f"nothing to do: the package has machine code for this processor; {stored}"
    return f"nothing to do: {stored}"
