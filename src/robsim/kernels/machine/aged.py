"""Machine code that nobody has used for a month goes, such as that of old sources and versions."""

import math
import os
import time
from contextlib import suppress
from pathlib import Path

DAY, MONTH = 86400.0, 30 * 86400.0  # seconds
LONGEST_WRITE = 600.0  # seconds, after which the file of a process that was killed goes
STAMP = "used"  # a file that is touched when a folder is cleared, at most once a day


def note_use(file: Path) -> None:
    """Touch a file that is used, at most once a day; one that cannot be written stays as it is."""
    with suppress(OSError):
        if time.time() - file.stat().st_mtime > DAY:
            os.utime(file)


def clear_old_files(folder: Path) -> None:
    """Delete what is old in a folder, unless that was done today; what is not ours stays."""
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
    kept = {".nbc": MONTH, ".tmp": LONGEST_WRITE, ".lock": LONGEST_WRITE}.get(
        Path(each.name).suffix, math.inf
    )
    with suppress(OSError):
        old = now - each.stat(follow_symlinks=False).st_mtime > kept
        if old and each.is_file(follow_symlinks=False):
            os.unlink(each.path)
