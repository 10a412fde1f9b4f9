"""Threads that take chunks of runs while the main one waits for Ctrl-C; short work needs none."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait

import numpy as np
from numpy.typing import NDArray

from robsim.base import interrupt
from robsim.base.arrays import Array, whole
from robsim.base.errors import InputError, said
from robsim.base.threads import processors
from robsim.run.loop import Loop

SHORT = 2000  # runs times steps: some 10 ms of compiled steps, or 0.2 s of those in Python

Progress = Callable[[float], None]


def advance(loop: Loop, threads: int | None, chunk: int, progress: Progress | None) -> bool:
    """Simulate all runs of a loop; return False if Ctrl-C stopped it."""
    check_progress(progress)
    chunk = whole(chunk, "chunk", 1)
    threads = whole(processors() if threads is None else threads, "threads", 1, 1025)
    loop.controller.check_start(loop.q0)
    loop.sequence  # noqa: B018 made once, before threads share it
    runs = len(loop.q0)
    chunk = min(chunk, math.ceil(runs / threads))
    short = chunk == runs and runs * loop.steps <= SHORT and progress is None
    if short and not interrupt.is_others():
        return _alone(loop)
    chunks = [np.arange(i, min(i + chunk, runs)) for i in range(0, runs, chunk)]
    return _work(loop, threads, chunks, progress)


def _alone(loop: Loop) -> bool:
    """Simulate all runs in this thread; return False if Ctrl-C came, which ends them after a step.

    NumPy's errors are warnings or ignored as in a new thread, whatever the caller has set.
    """

    def stop() -> None:
        if loop.stopped:
            raise KeyboardInterrupt
        loop.stopped = True

    with interrupt.caught(stop), np.errstate(all="warn", under="ignore"):
        loop.advance(np.arange(len(loop.q0)), lambda share: None)
    return not loop.stopped


def _work(
    loop: Loop, threads: int, chunks: list[NDArray[np.int64]], progress: Progress | None
) -> bool:
    """Let threads take chunks while this one waits for Ctrl-C; return False if it came."""
    shares = np.zeros(len(chunks))
    weights = np.array([len(rows) for rows in chunks]) / len(loop.q0)
    jobs: list[Future[None]] = []
    with ThreadPoolExecutor(min(threads, len(chunks))) as pool:
        try:
            for i, rows in enumerate(chunks):
                jobs.append(pool.submit(loop.advance, rows, _cell(shares, i)))
            for _ in _until_done(jobs):
                if progress:
                    progress(float(shares @ weights))
        except KeyboardInterrupt:
            loop.stopped = True
            wait(jobs)
            return False
        finally:
            loop.stopped = True  # after an error in one chunk the others need not go on
    for job in jobs:
        job.result()
    return True


def _cell(shares: Array, i: int) -> Callable[[float], None]:
    def put(share: float) -> None:
        shares[i] = share

    return put


def _until_done(jobs: list[Future[None]]) -> Iterator[None]:
    """Yield about ten times a second until every job is done or one has failed."""
    pending = set(jobs)
    while pending:
        done, pending = wait(pending, timeout=0.1, return_when=FIRST_EXCEPTION)
        yield
        if any(job.exception() for job in done):
            return


def check_progress(progress: object) -> None:
    """Raise InputError unless a value is a function, or None."""
    if progress is not None and not callable(progress):
        raise InputError(f"progress: expected a function of the share done, got {said(progress)}")
