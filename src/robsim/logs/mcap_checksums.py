"""Checksums of MCAP files: they are verified before a file is read, and added to written files.

A file has records of an opcode (1 byte), a length (8 bytes) and content, between two magic numbers.
Three kinds of records have CRC-32 checksums, which are zero if they were not computed: Chunk (of
its decompressed records), DataEnd (of the file before it) and Footer (of the summary).
Source: MCAP format specification, mcap.dev/spec.
"""

from __future__ import annotations

import struct
from binascii import crc32
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from robsim.base.errors import FileError
from robsim.logs import decompression

MAGIC = b"\x89MCAP0\r\n"
FOOTER, CHUNK, DATA_END = 0x02, 0x06, 0x0F  # opcodes
HEAD = struct.Struct("<BQ")  # opcode and length of a record
CHUNK_HEAD = struct.Struct("<QQQII")  # times, size and checksum, length of the compression's name
CRC = struct.Struct("<I")
FOOTER_SIZE = 20  # bytes of content: two offsets and the checksum
PIECE = 1 << 20  # bytes read at a time


class McapRecord(NamedTuple):
    """A record of an MCAP file: opcode and offset, and the offset and length of its content."""

    opcode: int
    start: int
    content: int
    length: int


class McapChunk(NamedTuple):
    """A chunk: its offset, decompressed size and checksum, compression, and place of its bytes."""

    start: int
    size: int
    crc: int
    compression: str
    content: int
    packed: int


def verify_mcap(path: Path) -> dict[int, McapChunk]:
    """Return the chunks of an MCAP file by their offsets, after their checksums were verified.

    Raise FileError if a checksum differs, a record is cut, or a chunk is larger than it declares
    or than `decompression` allows. No more than a piece of a chunk is in memory.
    """
    with open(path, "rb") as file:
        records = list(_read_records(file))
        chunks = [_read_chunk_head(file, each) for each in records if each.opcode == CHUNK]
        for chunk in chunks:
            _verify_chunk(file, chunk)
        _verify_sections(file, records)
    return {chunk.start: chunk for chunk in chunks}


def add_mcap_checksums(path: Path) -> None:
    """Compute the checksums of an MCAP file of uncompressed chunks, and store them in the file."""
    with open(path, "r+b") as file:
        records = list(_read_records(file))
        for each in (each for each in records if each.opcode == CHUNK):
            chunk = _read_chunk_head(file, each)
            crc = _sum_range(file, chunk.content, chunk.content + chunk.packed)
            _write_crc(file, each.content + 24, crc)
        data_end, footer = _find_ends(records)
        _write_crc(file, data_end.content, _sum_range(file, 0, data_end.start))
        summary = data_end.content + data_end.length
        stop = footer.content + FOOTER_SIZE - CRC.size
        _write_crc(file, stop, _sum_range(file, summary, stop))


def _read_records(file: BinaryIO) -> Iterator[McapRecord]:
    """Yield the records of a file up to its footer; raise FileError if one is cut."""
    end, start = file.seek(0, 2) - len(MAGIC), len(MAGIC)
    file.seek(0)
    if file.read(len(MAGIC)) != MAGIC:
        raise FileError("not an MCAP file, or truncated or damaged")
    while start + HEAD.size <= end:
        file.seek(start)
        opcode, length = HEAD.unpack(file.read(HEAD.size))
        content = start + HEAD.size
        if content + length > end:
            break
        yield McapRecord(opcode, start, content, length)
        if opcode == FOOTER:
            return
        start = content + length
    raise FileError(f"the record at byte {start} is truncated or damaged")


def _read_chunk_head(file: BinaryIO, record: McapRecord) -> McapChunk:
    """Return the head of a chunk; raise FileError if its parts do not fill the record."""
    file.seek(record.content)
    head = file.read(min(record.length, CHUNK_HEAD.size))
    if len(head) == CHUNK_HEAD.size:
        _, _, size, crc, name_length = CHUNK_HEAD.unpack(head)
        packed = record.length - CHUNK_HEAD.size - name_length - 8
        if packed >= 0:
            compression = file.read(min(name_length, 16)).decode("utf-8", "replace")
            content = record.content + record.length - packed
            file.seek(content - 8)
            if int.from_bytes(file.read(8), "little") == packed:
                return McapChunk(record.start, size, crc, compression, content, packed)
    raise FileError(f"the chunk at byte {record.start} is damaged")


def _verify_chunk(file: BinaryIO, chunk: McapChunk) -> None:
    """Raise FileError unless a chunk has its declared size and its checksum."""
    where = f"the chunk at byte {chunk.start}"
    file.seek(chunk.content)
    size, crc = 0, 0
    for piece in decompression.decompress_chunk(file, chunk.packed, chunk.compression, where):
        size, crc = size + len(piece), crc32(piece, crc)
        if size > chunk.size:
            break
    if size != chunk.size:
        raise FileError(f"{where} declares {chunk.size} bytes, and has other than these")
    if chunk.crc not in (0, crc):
        raise FileError(f"the checksum of {where} differs from its content")


def _verify_sections(file: BinaryIO, records: list[McapRecord]) -> None:
    """Raise FileError unless the data and the summary have their checksums."""
    data_end, footer = _find_ends(records)
    expected = _read_crc(file, data_end.content)
    begin = records[0].content + records[0].length  # of the data section, as some writers begin
    if expected and expected not in (_sum_range(file, at, data_end.start) for at in (0, begin)):
        raise FileError("the checksum of the data differs from them")
    summary, stop = data_end.content + data_end.length, footer.content + FOOTER_SIZE - CRC.size
    if _read_crc(file, stop) not in (0, _sum_range(file, summary, stop)):
        raise FileError("the checksum of the summary differs from it")


def _find_ends(records: list[McapRecord]) -> tuple[McapRecord, McapRecord]:
    """Return the record that ends the data, and the footer; raise FileError without one."""
    data_end = next((each for each in records if each.opcode == DATA_END), None)
    if data_end is None or data_end.length != CRC.size or records[-1].length != FOOTER_SIZE:
        raise FileError("the end of the data or of the file is damaged")
    return data_end, records[-1]


def _sum_range(file: BinaryIO, start: int, stop: int) -> int:
    """Return the checksum of the bytes from `start` to `stop`."""
    file.seek(start)
    crc = 0
    for at in range(start, stop, PIECE):
        crc = crc32(file.read(min(PIECE, stop - at)), crc)
    return crc


def _read_crc(file: BinaryIO, at: int) -> int:
    """Return the checksum at an offset of a file."""
    file.seek(at)
    return int(CRC.unpack(file.read(CRC.size))[0])


def _write_crc(file: BinaryIO, at: int, crc: int) -> None:
    """Store a checksum at an offset of a file."""
    file.seek(at)
    file.write(CRC.pack(crc))
