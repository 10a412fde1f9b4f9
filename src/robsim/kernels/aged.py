"""Folders of machine code that nobody has used for a month go, such as those of old versions."""

import os
import re
import stat
import time
from contextlib import suppress
from pathlib import Path

DAY, MONTH = 86400.0, 30 * 86400.0  # seconds
WRITING = 600.0  # seconds, after which the file of a process that was killed goes
STAMP = "used"  # a file that is touched when a folder is used, at most once a day
_NAME = re.compile("[0-9a-f]{16}")


def note_use(folder: Path) -> bool:
    """Touch the stamp of a folder, and clear what is old around it, unless that was done today.

    Return whether there is such a folder. One that cannot be written is left as it is.
    """
    now = time.time()
    with suppress(OSError):
        if abs(now - (folder / STAMP).stat().st_mtime) < DAY:
            return True
    if not folder.is_dir():
        return False
    with suppress(OSError):
        (folder / STAMP).touch()
        _clear_drafts(folder, now)
        for other in folder.parent.iterdir():
            if other != folder and _NAME.fullmatch(other.name):
                _clear(other, now)
    return True


def _clear_drafts(folder: Path, now: float) -> None:
    for path in folder.glob("*.tmp"):
        with suppress(OSError):
            if now - path.stat().st_mtime > WRITING:
                path.unlink()


def _clear(folder: Path, now: float) -> None:
    """Delete a folder that holds nothing but old files of ours; another is left as it is."""
    with suppress(OSError):
        if not stat.S_ISDIR(folder.lstat().st_mode):
            return
        found = list(os.scandir(folder))
        if all(_is_ours(each) for each in found) and now - _last_use(folder, found) > MONTH:
            for each in found:
                os.unlink(each.path)
            folder.rmdir()


def _is_ours(each: "os.DirEntry[str]") -> bool:
    own = each.name == STAMP or each.name.endswith((".nbc", ".tmp"))
    return own and each.is_file(follow_symlinks=False)


def _last_use(folder: Path, found: "list[os.DirEntry[str]]") -> float:
    """Return when a folder was used last; versions without stamps only read their files."""
    times = [each.stat(follow_symlinks=False) for each in found]
    return max([folder.stat().st_mtime, *(max(t.st_mtime, t.st_atime) for t in times)])
