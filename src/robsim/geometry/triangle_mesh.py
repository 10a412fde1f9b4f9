"""Surfaces of triangles, the content of a mesh."""

from __future__ import annotations

import hashlib
import re
import zlib
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import as_floats, make_read_only
from robsim.base.errors import FileError, InputError, format_value
from robsim.container import pack_container, unpack_container
from robsim.geometry.mesh_parser import (
    LARGEST_COORDINATE,
    MOST_COLORS,
    MOST_TRIANGLES,
    ColoredMesh,
    Indices,
)

SIGNATURE = b"RobSim mesh 1\n"
MOST_UNPACKED = 200_000_000  # bytes
LARGEST_POINT_COUNT = 3 * MOST_TRIANGLES


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """Triangles of a mesh, by colour.

    Points are stored with 32 bits, so that a stored mesh has the same bits everywhere. Two meshes
    are equal if their `digest` is.

    Parameters
    ----------
    parts : sequence of (points, triangles, sharp, color)
        Points (P, 3) in metres, indices (F, 3) of the points of each triangle, indices (E, 2) of
        the points of each sharp edge, and a colour "#rrggbb" or None. A triangle is seen from the
        side where its points are counterclockwise.

    Raises
    ------
    InputError
        If there are no triangles or more than a million, points are not finite or beyond 1000 km,
        indices refer to points that do not exist, or there are more than 8 parts.

    Examples
    --------
    >>> corner = TriangleMesh.from_arrays(np.eye(3), [[0, 1, 2]])
    >>> len(corner.parts), corner.digest[:8]
    (1, '640b825e')
    """

    parts: tuple[ColoredMesh, ...]

    def __post_init__(self) -> None:
        parts = tuple(_check_part(each) for each in _list_parts(self.parts))
        count = sum(len(each.triangles) for each in parts)
        if not 0 < count <= MOST_TRIANGLES or len(parts) > MOST_COLORS:
            most = f"1 to {MOST_TRIANGLES} in 1 to {MOST_COLORS} parts"
            raise InputError(f"mesh: {count} triangles in {len(parts)} parts; expected {most}")
        object.__setattr__(self, "parts", parts)

    @classmethod
    def from_arrays(cls, points: ArrayLike, triangles: ArrayLike) -> TriangleMesh:
        """Return the mesh of points (P, 3) in metres and of triangles (F, 3), indices of points.

        Raises
        ------
        InputError
            If the arrays are not the arrays of a mesh.

        Examples
        --------
        >>> TriangleMesh.from_arrays(np.eye(3), [[0, 1, 3]])
        Traceback (most recent call last):
        ...
        robsim.base.errors.InputError: mesh: triangles refer to points that do not exist
        """
        no_edges = np.empty((0, 2), dtype=np.int32)
        return cls((ColoredMesh(np.asarray(points), np.asarray(triangles), no_edges, None),))

    @classmethod
    def unpack(cls, data: bytes, source: str) -> TriangleMesh:
        """Return the mesh of the content of a file that RobSim wrote.

        Parameters
        ----------
        data : bytes
            Content of the file, as `packed` returns it.
        source : str
            Name of the file in errors.

        Raises
        ------
        FileError
            If the content is not that of a mesh.

        Examples
        --------
        >>> corner = TriangleMesh.from_arrays(np.eye(3), [[0, 1, 2]])
        >>> TriangleMesh.unpack(corner.packed, "copy") == corner
        True
        """
        try:
            header, arrays = unpack_container(BytesIO(_decompress(data)))
            rows = zip(arrays[::3], arrays[1::3], arrays[2::3], header["colors"], strict=True)
            return cls(tuple(ColoredMesh(*each) for each in rows))
        except (zlib.error, ValueError, TypeError, KeyError, InputError) as error:
            raise FileError(f"{source}: no mesh of RobSim: {error!s:.200}") from None

    @cached_property
    def packed(self) -> bytes:
        """The content of a file of the mesh, without a loss."""
        arrays: list[NDArray[Any]] = [each for part in self.parts for each in part[:3]]
        header = {"colors": [part.color for part in self.parts]}
        return SIGNATURE + zlib.compress(pack_container(header, arrays).getvalue())

    @cached_property
    def digest(self) -> str:
        """The SHA-256 of the colours, sizes and arrays of the parts."""
        content = hashlib.sha256(SIGNATURE)
        for part in self.parts:
            sizes = (part.color, *map(len, part[:3]))
            content.update(" ".join(map(str, sizes)).encode() + b"\n")
            for array in part[:3]:
                content.update(np.asarray(array, dtype=array.dtype.newbyteorder("<")).tobytes())
        return content.hexdigest()

    def __eq__(self, other: object) -> bool:
        """Return whether the other mesh has the same triangles."""
        return self.digest == other.digest if isinstance(other, TriangleMesh) else NotImplemented

    def __hash__(self) -> int:
        return hash(self.digest)

    def __repr__(self) -> str:
        count = sum(len(each.triangles) for each in self.parts)
        return f"TriangleMesh({count} triangles, {self.digest[:12]})"


