"""Containers: arrays of numbers, a header in JSON that describes them, and a checksum of all.

    numbers | header | length of the header (8 bytes) | SHA-256 of all before | MAGIC

Runs, checkpoints, recordings and machine code are stored so. The numbers of a run are a NetCDF-4
file, whose readers do not look beyond its end. The checksum detects damage; it does not prove who
wrote a file. A header, whoever wrote it, can claim no more memory than the numbers take.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from io import BytesIO
from typing import Any, BinaryIO, ClassVar

import numpy as np
from numpy.typing import NDArray

MAGIC = b"\n[RobSim seal 1]\n"
NUMBERS = {"<f8", "<f4", "<i8", "<i4", "<i2", "|i1", "<u8", "<u4", "<u2", "|u1", "|b1"}
MOST_DIMENSIONS = 16
LONGEST_HEADER = 1 << 24  # bytes
_DIGEST, _COUNT = 32, 8  # bytes
_TAIL = _COUNT + _DIGEST + len(MAGIC)
_PIECE = 1 << 20  # bytes that are read at a time


class ContainerError(ValueError):
    """A file is damaged, or `lacking`: it is no container of this kind, or cut short."""

    def __init__(self, message: str, lacking: bool = False):
        super().__init__(message)
        self.lacking = lacking


@dataclass(frozen=True)
class ArrayBlock:
    """An array among the numbers of a container, in one piece from `offset` on."""

    kinds: ClassVar[set[str]] = NUMBERS | {"<c16"}

    dtype: str
    shape: list[int]
    offset: int

    def __post_init__(self) -> None:
        places = [*_check_list(self.shape), self.offset]
        if self.dtype not in self.kinds or not all(map(is_json_count, places)):
            raise ValueError(f"no type and place of numbers: {self.dtype!s:.80}")
        if len(self.shape) > MOST_DIMENSIONS:
            raise ValueError(f"{len(self.shape)} dimensions")

    @property
    def size(self) -> int:
        """The count of numbers."""
        return math.prod(self.shape)

    @property
    def bytes(self) -> int:
        """The bytes that the numbers take."""
        return self.size * np.dtype(self.dtype).itemsize

    def read(self, file: BinaryIO) -> NDArray[Any]:
        """Return the array from an open container. ValueError: the file is too short."""
        is_truth = self.dtype == "|b1"  # for which bytes other than 0 and 1 are invalid
        found = np.empty(self.size, "|i1" if is_truth else self.dtype)
        file.seek(self.offset)
        if file.readinto(found) != found.nbytes:  # type: ignore[attr-defined]
            raise ValueError("it was changed while it was read")
        return (found != 0 if is_truth else found).reshape(self.shape)


def pack_container(header: Any, arrays: Sequence[NDArray[Any]]) -> BytesIO:
    """Return a container of a header and arrays. ValueError: an array is not of numbers.

    >>> unpack_container(pack_container({"step": 3}, [np.arange(2.0)]))
    ({'step': 3}, [array([0., 1.])])
    """
    content, blocks = BytesIO(), []
    for array in arrays:
        dtype = array.dtype.newbyteorder("<").str
        blocks.append(asdict(ArrayBlock(dtype, list(array.shape), content.tell())))
        content.write(np.ascontiguousarray(array, dtype).tobytes())
    append_seal(content, {"header": header, "arrays": blocks})
    return content


def unpack_container(file: BinaryIO) -> tuple[Any, list[NDArray[Any]]]:
    """Return the header and the arrays of a container. ContainerError: it is none, or damaged."""
    size, told = read_header(file)
    try:
        blocks = [ArrayBlock(**each) for each in _check_list(told["arrays"])]
        check_blocks_fit(blocks, size)
        return told["header"], [block.read(file) for block in blocks]
    except (ValueError, TypeError, KeyError) as error:
        raise ContainerError(f"has a header that fits no numbers: {error!s:.200}", True) from None


def check_blocks_fit(blocks: Sequence[ArrayBlock], size: int) -> None:
    """Raise ValueError unless all blocks fit into so many bytes, and none twice."""
    if any(block.offset + block.bytes > size for block in blocks):
        raise ValueError("a variable goes beyond the end")
    if sum(block.bytes for block in blocks) > size:
        raise ValueError("the variables are larger than the file")


def append_seal(content: BytesIO, header: object) -> None:
    """Append the header and the checksum to numbers. ValueError: the header cannot be written."""
    text = json.dumps(header, ensure_ascii=False, separators=(",", ":")).encode()
    if len(text) > LONGEST_HEADER:
        raise ValueError(f"its names, texts and attributes take more than {LONGEST_HEADER} bytes")
    content.seek(0, os.SEEK_END)
    content.write(text + len(text).to_bytes(_COUNT, "little"))
    content.write(hashlib.sha256(content.getbuffer()).digest() + MAGIC)
    content.seek(0)


def read_header(file: BinaryIO) -> tuple[int, Any]:
    """Return how many bytes the numbers take, and the header. ContainerError: damaged."""
    size = file.seek(0, os.SEEK_END)
    file.seek(max(size - _TAIL, 0))
    tail = file.read(_TAIL)
    if len(tail) < _TAIL or not tail.endswith(MAGIC):
        raise ContainerError("has no seal: it is of another program or version, or cut short", True)
    if _checksum(file, size - _DIGEST - len(MAGIC)) != tail[_COUNT : _COUNT + _DIGEST]:
        raise ContainerError("was changed: its bytes are not those that were written")
    length = int.from_bytes(tail[:_COUNT], "little")
    if length > min(LONGEST_HEADER, size - _TAIL):
        raise ContainerError(f"has a seal with an index of {length} bytes")
    file.seek(size - _TAIL - length)
    return size - _TAIL - length, _parse_header(file.read(length))


def is_json_count(value: Any) -> bool:
    """Return whether a value of JSON is a count."""
    return type(value) is int and 0 <= value < 1 << 62


def _checksum(file: BinaryIO, size: int) -> bytes:
    """Return the SHA-256 of the first bytes of a file."""
    found = hashlib.sha256()
    file.seek(0)
    while size > 0 and (piece := file.read(min(_PIECE, size))):
        found.update(piece)
        size -= len(piece)
    return found.digest()


def _parse_header(text: bytes) -> Any:
    try:
        header = json.loads(text.decode(), object_pairs_hook=_make_unique_dict)
        json.dumps(header, ensure_ascii=False).encode()  # half a character could not be printed
    except (ValueError, RecursionError) as error:
        raise ContainerError(f"has a seal whose index is no JSON: {error!s:.200}") from None
    return header


def _make_unique_dict(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        raise ValueError("a name occurs twice")
    return found


def _check_list(value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise TypeError(f"expected a list, got {value!r:.80}")
    return value
