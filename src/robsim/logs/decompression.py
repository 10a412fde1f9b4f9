"""Decompression of bags: `ros2 bag` compresses files, messages or chunks, with Zstandard or LZ4.

Data of a few kilobytes can describe gigabytes. At most RATIO times the compressed size is
decompressed, a piece at a time; logs of a robot are compressed less than 100 times.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

from robsim.base.errors import FileError
from robsim.base.file_content import open_regular_file

ZSTD_MODULE = "compression.zstd" if sys.version_info >= (3, 14) else "backports.zstd"
SUFFIX = ".zstd"
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"  # first bytes of compressed data, which no message begins with
BAG_MAGICS = (b"\x89MCAP0\r\n", b"SQLite format 3\0")  # first bytes of decompressed files
LARGEST_FILE = 1 << 34  # bytes of a decompressed file
LARGEST = 1 << 30  # bytes of a decompressed message or chunk
RATIO, FLOOR = 1000, 1 << 24  # largest ratio of decompression, and bytes that are always allowed
PIECE = 1 << 20  # bytes read and decompressed at a time


def decompress_file(file: Path, folder: str) -> Path:
    """Return a file decompressed into a folder, or the file itself.

    Raise FileError if it is damaged or too large, or if its first bytes are not of a bag.
    """
    if file.suffix != SUFFIX:
        return file
    target = Path(folder, file.stem)
    limit = _find_limit(file.stat().st_size, LARGEST_FILE)
    with open_regular_file(file, "a bag") as packed, open(target, "wb") as output:
        pieces = _decompress_pieces(packed, "zstd", file.name, limit)
        first = next(pieces, b"")
        if not first.startswith(BAG_MAGICS):
            raise FileError(f"{file.name}: the decompressed file is not a bag, or is damaged")
        output.write(first)
        output.writelines(pieces)
    return target


def decompress_message(data: Any) -> Any:
    """Return the bytes of a message, decompressed; raise FileError if damaged or too large."""
    if bytes(data[:4]) != ZSTD_MAGIC:
        return data
    limit = _find_limit(len(data), LARGEST)
    return b"".join(_decompress_pieces(BytesIO(data), "zstd", "a message", limit))


def decompress_chunk(file: BinaryIO, packed: int, compression: str, what: str) -> Iterator[bytes]:
    """Yield the pieces of a chunk of `packed` bytes at the position of a file.

    Raise FileError if the chunk is damaged or too large, or its compression is unknown.
    """
    if compression not in ("", "zstd", "lz4"):
        raise FileError(f"{what} has an unknown compression")
    limit = _find_limit(packed, LARGEST)
    source = _FilePart(file, packed)
    if compression:
        yield from _decompress_pieces(source, compression, what, limit)
        return
    if packed > LARGEST:
        raise FileError(f"{what} has {packed} bytes; at most {LARGEST} are read")
    while piece := source.read(PIECE):
        yield piece


class _FilePart:
    """A part of a file, of some bytes from its present position."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file, self._left = file, size

    def read(self, count: int) -> bytes:
        """Return at most `count` bytes; none at the end of the part."""
        piece = self._file.read(min(count, self._left))
        self._left -= len(piece)
        return piece


def _find_limit(packed: int, largest: int) -> int:
    """Return the largest size of decompressed data of `packed` bytes."""
    return min(max(RATIO * packed, FLOOR), largest)


def _decompress_pieces(
    source: BinaryIO | _FilePart, compression: str, what: str, limit: int
) -> Iterator[bytes]:
    """Yield the decompressed pieces of a source of one or more frames.

    Raise FileError if it is truncated, or has more than `limit` bytes when decompressed.
    """
    decompressor, size = _make_decompressor(compression), 0
    while True:
        packed = b""
        if decompressor.eof:
            packed = decompressor.unused_data or source.read(PIECE)
            if not packed:
                return
            decompressor = _make_decompressor(compression)
        elif decompressor.needs_input:
            packed = source.read(PIECE)
            if not packed:
                raise FileError(f"{what} is truncated")
        piece = decompressor.decompress(packed, PIECE)
        size += len(piece)
        if size > limit:
            raise FileError(f"{what} has more than {limit} bytes when decompressed")
        yield piece


def _make_decompressor(compression: str) -> Any:
    """Return a decompressor of pieces, of a library that rosbags depends on."""
    if compression == "lz4":
        return import_module("lz4.frame").LZ4FrameDecompressor()
    return import_module(ZSTD_MODULE).ZstdDecompressor()
