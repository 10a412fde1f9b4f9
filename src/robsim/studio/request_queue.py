"""The requests of pages that wait for the thread of a session."""

from __future__ import annotations

import queue
from collections.abc import Callable
from contextlib import suppress
from typing import Any

MOST = 1000  # waiting requests; a page that sends more loses some


class RequestQueue:
    """Requests that wait for a session, of which a later one can replace an earlier one.

    `build_key` returns the key of a request; of several waiting requests with equal keys only the
    last one is handled. The thread of the session calls `take`, handles the requests, and calls
    `finish`. Any thread can `put` requests, and `wait` until all of them are handled.
    """

    def __init__(self, build_key: Callable[[dict[str, Any]], Any]) -> None:
        self._build_key, self._taken = build_key, 0
        self._waiting: queue.Queue[dict[str, Any]] = queue.Queue(MOST)

    def put(self, request: dict[str, Any]) -> None:
        """Store a request, unless too many are waiting."""
        with suppress(queue.Full):
            self._waiting.put_nowait(request)

    def take(self, seconds: float) -> list[dict[str, Any]]:
        """Return the waiting requests, the last one of each key; wait for one for some seconds."""
        latest: dict[Any, dict[str, Any]] = {}
        with suppress(queue.Empty):
            request = self._waiting.get(timeout=seconds)
            while True:
                self._taken += 1
                key = self._build_key(request)
                latest.pop(key, None)
                latest[key] = request
                if self._taken >= MOST:
                    break
                request = self._waiting.get_nowait()
        return list(latest.values())

    def finish(self) -> None:
        """Report that the taken requests are handled."""
        for _ in range(self._taken):
            self._waiting.task_done()
        self._taken = 0

    def wait(self, seconds: float) -> None:
        """Wait until all requests are handled, at most for some seconds."""
        done = self._waiting.all_tasks_done
        with done:
            done.wait_for(lambda: not self._waiting.unfinished_tasks, seconds)
