"""Cleanup of the cache: machine code that was not used for a month is deleted."""

import math
import os
import time
from contextlib import suppress
from pathlib import Path

DAY, MONTH = 86400.0, 30 * 86400.0  # seconds
LONGEST_WRITE = 600.0  # seconds: an older draft or lock belongs to a process that was killed
STAMP = "used"  # file: its modification time is the time of the last cleanup


def note_use(file: Path) -> None:
    """Set the modification time of a used file, at most once a day, if it is writable."""
    with suppress(OSError):
        if time.time() - file.stat().st_mtime > DAY:
            os.utime(file)


def clear_old_files(folder: Path) -> None:
    """Delete the old cache files of a folder, at most once a day. Keep all other files."""
    now = time.time()
    with suppress(OSError):
        if abs(now - (folder / STAMP).stat().st_mtime) < DAY:
            return
    with suppress(OSError):
        if folder.is_dir():
            (folder / STAMP).touch()
            for each in os.scandir(folder):
                _delete_if_old(each, now)


def _delete_if_old(each: "os.DirEntry[str]", now: float) -> None:
    """Delete a cache file that is older than files of its suffix are kept."""
    limits = {".nbc": MONTH, ".tmp": LONGEST_WRITE, ".lock": LONGEST_WRITE}
    limit = limits.get(Path(each.name).suffix, math.inf)
    with suppress(OSError):
        is_old = now - each.stat(follow_symlinks=False).st_mtime > limit
        if is_old and each.is_file(follow_symlinks=False):
            os.unlink(each.path)
