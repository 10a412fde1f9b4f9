"""The seal at the end of a file: an index of what the file holds, and a checksum of all of it.

    content | index (JSON) | length of the index (8 bytes) | SHA-256 of all before | MAGIC

Readers of the content, such as HDF5, do not look beyond its end.
"""

from __future__ import annotations

import hashlib
import json
import os
from io import BytesIO
from typing import Any, BinaryIO

MAGIC = b"\n[RobSim seal 1]\n"
LONGEST_INDEX = 1 << 24  # bytes
_DIGEST, _COUNT = 32, 8  # bytes
_TAIL = _COUNT + _DIGEST + len(MAGIC)
_PIECE = 1 << 20  # bytes that are read at a time


class SealError(Exception):
    """The seal of a file is not there, not right, or not as RobSim writes it."""

    def __init__(self, message: str, lacking: bool = False):
        super().__init__(message)
        self.lacking = lacking


def put_seal(content: BytesIO, index: object) -> None:
    """Append the seal to a content. ValueError: the index is too long, or has odd characters."""
    text = json.dumps(index, ensure_ascii=False, separators=(",", ":")).encode()
    if len(text) > LONGEST_INDEX:
        raise ValueError(f"its names, texts and attributes take more than {LONGEST_INDEX} bytes")
    content.seek(0, os.SEEK_END)
    content.write(text + len(text).to_bytes(_COUNT, "little"))
    content.write(hashlib.sha256(content.getbuffer()).digest() + MAGIC)


def checked(file: BinaryIO) -> tuple[int, Any]:
    """Return the size of the content of a file, and the index. SealError: its seal is not right."""
    size = file.seek(0, os.SEEK_END)
    file.seek(max(size - _TAIL, 0))
    tail = file.read(_TAIL)
    if len(tail) < _TAIL or not tail.endswith(MAGIC):
        raise SealError("has no seal: it is of another program or version, or cut short", True)
    if _checksum(file, size - _DIGEST - len(MAGIC)) != tail[_COUNT : _COUNT + _DIGEST]:
        raise SealError("was changed: its bytes are not those that were written")
    length = int.from_bytes(tail[:_COUNT], "little")
    if length > min(LONGEST_INDEX, size - _TAIL):
        raise SealError(f"has a seal with an index of {length} bytes")
    file.seek(size - _TAIL - length)
    return size - _TAIL - length, _parsed(file.read(length))


def _checksum(file: BinaryIO, size: int) -> bytes:
    """Return the SHA-256 of the first bytes of a file."""
    found = hashlib.sha256()
    file.seek(0)
    while size > 0 and (piece := file.read(min(_PIECE, size))):
        found.update(piece)
        size -= len(piece)
    return found.digest()


def _parsed(text: bytes) -> Any:
    try:
        index = json.loads(text.decode(), object_pairs_hook=_unrepeated)
        json.dumps(index, ensure_ascii=False).encode()  # half a character could not be printed
    except (ValueError, RecursionError) as error:
        raise SealError(f"has a seal whose index is no JSON: {error!s:.200}") from None
    return index


def _unrepeated(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a name occurs twice")
    return found
