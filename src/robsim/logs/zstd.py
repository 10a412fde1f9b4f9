"""What `ros2 bag` compresses: whole files, or messages one by one, by Zstandard."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robsim.base.errors import FileError

SUFFIX = ".zstd"
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"  # with which what is compressed begins, and no message else
LARGEST_FILE = 1 << 34  # bytes of a file, once it is unpacked
LARGEST = 1 << 30  # bytes of a message, likewise
CHUNK_BYTES = 1 << 20  # bytes


def decompress_file(file: Path, folder: str) -> Path:
    """Return a file without its compression, which is in a folder then. FileError: damaged."""
    if file.suffix != SUFFIX:
        return file
    decompressor, size, found = _import_zstd().ZstdDecompressor(), 0, Path(folder, file.stem)
    with open(file, "rb") as packed, open(found, "wb") as plain:
        while not decompressor.eof:
            piece = packed.read(CHUNK_BYTES) if decompressor.needs_input else b""
            if decompressor.needs_input and not piece:
                raise FileError(f"{file.name} is cut off")
            size += plain.write(decompressor.decompress(piece, CHUNK_BYTES))
            if size > LARGEST_FILE:
                raise FileError(f"{file.name}: more than {LARGEST_FILE} bytes, once it is unpacked")
    return found


def decompress_message(data: Any) -> Any:
    """Return the bytes of a message without their compression. FileError: damaged, or too many."""
    if bytes(data[:4]) != ZSTD_MAGIC:
        return data
    decompressor = _import_zstd().ZstdDecompressor()
    found = decompressor.decompress(bytes(data), LARGEST)
    if not decompressor.eof:
        raise FileError(f"cut off, or more than {LARGEST} bytes, once it is unpacked")
    return found


def _import_zstd() -> Any:
    from backports import zstd  # which rosbags brings

    return zstd
