"""Containers: arrays of numbers, a JSON header that describes them, and a checksum.

    numbers | header | length of the header (8 bytes) | SHA-256 of the preceding bytes | MAGIC

Runs, checkpoints, recordings and machine code are stored in this format. The numbers of a run are a
NetCDF-4 file; its readers ignore bytes after its end. The checksum detects damage but does not
authenticate a file. Arrays that together exceed the
size of the file are rejected, so a damaged header cannot exhaust the memory.
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
_PIECE = 1 << 20  # bytes per read


class ContainerError(ValueError):
    """Error for a file that is damaged or is no container.

    `is_incomplete` is true if the file is no container of this version, or is cut short.
    """

    def __init__(self, message: str, is_incomplete: bool = False):
        super().__init__(message)
        self.is_incomplete = is_incomplete


@dataclass(frozen=True)
class ArrayBlock:
    """The element type, the shape and the first byte (`offset`) of an array in a container."""

    kinds: ClassVar[set[str]] = NUMBERS | {"<c16"}

    dtype: str
    shape: list[int]
    offset: int

    def __post_init__(self) -> None:
        counts = [*_check_list(self.shape), self.offset]
        if self.dtype not in self.kinds or not all(map(is_json_count, counts)):
            raise ValueError(f"invalid type or place of numbers: {self.dtype!s:.80}")
        if len(self.shape) > MOST_DIMENSIONS:
            raise ValueError(f"{len(self.shape)} dimensions")

    @property
    def size(self) -> int:
        """The number of elements."""
        return math.prod(self.shape)

    @property
    def bytes(self) -> int:
        """The size of the numbers in bytes."""
        return self.size * np.dtype(self.dtype).itemsize

    def read(self, file: BinaryIO) -> NDArray[Any]:
        """Return the array from an open container; ValueError if the file is too short."""
        is_truth = self.dtype == "|b1"  # bytes other than 0 and 1 would be invalid
        array = np.empty(self.size, "|i1" if is_truth else self.dtype)
        file.seek(self.offset)
        if file.readinto(array) != array.nbytes:  # type: ignore[attr-defined]
            raise ValueError("it was changed while it was read")
        return (array != 0 if is_truth else array).reshape(self.shape)


def pack_container(header: Any, arrays: Sequence[NDArray[Any]]) -> BytesIO:
    """Return a container of a header and arrays; ValueError if an array is not numeric.

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
    """Return the header and the arrays of a container; ContainerError if it is not valid."""
    size, content = read_header(file)
    try:
        blocks = [ArrayBlock(**each) for each in _check_list(content["arrays"])]
        check_blocks_fit(blocks, size)
        return content["header"], [block.read(file) for block in blocks]
    except (ValueError, TypeError, KeyError) as error:
        raise ContainerError(f"has a header that is not valid: {error!s:.200}", True) from None


def check_blocks_fit(blocks: Sequence[ArrayBlock], size: int) -> None:
    """Raise ValueError if a block ends after `size` bytes, or all blocks together are larger."""
    if any(block.offset + block.bytes > size for block in blocks):
        raise ValueError("a variable goes beyond the end")
    if sum(block.bytes for block in blocks) > size:
        raise ValueError("the variables are larger than the file")


def append_seal(content: BytesIO, header: object) -> None:
    """Append the header and the checksum to numbers; ValueError if the header is too long."""
    text = json.dumps(header, ensure_ascii=False, separators=(",", ":")).encode()
    if len(text) > LONGEST_HEADER:
        raise ValueError(f"its names, texts and attributes take more than {LONGEST_HEADER} bytes")
    content.seek(0, os.SEEK_END)
    content.write(text + len(text).to_bytes(_COUNT, "little"))
    content.write(hashlib.sha256(content.getbuffer()).digest() + MAGIC)
    content.seek(0)


def read_header(file: BinaryIO) -> tuple[int, Any]:
    """Return the size of the numbers in bytes, and the header; ContainerError if not valid."""
    size = file.seek(0, os.SEEK_END)
    file.seek(max(size - _TAIL, 0))
    tail = file.read(_TAIL)
    if len(tail) < _TAIL or not tail.endswith(MAGIC):
        raise ContainerError("has no seal: it is of another program or version, or cut short", True)
    if _checksum(file, size - _DIGEST - len(MAGIC)) != tail[_COUNT : _COUNT + _DIGEST]:
        raise ContainerError("was changed: its checksum does not match")
    length = int.from_bytes(tail[:_COUNT], "little")
    if length > min(LONGEST_HEADER, size - _TAIL):
        raise ContainerError(f"has a seal with an index of {length} bytes")
    file.seek(size - _TAIL - length)
    return size - _TAIL - length, _parse_header(file.read(length))


def is_json_count(value: Any) -> bool:
    """Return whether a JSON value is a nonnegative integer below 2^62."""
    return type(value) is int and 0 <= value < 1 << 62


def _checksum(file: BinaryIO, size: int) -> bytes:
    """Return the SHA-256 of the first bytes of a file."""
    digest = hashlib.sha256()
    file.seek(0)
    while size > 0 and (piece := file.read(min(_PIECE, size))):
        digest.update(piece)
        size -= len(piece)
    return digest.digest()


def _parse_header(text: bytes) -> Any:
    try:
        header = json.loads(text.decode(), object_pairs_hook=_make_unique_dict)
        json.dumps(header, ensure_ascii=False).encode()  # rejects lone surrogates
    except (ValueError, RecursionError) as error:
        raise ContainerError(f"has a seal with an index that is not JSON: {error!s:.200}") from None
    return header


def _make_unique_dict(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        raise ValueError("a name occurs twice")
    return table


def _check_list(value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise TypeError(f"expected a list, got {value!r:.80}")
    return value
