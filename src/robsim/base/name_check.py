"""The check of the names of robots, links, cameras and objects."""

from __future__ import annotations

import re

from robsim.base.errors import InputError, format_value

LONGEST_NAME = 64
NAME_PATTERN = rf"[A-Za-z][A-Za-z0-9_-]{{0,{LONGEST_NAME - 1}}}"
_NAME = re.compile(NAME_PATTERN)


def check_name(name: object, what: str) -> str:
    """Return a name if it is safe in files, figures and paths; else raise InputError."""
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise InputError(
            f"{what} {format_value(name)}: a name starts with a letter and has up to "
            f"{LONGEST_NAME} letters, digits, _ or -"
        )
    return name
