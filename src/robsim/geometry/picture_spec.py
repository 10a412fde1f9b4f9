"""Pictures in texts: the path of a file, or the SHA-256 of the grey values with or without a file.

A scenario file names the file of a picture, `picture = "cat.png"`. The complete text of a run names
the picture by its SHA-256. The data itself is stored with the run, and beside a scenario file or a
study in the folder `pictures`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar

from robsim.base.errors import FileError, InputError, format_value, suggest_names
from robsim.base.file_content import format_relative_path
from robsim.declare.spec import Context, FieldValue, Raw, Spec, make_expected_error
from robsim.geometry.grey_picture import GreyPicture

FOLDER = "pictures"  # beside a text, with the pictures that it names by their SHA-256 only
PICTURE_KEY = "sha256"
KEYS = ("file", PICTURE_KEY)
DIGEST = "[0-9a-f]{64}"
LONGEST_PATH = 1000
PATH = {"type": "string", "minLength": 1, "maxLength": LONGEST_PATH}
PICTURE_FILE = {
    "type": "object",
    "properties": {"file": PATH, "sha256": {"type": "string", "pattern": f"^{DIGEST}$"}},
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
        return _find_picture(table.get("file"), table.get("sha256"), c)
    except FileError as error:  # one problem among others of the text
        raise InputError(str(error)) from None


def _write_picture(picture: GreyPicture, c: Context) -> Raw:
    """Return the text of a picture: its file in a short text, or its SHA-256."""
    if "read_origin" in c.facts:  # a short text, which may refer to files
        reference = refer_to_file(picture, c.facts["folder"])
        if reference is not None:
            return reference
    found = c.facts.get("pictures", {})
    if not picture.path or picture.digest not in found:  # rather one without a file
        found[picture.digest] = picture
    return {PICTURE_KEY: picture.digest}


def _check_key(key: str, value: Raw) -> None:
    """Raise InputError if the table of a picture has an invalid key or value."""
    if key not in KEYS:
        raise InputError(f"unknown key {format_value(key)}; {suggest_names(key, KEYS, 'keys')}")
    if key == "file" and not (isinstance(value, str) and 0 < len(value) <= LONGEST_PATH):
        raise InputError(f"file must be the path of a picture, got {format_value(value)}")
    if key == "sha256" and not (isinstance(value, str) and re.fullmatch(DIGEST, value)):
        raise InputError(f"sha256 must be 64 hexadecimal digits, got {format_value(value)}")


def _find_picture(file: str | None, digest: str | None, c: Context) -> GreyPicture:
    """Return the picture of a digest among the stored ones, or of a file; raise FileError."""
    folder = Path(c.facts.get("folder", ""))
    path = folder / (file or "")
    if digest is None:
        return GreyPicture.from_file(path)
    if (stored := _find_known(digest, c)) is not None:
        return stored if file is None else replace(stored, path=os.path.abspath(path))
    if file is None:
        path = get_picture_path(folder, digest)
        if not path.exists():
            raise FileError(
                f"the data of the picture {digest[:12]}... is missing: there is no {path}; "
                "Experiment.write_pictures writes it, a run contains it"
            )
    found = GreyPicture.from_file(path)
    _check_digest(found, digest, path)
    return found if file else replace(found, path="")


def _find_known(digest: str, c: Context) -> GreyPicture | None:
    """Return a picture that is stored with a run, or of the experiment that a text changes."""
    with suppress(InputError):  # an experiment without a text
        pictures: Mapping[str, GreyPicture] = getattr(c.facts.get("known"), "pictures", {})
        return pictures.get(digest)
    return None


def _check_digest(picture: GreyPicture, expected: str, path: Path) -> None:
    """Raise FileError if a file has another picture than expected."""
    if picture.digest != expected:
        raise FileError(
            f"{path}: the picture has changed: expected sha256 {expected[:12]}..., got "
            f"{picture.digest[:12]}...; restore the file, or remove sha256 to take its new content"
        )


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
