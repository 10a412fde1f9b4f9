"""Recordings as compressed bytes that a page unpacks.

The header lists the name, kind and shape of each array. Numbers are float32 or uint32, little
endian. The first bytes of all numbers of an array are stored together, then the second bytes, and
so on, which compresses better. Poses are `quantised`: the range of each component is divided into
65535 steps, and the differences of these 16-bit integers between instants are stored.
"""

from __future__ import annotations

import gzip
import math
import zlib
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.container import pack_container, unpack_container

LEVELS = 65535  # steps in the range of a quantised component
KINDS = ("f4", "u4", "u2")
MOST_BYTES = 1 << 30  # size of an unpacked recording


def pack_recording(
    header: dict[str, Any], arrays: dict[str, NDArray[Any]], quantised: set[str], level: int = 9
) -> bytes:
    """Return the compressed bytes of a recording; `level` is the level of gzip."""
    table, pieces = [], []
    for name, array in arrays.items():
        entry, data = (_encode_quantised if name in quantised else _encode_numbers)(array)
        table.append({"name": name, "shape": list(array.shape), **entry})
        pieces.append(data)
    with pack_container({**header, "arrays": table}, pieces).getbuffer() as content:
        return gzip.compress(content, level, mtime=0)


def unpack_recording(data: bytes) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """Return header and arrays of a packed recording; raise ValueError if it is damaged."""
    content = zlib.decompressobj(wbits=31).decompress(data, MOST_BYTES)
    header, pieces = unpack_container(BytesIO(content))
    pairs = zip(header.pop("arrays"), pieces, strict=True)
    return header, {entry["name"]: _decode_array(entry, piece) for entry, piece in pairs}


def _encode_numbers(array: NDArray[Any]) -> tuple[dict[str, Any], NDArray[np.uint8]]:
    """Return kind and bytes of an array of numbers."""
    kind = "<u4" if array.dtype.kind in "iu" else "<f4"
    return {"kind": kind[1:]}, _split_byte_planes(np.ascontiguousarray(array, dtype=kind))


def _encode_quantised(array: Array) -> tuple[dict[str, Any], NDArray[np.uint8]]:
    """Return kind, ranges and bytes of a quantised array (T, ...)."""
    flat = array.reshape(len(array), -1)
    low, high = flat.min(axis=0, initial=np.inf), flat.max(axis=0, initial=-np.inf)
    step = np.where(high > low, (high - low) / LEVELS, 1.0)
    levels = np.round((flat - low) / step).astype(np.int64)
    change = np.diff(levels, axis=0, prepend=0).astype("<u2")  # modulo 2^16
    ranges = {"low": low.tolist(), "step": step.tolist()}
    return {"kind": "u2", **ranges}, _split_byte_planes(np.ascontiguousarray(change.T))


def _split_byte_planes(array: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the bytes of an array, grouped by significance."""
    return array.reshape(-1).view(np.uint8).reshape(-1, array.dtype.itemsize).T


def _decode_array(entry: dict[str, Any], planes: NDArray[Any]) -> NDArray[Any]:
    """Return an array from its byte planes (significances, numbers)."""
    if entry["kind"] not in KINDS or planes.dtype != np.uint8:
        raise ValueError(f"not an array: {format_value(entry)}")
    kind, shape = np.dtype(f"<{entry['kind']}"), tuple(entry["shape"])
    if math.prod(shape) * kind.itemsize != planes.size:
        raise ValueError(f"{planes.size} bytes for an array of shape {format_value(shape)}")
    values = np.ascontiguousarray(planes.reshape(kind.itemsize, -1).T).view(kind).ravel()
    if entry["kind"] != "u2":
        return values.reshape(shape)
    rows = np.cumsum(values.reshape(-1, shape[0]), axis=1, dtype=np.uint16).T
    numbers = np.asarray(entry["low"]) + rows * np.asarray(entry["step"])
    return np.asarray(numbers.reshape(shape), dtype=np.float32)


def check_recording_size(arrays: dict[str, NDArray[Any]]) -> None:
    """Raise InputError if the arrays are larger than a page can hold."""
    size = sum(array.size * 4 for array in arrays.values())
    if size > MOST_BYTES:
        raise InputError(f"a recording of {size / 1e9:.1f} GB is more than a page can hold")
