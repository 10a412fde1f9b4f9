"""Pictures in texts: the path of a file, or the SHA-256 of the grey values with or without a file.

A scenario file names the file of a picture, `picture = "cat.png"`. The complete text of a run names
the picture by its SHA-256. The data itself is stored with the run, and beside a scenario file or a
study in the folder `pictures`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from robsim.base.errors import FileError, InputError, check_known, format_value, suggest_names
from robsim.base.file_content import format_relative_path
from robsim.declare.spec import Context, DefineSchema, FieldValue, JSONSchema, Raw, Spec
from robsim.geometry.grey_picture import GreyPicture

FOLDER = "pictures"  # beside a text, with the pictures that it names by their SHA-256 only
KEYS = ("file", "sha256")
DIGEST = "[0-9a-f]{64}"
LONGEST_PATH = 1000
FindPicture = Callable[[str], GreyPicture | None]


@dataclass(frozen=True)
class PictureSpec(Spec):
    """A field with a grey picture: a path or a table in a text, also an array in Python.

    Examples
    --------
    >>> import numpy as np
    >>> PictureSpec().check(np.zeros((2, 3), dtype=np.uint8), "picture").grey.shape
    (2, 3)
    """

    forms: ClassVar[tuple[str, ...]] = ("plain", "table")
    phrase: ClassVar[str] = (
        'the path of a picture, or a table: { file = "cat.png", sha256 = "..." }'
    )
    python_phrase: ClassVar[str] = "the path of a picture, a GreyPicture or an array of uint8"

    def check(self, value: object, what: str) -> GreyPicture:
        if isinstance(value, GreyPicture):
            return value
        if isinstance(value, str | os.PathLike):
            return GreyPicture.from_file(value)
        return GreyPicture(value)  # type: ignore[arg-type]  # checked there

    def read(self, raw: Raw, c: Context) -> FieldValue:
        table = {"file": raw} if isinstance(raw, str) else raw
        if not isinstance(table, Mapping) or not table:
            raise InputError(f"must be {self.words()}, got {format_value(raw)}")
        for key, value in table.items():
            _check_key(key, value)
        try:
            return _find_picture(table.get("file"), table.get("sha256"), c)
        except FileError as error:  # one problem among others of the text
            raise InputError(str(error)) from None

    def write(self, value: Any, c: Context) -> Raw:
        picture: GreyPicture = value
        if "read_origin" in c.facts:  # a short text, which may refer to files
            reference = _refer_to_file(picture, c.facts["folder"])
            if reference is not None:
                return reference
        c.facts.get("pictures", {})[picture.digest] = picture
        return {"sha256": picture.digest}

    def schema(self, define: DefineSchema) -> JSONSchema:
        path = {"type": "string", "minLength": 1, "maxLength": LONGEST_PATH}
        keys = {"file": path, "sha256": {"type": "string", "pattern": f"^{DIGEST}$"}}
        table = {"type": "object", "properties": keys, "additionalProperties": False}
        return {"anyOf": [path, {**table, "minProperties": 1}]}


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
    find: FindPicture = c.facts.get("find_picture", _find_nothing)
    folder = Path(c.facts.get("folder", ""))
    path = folder / (file or "")
    if digest is None:
        return GreyPicture.from_file(path)
    if (stored := find(digest)) is not None:
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


def _find_nothing(digest: str) -> None:
    """Return that no picture is stored."""


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


def _refer_to_file(picture: GreyPicture, folder: Path) -> str | None:
    """Return the path of the file of a picture; None if it has another content now."""
    if not picture.path:
        return None
    try:
        if GreyPicture.from_file(picture.path) != picture:
            return None
    except FileError:
        return None
    return format_relative_path(Path(picture.path), folder)


PICTURE = PictureSpec()
FacePictures = tuple[tuple[str, GreyPicture], ...]


@dataclass(frozen=True)
class FacePicturesSpec(PictureSpec):
    """A field with a picture on every face of a solid, or with pictures by the names of faces.

    A dict is stored as pairs in the order of `names`, so that equal solids have equal hashes.
    """

    names: tuple[str, ...] = ()
    python_phrase: ClassVar[str] = "a picture, or a dict of pictures by the names of faces"

    def check(self, value: object, what: str) -> Any:
        if isinstance(value, tuple):
            value = dict(value)
        if not isinstance(value, Mapping):
            return super().check(value, what)
        for name in value:
            check_known(name, self.names, "no face {}", "faces")
        pairs = [(each, value[each]) for each in self.names if each in value]
        return tuple((name, PICTURE.check(each, f"{what}.{name}")) for name, each in pairs)

    def read(self, raw: Raw, c: Context) -> FieldValue:
        if not isinstance(raw, Mapping) or not raw or raw.keys() & set(KEYS):
            return super().read(raw, c)
        for name in raw:
            check_known(name, self.names, "no face {}", "faces")
        return tuple((each, PICTURE.read(raw[each], c)) for each in self.names if each in raw)

    def write(self, value: Any, c: Context) -> Raw:
        if isinstance(value, GreyPicture):
            return super().write(value, c)
        return {name: PICTURE.write(each, c) for name, each in value}

    def words(self) -> str:
        return f"{self.phrase}, or a table of them by faces, {', '.join(self.names)}"

    def schema(self, define: DefineSchema) -> JSONSchema:
        one = super().schema(define)
        faces = {"type": "object", "properties": dict.fromkeys(self.names, one)}
        every = {**faces, "additionalProperties": False, "minProperties": 1}
        return {"anyOf": [*one["anyOf"], every]}
