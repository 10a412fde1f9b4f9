"""Files of arrays with a seal, by which it is known that nobody else has written or changed them.

A file is a line that names the format, the seal (HMAC-SHA-256 of the rest, RFC 2104), the length
of a table in JSON, that table, and the numbers of all arrays.
"""

from __future__ import annotations

import hashlib
import hmac
import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.errors import FileError

FORMAT = b"RobSim checkpoint 1\n"
_SEAL, _LENGTH = 32, 8  # bytes


def sealed(about: Mapping[str, Any], arrays: Sequence[NDArray[Any]], secret: bytes) -> bytes:
    """Return the content of a file that holds a table and arrays.

    >>> content = sealed({"step": 3}, [np.arange(2.0)], b"secret")
    >>> unsealed(content, b"secret", "a file")
    ({'step': 3}, [array([0., 1.])])
    """
    whole = [np.ascontiguousarray(array) for array in arrays]
    shapes = [[array.dtype.str, array.shape] for array in whole]
    table = json.dumps({"about": about, "arrays": shapes}).encode()
    numbers: list[Any] = [array.reshape(-1).view(np.uint8).data for array in whole if array.size]
    parts = [len(table).to_bytes(_LENGTH, "little"), table, *numbers]
    seal = hmac.new(secret, digestmod=hashlib.sha256)
    for part in parts:
        seal.update(part)
    return b"".join([FORMAT, seal.digest(), *parts])


def unsealed(content: bytes, secret: bytes, name: str) -> tuple[Any, list[NDArray[Any]]]:
    """Return the table and the arrays of a file; FileError unless its seal is right."""
    if not content.startswith(FORMAT):
        raise FileError(f"{name} is no checkpoint of this version of RobSim")
    start = len(FORMAT) + _SEAL
    rest = memoryview(content)[start:]
    seal = hmac.new(secret, rest, hashlib.sha256).digest()
    if not hmac.compare_digest(seal, content[len(FORMAT) : start]):
        raise FileError(f"{name} is damaged, or was written by another user or on another machine")
    at = _LENGTH + int.from_bytes(rest[:_LENGTH], "little")
    table = json.loads(bytes(rest[_LENGTH:at]))
    found = []
    for kind, shape in table["arrays"]:
        count = int(np.prod(shape, dtype=np.int64))
        array = np.frombuffer(rest, kind, count, at) if count else np.empty(0, kind)
        found.append(array.reshape(shape).copy())
        at += array.nbytes
    return table["about"], found
