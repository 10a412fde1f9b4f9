"""The pictures of an experiment as they are stored with its runs, and beside its texts."""

from __future__ import annotations

import base64
import binascii
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from robsim.base.atomic_files import write_whole
from robsim.base.errors import FileError, InputError
from robsim.declare.spec import NoTextError
from robsim.geometry.grey_picture import GreyPicture
from robsim.geometry.picture_spec import get_picture_path
from robsim.run.experiment_text import write_experiment

SOURCE = "pictures of the run"
MOST_BYTES = 12_000_000  # of all PNG files; the header of a run file has at most 16 MB


@dataclass(frozen=True)
class StoredPictures:
    """Pictures by SHA-256, for the reader of a text that names them."""

    pictures: Mapping[str, GreyPicture]


def find_pictures(experiment: Any) -> dict[str, GreyPicture]:
    """Return the pictures of an experiment by SHA-256; raise InputError if it has no text."""
    found: dict[str, GreyPicture] = {}
    try:
        write_experiment(experiment, pictures=found)
    except NoTextError as reason:
        raise InputError(f"this experiment has no text: {reason}") from None
    return found


def pack_pictures(pictures: Iterable[GreyPicture]) -> str:
    """Return pictures as a text, "" for none: JSON of {SHA-256: PNG file in base64}.

    Raise InputError if they take more than a run can store.

    >>> import numpy as np
    >>> picture = GreyPicture(np.zeros((2, 3), dtype=np.uint8))
    >>> unpack_pictures(pack_pictures([picture])) == [picture]
    True
    """
    contents = {each.digest: each.png for each in pictures}
    if (size := sum(map(len, contents.values()))) > MOST_BYTES:
        most = f"a run stores at most {MOST_BYTES / 1e6:.0f} MB of them"
        raise InputError(f"its pictures take {size / 1e6:.1f} MB as PNG files; {most}")
    packed = {digest: base64.b64encode(png).decode() for digest, png in contents.items()}
    return json.dumps(packed) if packed else ""


def unpack_pictures(text: str) -> list[GreyPicture]:
    """Return the pictures in a text; raise FileError if it is invalid or was changed."""
    try:
        packed = json.loads(text or "{}")
        contents = {key: base64.b64decode(data, validate=True) for key, data in packed.items()}
    except (ValueError, TypeError, AttributeError, RecursionError, binascii.Error) as error:
        raise FileError(f"{SOURCE}: not in the form that RobSim writes: {error!s:.200}") from None
    found = []
    for digest, data in contents.items():
        found.append(picture := GreyPicture.from_png(data, SOURCE))
        if picture.digest != digest:
            raise FileError(
                f"{SOURCE}: sha256 {digest[:12]}... is stored with the data of "
                f"{picture.digest[:12]}...: the run was changed"
            )
    return found


def write_picture(picture: GreyPicture, folder: Path) -> Path:
    """Write a picture beside the texts of a folder that name it by its SHA-256."""
    path = get_picture_path(folder, picture.digest)
    if not path.exists():
        write_whole(path, picture.png)
    return path
