"""Decompression of bags: `ros2 bag` compresses files or single messages with Zstandard."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robsim.base.errors import FileError

SUFFIX = ".zstd"
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"  # first bytes of compressed data, which no message begins with
LARGEST_FILE = 1 << 34  # bytes of a decompressed file
LARGEST = 1 << 30  # bytes of a decompressed message
CHUNK_BYTES = 1 << 20  # bytes read at a time


def decompress_file(file: Path, folder: str) -> Path:
    """Return a file decompressed into a folder, or the file itself; raise FileError if damaged."""
    if file.suffix != SUFFIX:
        return file
    decompressor, size, target = _import_zstd().ZstdDecompressor(), 0, Path(folder, file.stem)
    with open(file, "rb") as packed, open(target, "wb") as output:
        while not decompressor.eof:
            piece = packed.read(CHUNK_BYTES) if decompressor.needs_input else b""
            if decompressor.needs_input and not piece:
                raise FileError(f"{file.name} is truncated")
            size += output.write(decompressor.decompress(piece, CHUNK_BYTES))
            if size > LARGEST_FILE:
                raise FileError(f"{file.name}: more than {LARGEST_FILE} bytes when decompressed")
    return target


def decompress_message(data: Any) -> Any:
    """Return the bytes of a message, decompressed; raise FileError if damaged or too large."""
    if bytes(data[:4]) != ZSTD_MAGIC:
        return data
    decompressor = _import_zstd().ZstdDecompressor()
    payload = decompressor.decompress(bytes(data), LARGEST)
    if not decompressor.eof:
        raise FileError(f"truncated, or more than {LARGEST} bytes when decompressed")
    return payload


def _import_zstd() -> Any:
    """Return the module of Zstandard."""
    from backports import zstd  # a dependency of rosbags

    return zstd
