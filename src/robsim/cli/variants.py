"""Schemes on the command line: scenario files and varied values."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from robsim.base.errors import InputError


class Variant(NamedTuple):
    """A scheme: its name, its scenario file, and its changes."""

    name: str
    file: Path
    changes: tuple[str, ...]


def list_variants(files: Sequence[Path], vary: str | None = None) -> list[Variant]:
    """Return one scheme for each file; with `vary` "key=value,value,...", for each file and value.

    The name of a scheme is the stem of the file without `vary`, the value for a single file, and
    both for several files. Equal names are numbered.

    >>> [v.name for v in list_variants([Path("a.toml"), Path("b/a.toml")])]
    ['a', 'a-2']
    >>> [(v.name, *v.changes) for v in list_variants([Path("a.toml")], "task.gain=1,2")]
    [('1', 'task.gain=1'), ('2', 'task.gain=2')]
    """
    schemes: list[Variant] = []
    for file in files:
        for value, changes in _list_value_changes(vary):
            parts = [file.stem] if not value else [value] if len(files) == 1 else [file.stem, value]
            schemes.append(
                Variant(
                    _number_if_taken("-".join(map(_make_filename_safe, parts)), schemes),
                    file,
                    changes,
                )
            )
    return schemes


def _list_value_changes(vary: str | None) -> list[tuple[str, tuple[str, ...]]]:
    """Return (value, changes) for each value; without `vary`, one pair without a change."""
    if vary is None:
        return [("", ())]
    key, equals, text = vary.partition("=")
    values = [value.strip() for value in _split_outside_brackets(text)]
    if not equals or not key.strip() or not all(values):
        raise InputError(
            f"--vary: expected key=value,value, as in task.interaction=current,mean, got {vary!r}"
        )
    return [(value, (f"{key.strip()}={value}",)) for value in values]


def _split_outside_brackets(text: str) -> list[str]:
    """Return the parts of a text between commas outside of brackets, braces and quotes."""
    parts, depth, quote = [""], 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in "\"'":
            quote = letter
        depth += 0 if quote else (letter in "[{") - (letter in "]}")
        if letter == "," and not depth and not quote:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


def _make_filename_safe(text: str) -> str:
    """Return the text with characters that are safe in a file name."""
    return re.sub(r"[^\w.+]+", "-", text).strip("-.")[:60] or "scheme"


def _number_if_taken(name: str, taken: Sequence[Variant]) -> str:
    """Return the name, with a number if it is taken; "comparison" is reserved."""
    names = {variant.name for variant in taken} | {"comparison"}
    numbered = (name if i == 1 else f"{name}-{i}" for i in range(1, len(names) + 2))
    return next(each for each in numbered if each not in names)
