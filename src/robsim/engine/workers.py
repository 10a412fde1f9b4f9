"""Threads that simulate chunks of runs, while the main thread waits for a stop.

Short simulations run in the calling thread.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_EXCEPTION, Future, ThreadPoolExecutor, wait
from functools import partial
from typing import Protocol

import numpy as np

from robsim.base import interrupt
from robsim.base.arrays import Array, as_integer
from robsim.base.errors import InputError, format_value
from robsim.base.processors import count_processors
from robsim.engine import thread_pool
from robsim.engine.chunk import ChunkProgress
from robsim.engine.loop import Loop
from robsim.servo.constraints.start_check import check_constrained_start

SHORT = 20_000  # runs times steps: about 10 ms of compiled steps, or 2 s of Python steps

Progress = Callable[[float], None]


class CheckpointStore(Protocol):
    """Interface of a store for the state of loops, which can restore it."""

    @property
    def is_due(self) -> bool:
        """Whether it is time for the next checkpoint."""

    def begin(self, loop: Loop, chunks: list[ChunkProgress]) -> list[ChunkProgress]:
        """Return the stored chunks of a loop, or the passed ones if none are stored."""

    def save(self) -> None:
        """Store the state of all loops that have begun."""


def check_workers(threads: int | None, chunk: int, progress: Progress | None) -> tuple[int, int]:
    """Return the numbers of threads and of runs in a chunk. Raise InputError for a wrong value."""
    check_progress(progress)
    chunk = as_integer(chunk, "chunk", 1)
    return as_integer(count_processors() if threads is None else threads, "threads", 1, 1025), chunk


def advance_loop(
    loop: Loop,
    threads: int | None,
    chunk: int,
    progress: Progress | None,
    checkpoints: CheckpointStore | None = None,
) -> bool:
    """Simulate all runs of a loop; return False if a stop came before their end.

    Checkpoints are written repeatedly, and at a stop.
    """
    threads, chunk = check_workers(threads, chunk, progress)
    loop.controller.check_start(loop.q0)
    check_constrained_start(loop.controller, loop.q0)
    loop.sequence  # noqa: B018 created before threads share it
    runs = len(loop.q0)
    chunk = min(chunk, math.ceil(runs / threads), loop.most_runs_together)
    chunks = [ChunkProgress(np.arange(i, min(i + chunk, runs))) for i in range(0, runs, chunk)]
    if checkpoints:
        chunks = checkpoints.begin(loop, chunks)
    short = len(chunks) == 1 and runs * loop.steps <= SHORT and progress is None
    with interrupt.defer_stops(partial(setattr, loop, "stopped", True)):
        if short and not interrupt.has_foreign_handler():
            _advance_chunk(loop, chunks[0], lambda share: None)
        else:
            _advance_in_threads(loop, threads, chunks, progress, checkpoints)
        finished = all(each.done for each in chunks) and not loop.stopped
        if checkpoints and not finished:
            checkpoints.save()
        loop.leave(chunks)
        return finished


def _advance_chunk(loop: Loop, going: ChunkProgress, done: Callable[[float], None]) -> None:
    """Simulate a chunk in this thread until its end, a stop or a pause.

    Floating-point errors of NumPy are treated as in a new thread, whatever the caller has set.
    """
    with np.errstate(all="warn", under="ignore"):
        loop.advance(going, done)


def _advance_in_threads(
    loop: Loop,
    threads: int,
    chunks: list[ChunkProgress],
    progress: Progress | None,
    checkpoints: CheckpointStore | None,
) -> None:
    """Simulate the chunks in threads, while this thread waits for a stop or a checkpoint."""
    while not (loop.stopped or all(each.done for each in chunks)):
        if loop.paused and checkpoints:
            checkpoints.save()
        loop.paused = False
        with thread_pool.SHARED.borrow(min(threads, len(chunks))) as pool:
            _run_round(loop, pool, threads, chunks, progress, checkpoints)


def _run_round(
    loop: Loop,
    pool: ThreadPoolExecutor,
    threads: int,
    chunks: list[ChunkProgress],
    progress: Progress | None,
    checkpoints: CheckpointStore | None,
) -> None:
    """Let threads advance all chunks until they are done, or stopped or paused."""
    shares = np.array([each.done or each.step / (loop.steps + 1) for each in chunks], dtype=float)
    weights = np.array([len(each.rows) for each in chunks]) / len(loop.q0)
    waiting, jobs = deque(enumerate(chunks)), list[Future[None]]()
    try:
        for _ in range(min(threads, len(chunks))):
            jobs.append(pool.submit(_advance_waiting_chunks, loop, waiting, shares))
        for _ in _poll_jobs(jobs):
            if progress:
                progress(float(shares @ weights))
            if checkpoints and checkpoints.is_due:
                loop.paused = True
    except KeyboardInterrupt:  # from the caller's progress function
        loop.stopped = True
        wait(jobs)
    except BaseException:
        loop.stopped = True  # end the other chunks
        wait(jobs)
        raise


def _advance_waiting_chunks(
    loop: Loop, waiting: deque[tuple[int, ChunkProgress]], shares: Array
) -> None:
    """Simulate one waiting chunk after the other in this thread, and store their shares."""
    while True:
        try:
            i, going = waiting.popleft()
        except IndexError:  # another thread took the last one
            return
        _advance_chunk(loop, going, partial(shares.__setitem__, i))


def _poll_jobs(jobs: list[Future[None]]) -> Iterator[None]:
    """Yield about ten times a second until every job is done; raise the first error of a job."""
    pending = set(jobs)
    while pending:
        done, pending = wait(pending, timeout=0.1, return_when=FIRST_EXCEPTION)
        yield
        for job in done:
            job.result()


def check_progress(progress: object) -> None:
    """Raise InputError unless a value is a function, or None."""
    if progress is not None and not callable(progress):
        raise InputError(
            f"progress: expected a function of the share done, got {format_value(progress)}"
        )
