"""Threads that all simulations of a process share."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import RLock

from robsim.base.processors import count_processors

KEPT = 2  # largest number of threads for each processor that wait for the next simulation
MOST = 1 << 20  # threads; a thread starts only if no other is idle, so a nested call never waits


class ThreadPool:
    """Threads that wait for work between two simulations.

    Idle threads end before a fork, because a child process has no copy of them, and with the
    process.
    """

    def __init__(self) -> None:
        self._lock = RLock()
        self._executor: ThreadPoolExecutor | None = None
        self._users = 0

    @contextmanager
    def borrow(self, threads: int) -> Iterator[ThreadPoolExecutor]:
        """Yield the executor for a number of threads, which live until the end of the block.

        Many threads end with the block, so that one simulation does not keep them for the process.
        """
        with self._lock:
            self._users += 1
            executor = self._executor = self._executor or ThreadPoolExecutor(MOST, "robsim")
        try:
            yield executor
        finally:
            with self._lock:
                self._users -= 1
            if threads > KEPT * count_processors():
                self.end_idle_threads()

    def end_idle_threads(self) -> None:
        """End all threads, unless a simulation uses them."""
        with self._lock:
            if self._executor and not self._users:
                self._executor.shutdown()
                self._executor = None

    def forget(self) -> None:
        """Forget the threads of the parent process."""
        ThreadPool.__init__(self)


SHARED = ThreadPool()

if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=SHARED.end_idle_threads, after_in_child=SHARED.forget)
