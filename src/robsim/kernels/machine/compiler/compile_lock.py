"""The lock of one process that compiles a kernel while other processes wait for the file."""

import time
import weakref
from contextlib import suppress
from pathlib import Path
from typing import TextIO

LONGEST_WAIT = 20.0  # seconds: longest wait for another process, which may have stopped
LOCK_POLL = 0.01  # seconds between two attempts


class CompileLock:
    """The lock of a file that one process is about to write.

    The constructor acquires the lock, and waits if another process holds it. The lock ends with
    the object or the process. If the system has no file locks (Windows) or the folder is not
    writable, the constructor returns at once, and every process compiles for itself.

    Attributes
    ----------
    waited : bool
        Whether another process held the lock.
    """

    waited = False

    def __init__(self, path: Path) -> None:
        with suppress(ImportError, OSError):
            import fcntl

            path.parent.mkdir(parents=True, exist_ok=True)
            lock_path = path.with_suffix(".lock")
            file = lock_path.open("w")
            weakref.finalize(self, _release, lock_path, file)
            end = time.monotonic() + LONGEST_WAIT
            while time.monotonic() < end:
                with suppress(BlockingIOError):
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    return
                self.waited = True
                time.sleep(LOCK_POLL)


def _release(path: Path, file: TextIO) -> None:
    """Delete and close the file of a lock. At exit this happens before the modules end."""
    with suppress(OSError):
        path.unlink()
    file.close()
