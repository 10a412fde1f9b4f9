"""Archives of machine code: files of the package with the code of all stages and entries.

`bitcode.lzma` serves every processor and is translated when it is first needed. The other archives
hold the machine code of a processor level. An archive is used if it was made from the sources of
the kernels that are here, whatever the versions of Python, Numba and LLVM.
"""

from __future__ import annotations

import hashlib
import json
import lzma
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "_machine_code"
BITCODE = "bitcode"
_FILTERS = [{"id": lzma.FILTER_LZMA2, "preset": 9}]
_DIGEST = 32  # bytes


@dataclass
class CodeArchive:
    """The code of functions.

    Attributes
    ----------
    kernels : str
        Digest of the sources of the kernels.
    llvm : int
        Version of LLVM that wrote it.
    parts : dict
        Symbol: code of the function.
    needs : dict
        Symbol: symbols that the code calls.
    """

    kernels: str
    llvm: int
    parts: dict[str, bytes]
    needs: dict[str, list[str]]


def pack_archive(archive: CodeArchive) -> bytes:
    """Return the bytes of an archive: a digest of the rest, and the compressed rest."""
    sizes = {symbol: len(code) for symbol, code in sorted(archive.parts.items())}
    header = json.dumps([archive.kernels, archive.llvm, sizes, archive.needs], sort_keys=True)
    code = b"".join(archive.parts[symbol] for symbol in sizes)
    packed = lzma.compress(header.encode() + b"\n" + code, lzma.FORMAT_RAW, filters=_FILTERS)
    return hashlib.sha256(packed).digest() + packed


def unpack_archive(content: bytes) -> CodeArchive:
    """Return an archive. Raise ValueError if it is damaged."""
    digest, packed = content[:_DIGEST], content[_DIGEST:]
    if hashlib.sha256(packed).digest() != digest:
        raise ValueError("the archive is damaged")
    header, _, code = lzma.decompress(packed, lzma.FORMAT_RAW, filters=_FILTERS).partition(b"\n")
    kernels, llvm, sizes, needs = json.loads(header)
    parts, first = {}, 0
    for symbol, size in sizes.items():
        parts[symbol] = code[first : first + size]
        first += size
    return CodeArchive(kernels, llvm, parts, needs)


def read_archive(name: str, kernels: str) -> CodeArchive | None:
    """Return an archive of the package; None if it is absent, damaged or of other sources."""
    try:
        archive = unpack_archive((FOLDER / f"{name}.lzma").read_bytes())
    except (OSError, ValueError, lzma.LZMAError):
        return None
    return archive if archive.kernels == kernels else None


def explain_mismatch(kernels: str) -> str:
    """Return why the code of the package is not used; "" if it is used or the package has none."""
    if not FOLDER.is_dir() or read_archive(BITCODE, kernels):
        return ""
    return "the machine code of the package is damaged or of other sources"
