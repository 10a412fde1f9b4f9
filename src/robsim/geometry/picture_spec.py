"""Pictures in texts: the path of a file, or the SHA-256 of the grey values with or without a file.

A scenario file names the file of a picture, `picture = "cat.png"`. The complete text of a run names
the picture by its SHA-256. The data itself is stored with the run, and beside a scenario file or a
study in the folder `pictures`.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

from robsim.base.errors import FileError, InputError, format_value, suggest_names
from robsim.base.file_content import format_relative_path
from robsim.declare.context import Context, FieldValue, Raw
from robsim.declare.spec import Spec, make_expected_error
from robsim.geometry.content_reference import (
    DIGEST_KEY,
    DIGEST_SCHEMA,
    check_content,
    check_digest_text,
    find_stored,
    make_missing_error,
    refer_to_content,
)
from robsim.geometry.grey_picture import GreyPicture

FOLDER = "pictures"  # beside a text, with the pictures that it names by their SHA-256 only
KEYS = ("file", DIGEST_KEY)
LONGEST_PATH = 1000
PATH = {"type": "string", "minLength": 1, "maxLength": LONGEST_PATH}
PICTURE_FILE = {
    "type": "object",
    "properties": {"file": PATH, DIGEST_KEY: DIGEST_SCHEMA},
    "additionalProperties": False,
    "minProperties": 1,
}


class PictureSpec(Spec):
    """A field with a grey picture: a path or a table in a text, also an array in Python.

    Examples
    --------
    >>> import numpy as np
    >>> PICTURE.check(np.zeros((2, 3), dtype=np.uint8), "picture").grey.shape
    (2, 3)
    """

    phrase: ClassVar[str] = 'the path of a picture, or { file = "cat.png", sha256 = "..." }'
    python_phrase: ClassVar[str] = "the path of a picture, a GreyPicture or an array of uint8"
    json: ClassVar[Mapping[str, Any]] = {"anyOf": [PATH, PICTURE_FILE]}

    def check(self, value: object, what: str) -> GreyPicture:
        return open_picture(value)

    def read(self, raw: Raw, c: Context) -> FieldValue:
        return _read_picture(raw, c)

    def write(self, value: object, c: Context) -> Raw:
        return _write_picture(open_picture(value), c)


PICTURE = PictureSpec()


def open_picture(value: Any) -> GreyPicture:
    """Return a picture: itself, the picture of a file, or of an array."""
    if isinstance(value, str | os.PathLike):
        return GreyPicture.from_file(value)
    return value if isinstance(value, GreyPicture) else GreyPicture(value)


def _read_picture(raw: Raw, c: Context) -> GreyPicture:
    """Return the picture of a text; raise InputError if it cannot be found."""
    table = {"file": raw} if isinstance(raw, str) else raw
    if not isinstance(table, Mapping) or not table:
        raise make_expected_error(PictureSpec.phrase, raw)
    for key, value in table.items():
        _check_key(key, value)
    try:
        return _find_picture(table.get("file"), table.get(DIGEST_KEY), c)
    except FileError as error:  # one problem among others of the text
        raise InputError(str(error)) from None


def _write_picture(picture: GreyPicture, c: Context) -> Raw:
    """Return the text of a picture: its file in a short text, or its SHA-256."""
    if "read_origin" in c.facts:  # a short text, which may refer to files
        reference = refer_to_file(picture, c.facts["folder"])
        if reference is not None:
            return reference
    return refer_to_content(picture, c)


def _check_key(key: str, value: Raw) -> None:
    """Raise InputError if the table of a picture has an invalid key or value."""
    if key not in KEYS:
        raise InputError(f"unknown key {format_value(key)}; {suggest_names(key, KEYS, 'keys')}")
    if key == "file" and not (isinstance(value, str) and 0 < len(value) <= LONGEST_PATH):
        raise InputError(f"file must be the path of a picture, got {format_value(value)}")
    if key == DIGEST_KEY:
        check_digest_text(value)


def _find_picture(file: str | None, digest: str | None, c: Context) -> GreyPicture:
    """Return the picture of a digest among the stored ones, or of a file; raise FileError."""
    folder = Path(c.facts.get("folder", ""))
    path = folder / (file or "")
    if digest is None:
        return GreyPicture.from_file(path)
    stored: GreyPicture | None = find_stored(digest, c, GreyPicture)
    if stored is not None:
        return stored if file is None else replace(stored, path=os.path.abspath(path))
    if file is None:
        path = get_picture_path(folder, digest)
        if not path.exists():
            raise make_missing_error(digest, path, "picture")
    found = GreyPicture.from_file(path)
    check_content(found, digest, path, "picture")
    return found if file else replace(found, path="")


def get_picture_path(folder: Path, digest: str) -> Path:
    """Return the path of a picture that a text in a folder names by its SHA-256.

    >>> get_picture_path(Path("cell"), 64 * "a").as_posix()
    'cell/pictures/aaaaaaaaaaaaaaaa.png'
    """
    return folder / FOLDER / f"{digest[:16]}.png"


def refer_to_file(picture: GreyPicture, folder: Path) -> str | None:
    """Return the path of the file of a picture; None if it has another content now."""
    if not picture.path:
        return None
    try:
        if GreyPicture.from_file(picture.path) != picture:
            return None
    except FileError:
        return None
    return format_relative_path(Path(picture.path), folder)
