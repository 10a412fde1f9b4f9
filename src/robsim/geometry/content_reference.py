"""References of texts to the content of pictures and meshes by its SHA-256.

The data itself is stored with a run, and beside a scenario file or a study in a folder.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Protocol

from robsim.base.errors import FileError, InputError, format_value
from robsim.declare.context import Context, Raw

DIGEST_KEY = "sha256"
DIGEST = "[0-9a-f]{64}"
DIGEST_SCHEMA = {"type": "string", "pattern": f"^{DIGEST}$"}


class Content(Protocol):
    """A value that a text names by its SHA-256."""

    @property
    def digest(self) -> str:
        """The SHA-256 of the value, as 64 hexadecimal digits."""


def check_digest_text(value: Raw) -> None:
    """Raise InputError if the value of the key `sha256` is no SHA-256."""
    if not (isinstance(value, str) and re.fullmatch(DIGEST, value)):
        raise InputError(f"sha256 must be 64 hexadecimal digits, got {format_value(value)}")


def find_stored(digest: str, c: Context, kind: type[Any]) -> Any:
    """Return a stored value of a run, or of the experiment that a text changes; None if absent."""
    with suppress(InputError):  # an experiment without a text
        stored: Mapping[str, Any] = getattr(c.facts.get("known"), "stored_data", {})
        found = stored.get(digest)
        return found if isinstance(found, kind) else None
    return None


def refer_to_content(content: Content, c: Context) -> Raw:
    """Return the text of a value, and add the value to the stored data of the text."""
    c.facts.get("stored_data", {}).setdefault(content.digest, content)
    return {DIGEST_KEY: content.digest}


def check_content(content: Content, expected: str, path: Path, noun: str) -> None:
    """Raise FileError if a file has another content than expected."""
    if content.digest != expected:
        raise FileError(
            f"{path}: the {noun} has changed: expected sha256 {expected[:12]}..., got "
            f"{content.digest[:12]}...; restore the file, or remove sha256 to take its new content"
        )


def make_missing_error(digest: str, path: Path, noun: str) -> FileError:
    """Return the error about data that a text names and that no file contains."""
    return FileError(
        f"the data of the {noun} {digest[:12]}... is missing: there is no {path}; "
        "Experiment.write_stored_data writes it, a run contains it"
    )
