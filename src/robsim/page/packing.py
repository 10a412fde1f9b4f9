"""Arrays of a recording as bytes that a page unpacks, and back.

Numbers are float32, little endian. Bytes of one significance stand together, which compress well:
all first bytes, then all second ones. Poses are `quantised`: whole numbers of 16 bits over the
range of each component, of which the differences from instant to instant are stored.
"""

from __future__ import annotations

import gzip
import math
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError, said

LEVELS = 65535  # steps in the range of a quantised component
KINDS = ("f4", "u4", "u2")
MOST_BYTES = 1 << 30  # of an unpacked recording


def packed(
    arrays: dict[str, NDArray[Any]], quantised: set[str], level: int = 9
) -> tuple[dict[str, Any], bytes]:
    """Return {name: where and how it stands} and compressed bytes; the level is that of gzip."""
    table: dict[str, Any] = {}
    pieces: list[bytes] = []
    at = 0
    for name, array in arrays.items():
        entry, data = (_quantised if name in quantised else _plain)(array)
        table[name] = {"at": at, "shape": list(array.shape), **entry}
        pieces.append(data)
        at += len(data)
    return table, gzip.compress(b"".join(pieces), level, mtime=0)


def unpacked(table: dict[str, Any], data: bytes) -> dict[str, NDArray[Any]]:
    """Return the arrays of `packed` bytes. ValueError: the table is not one, or does not fit."""
    size = max((entry["at"] + _bytes(entry) for entry in table.values()), default=0)
    flat = zlib.decompressobj(wbits=31).decompress(data, size + 1) if size else b""
    if len(flat) != size:
        raise ValueError("its numbers are not as many as it says")
    return {name: _array(entry, flat) for name, entry in table.items()}


def _bytes(entry: dict[str, Any]) -> int:
    """Return how many bytes an array takes, once where it stands is known to make sense."""
    places = [entry["at"], *entry["shape"]]
    if entry["kind"] not in KINDS or not all(type(n) is int and n >= 0 for n in places):
        raise ValueError(f"no array: {said(entry)}")
    size: int = math.prod(entry["shape"]) * np.dtype(entry["kind"]).itemsize
    if entry["at"] + size > MOST_BYTES:
        raise ValueError(f"its numbers need more than {MOST_BYTES} bytes")
    return size


def _plain(array: NDArray[Any]) -> tuple[dict[str, Any], bytes]:
    kind = "<u4" if array.dtype.kind in "iu" else "<f4"
    return {"kind": kind[1:]}, _shuffled(np.ascontiguousarray(array, dtype=kind))


def _quantised(array: Array) -> tuple[dict[str, Any], bytes]:
    """Return ranges and bytes of an array (T, ...); what is not finite stays where it was."""
    flat = array.reshape(len(array), -1)
    low, high = flat.min(axis=0, initial=np.inf), flat.max(axis=0, initial=-np.inf)
    step = np.where(high > low, (high - low) / LEVELS, 1.0)
    levels = np.round((flat - low) / step).astype(np.int64)
    change = np.diff(levels, axis=0, prepend=0).astype("<u2")  # modulo 2^16
    ranges = {"low": low.tolist(), "step": step.tolist()}
    return {"kind": "u2", **ranges}, _shuffled(np.ascontiguousarray(change.T))


def _shuffled(array: NDArray[Any]) -> bytes:
    size = array.dtype.itemsize
    return array.view(np.uint8).reshape(-1, size).T.tobytes()


def _array(entry: dict[str, Any], flat: bytes) -> NDArray[Any]:
    kind, shape = np.dtype(f"<{entry['kind']}"), tuple(entry["shape"])
    count = math.prod(shape)
    part = np.frombuffer(flat, np.uint8, count * kind.itemsize, entry["at"])
    values = np.ascontiguousarray(part.reshape(kind.itemsize, -1).T).view(kind).ravel()
    if entry["kind"] != "u2":
        return values.reshape(shape)
    rows = np.cumsum(values.reshape(-1, shape[0]), axis=1, dtype=np.uint16).T
    found = np.asarray(entry["low"]) + rows * np.asarray(entry["step"])
    return np.asarray(found.reshape(shape), dtype=np.float32)


def check_size(arrays: dict[str, NDArray[Any]]) -> None:
    """Raise InputError where a page could not hold the arrays."""
    size = sum(array.size * 4 for array in arrays.values())
    if size > MOST_BYTES:
        raise InputError(f"a recording of {size / 1e9:.1f} GB is more than a page can hold")