def _list_parts(parts: object) -> list[ColoredMesh]:
    """Return the parts of a mesh; raise InputError if they are none."""
    rows: list[Any] = list(parts) if isinstance(parts, list | tuple) else [parts]
    if not all(isinstance(each, list | tuple) and len(each) == 4 for each in rows):
        expected = "parts (points, triangles, sharp, color)"
        raise InputError(f"mesh: expected {expected}, got {format_value(parts)}")
    return [ColoredMesh(*each) for each in rows]


def _check_part(part: ColoredMesh) -> ColoredMesh:
    """Return the arrays of a part, read-only; raise InputError if they are invalid."""
    points = as_floats(part.points, "mesh: points", ("P", 3))
    if not (np.abs(points) <= LARGEST_COORDINATE).all() or len(points) > LARGEST_POINT_COUNT:
        limits = f"finite, at most {LARGEST_COORDINATE:g} m, and at most {LARGEST_POINT_COUNT}"
        raise InputError(f"mesh: points must be {limits}")
    triangles = _check_indices(part.triangles, 3, len(points), "triangles")
    sharp = _check_indices(part.sharp, 2, len(points), "sharp edges")
    if part.color is not None and not re.fullmatch("#[0-9a-f]{6}", str(part.color)):
        raise InputError(f"mesh: expected a colour #rrggbb, got {format_value(part.color)}")
    return ColoredMesh(make_read_only(points.astype(np.float32)), triangles, sharp, part.color)


def _check_indices(values: Any, width: int, points: int, what: str) -> Indices:
    """Return indices (n, width) of points as 32-bit integers; raise InputError if invalid."""
    try:
        array = np.asarray(values)
    except (ValueError, TypeError):  # rows of different lengths
        array = np.empty(0)
    if array.dtype.kind not in "iu" or array.ndim != 2 or array.shape[1] != width:
        given = f"{array.dtype}, shape {array.shape}"
        raise InputError(f"mesh: expected {what} of integers, shape (n, {width}), got {given}")
    if array.size and not 0 <= array.min() <= array.max() < points:
        raise InputError(f"mesh: {what} refer to points that do not exist")
    return make_read_only(array.astype(np.int32))


def _decompress(data: bytes) -> bytes:
    """Return the content of compressed data; raise ValueError if it is huge or cut short."""
    if not isinstance(data, bytes) or not data.startswith(SIGNATURE):
        raise ValueError("it has another signature")
    reader = zlib.decompressobj()
    content = reader.decompress(data[len(SIGNATURE) :], MOST_UNPACKED)
    if not reader.eof:
        raise ValueError(f"it is cut short, or more than {MOST_UNPACKED} bytes")
    return content
