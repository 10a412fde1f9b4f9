"""What `ros2 bag` compresses: whole files, or messages one by one, by Zstandard."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from robsim.base.errors import FileError

SUFFIX = ".zstd"
MARK = b"\x28\xb5\x2f\xfd"  # with which what is compressed begins, and no message else
LARGEST_FILE = 1 << 34  # bytes of a file, once it is unpacked
LARGEST = 1 << 30  # bytes of a message, likewise
PIECE = 1 << 20  # bytes


def unpacked(file: Path, folder: str) -> Path:
    """Return a file without its compression, which is in a folder then. FileError: damaged."""
    if file.suffix != SUFFIX:
        return file
    decompressor, size, found = _zstd().ZstdDecompressor(), 0, Path(folder, file.stem)
    with open(file, "rb") as packed, open(found, "wb") as plain:
        while not decompressor.eof:
            piece = packed.read(PIECE) if decompressor.needs_input else b""
            if decompressor.needs_input and not piece:
                raise FileError(f"{file.name} is cut off")
            size += plain.write(decompressor.decompress(piece, PIECE))
            if size > LARGEST_FILE:
                raise FileError(f"{file.name}: more than {LARGEST_FILE} bytes, once it is unpacked")
    return found


def message(data: Any) -> Any:
    """Return the bytes of a message without their compression. FileError: damaged, or too many."""
    if bytes(data[:4]) != MARK:
        return data
    decompressor = _zstd().ZstdDecompressor()
    found = decompressor.decompress(bytes(data), LARGEST)
    if not decompressor.eof:
        raise FileError(f"cut off, or more than {LARGEST} bytes, once it is unpacked")
    return found


def _zstd() -> Any:
    from backports import zstd  # which rosbags brings

    return zstd
