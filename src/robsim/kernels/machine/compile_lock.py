"""The claim of one process to compile a kernel, for which other processes wait."""

import time
from contextlib import suppress
from pathlib import Path

LONGEST_WAIT = 20.0  # seconds to wait for another process, which may have stopped
LOCK_POLL = 0.01


class CompileLock:
    """A lock of a file that is to be made: taken, or waited for until another process is done.

    It ends with the object, and with the process. Without locks, as on Windows, or without a place
    to write, every process compiles for itself.
    """

    waited = False  # for another process

    def __init__(self, path: Path) -> None:
        self._file = None
        with suppress(ImportError, OSError):
            import fcntl

            path.parent.mkdir(parents=True, exist_ok=True)
            self._path = path.with_suffix(".lock")
            self._file = self._path.open("w")
            end = time.monotonic() + LONGEST_WAIT
            while time.monotonic() < end:
                with suppress(BlockingIOError):
                    fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    return
                self.waited = True
                time.sleep(LOCK_POLL)

    def __del__(self) -> None:
        if self._file is not None:
            with suppress(OSError):
                self._path.unlink()
            self._file.close()
