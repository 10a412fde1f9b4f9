"""Pictures and meshes of an experiment as they are stored with its runs and beside its texts."""

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
from robsim.declare.context import NoTextError
from robsim.geometry.grey_picture import GreyPicture
from robsim.geometry.picture_spec import get_picture_path
from robsim.geometry.primitives.mesh_spec import get_mesh_path
from robsim.geometry.triangle_mesh import SIGNATURE, TriangleMesh
from robsim.run.experiment_text import write_experiment

StoredValue = GreyPicture | TriangleMesh

SOURCE = "stored data of the run"
MOST_BYTES = 12_000_000  # of all values; the header of a run file has at most 16 MB


@dataclass(frozen=True)
class StoredData:
    """Pictures and meshes by SHA-256, for the reader of a text that names them."""

    stored_data: Mapping[str, StoredValue]


def find_stored_data(experiment: Any) -> dict[str, StoredValue]:
    """Return pictures and meshes of an experiment by SHA-256; InputError if it has no text."""
    found: dict[str, StoredValue] = {}
    try:
        write_experiment(experiment, stored_data=found)
    except NoTextError as reason:
        raise InputError(f"this experiment has no text: {reason}") from None
    return found


def pack_stored_data(values: Iterable[StoredValue]) -> str:
    """Return pictures and meshes as a text, "" for none: JSON of {SHA-256: file in base64}.

    Raise InputError if they take more than a run can store.

    >>> import numpy as np
    >>> picture = GreyPicture(np.zeros((2, 3), dtype=np.uint8))
    >>> unpack_stored_data(pack_stored_data([picture])) == [picture]
    True
    """
    contents = {each.digest: _pack(each) for each in values}
    if (size := sum(map(len, contents.values()))) > MOST_BYTES:
        most = f"a run stores at most {MOST_BYTES / 1e6:.0f} MB of them"
        raise InputError(f"its pictures and meshes take {size / 1e6:.1f} MB; {most}")
    packed = {digest: base64.b64encode(data).decode() for digest, data in contents.items()}
    return json.dumps(packed) if packed else ""


def unpack_stored_data(text: str) -> list[StoredValue]:
    """Return the values in a text; raise FileError if it is invalid or was changed."""
    try:
        packed = json.loads(text or "{}")
        contents = {key: base64.b64decode(data, validate=True) for key, data in packed.items()}
    except (ValueError, TypeError, AttributeError, RecursionError, binascii.Error) as error:
        raise FileError(f"{SOURCE}: not in the form that RobSim writes: {error!s:.200}") from None
    found = []
    for digest, data in contents.items():
        found.append(value := _unpack(data))
        if value.digest != digest:
            raise FileError(
                f"{SOURCE}: sha256 {digest[:12]}... is stored with the data of "
                f"{value.digest[:12]}...: the run was changed"
            )
    return found


def write_stored_value(value: StoredValue, folder: Path) -> Path:
    """Write a picture or mesh beside the texts of a folder that name it by its SHA-256."""
    is_mesh = isinstance(value, TriangleMesh)
    path = (get_mesh_path if is_mesh else get_picture_path)(folder, value.digest)
    if not path.exists():
        write_whole(path, _pack(value))
    return path


def _pack(value: StoredValue) -> bytes:
    """Return the content of a file of a picture or mesh."""
    return value.packed if isinstance(value, TriangleMesh) else value.png


def _unpack(data: bytes) -> StoredValue:
    """Return the picture or mesh of the content of a file."""
    if data.startswith(SIGNATURE):
        return TriangleMesh.unpack(data, SOURCE)
    return GreyPicture.from_png(data, SOURCE)
