"""The faces of all bodies as arrays, as the kernels take them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.kernels.raster.raster_arrays import Faces, Pictures
from robsim.rendering.recent_values import RecentValues
from robsim.rendering.rendered_face import RenderedFace

Copies = tuple[NDArray[np.uint16], NDArray[np.int64]]

MOST_LEVELS = 16
MOST_KEPT_TEXELS = 4_000_000  # of a picture whose copies are kept: 22 MB
SMALLEST_AREA = 1e-30  # m^2; smaller faces have no direction and are left out

_COPIES: RecentValues[Copies] = RecentValues(8)


def build_faces(bodies: Sequence[Iterable[RenderedFace]]) -> tuple[Faces, Pictures]:
    """Return the faces and pictures of bodies, each a list of faces."""
    listed = [(b, face) for b, faces in enumerate(bodies) for face in faces]
    corners, first = _join_corners([face for _, face in listed])
    normals = _compute_normals(corners, first)
    has_area = np.isfinite(normals[:, 0])
    if not has_area.all():
        listed = [listed[k] for k in np.flatnonzero(has_area)]
        corners, first = _join_corners([face for _, face in listed])
    body = np.array([b for b, _ in listed], dtype=np.int64)
    pictures = _list_pictures(face.picture for _, face in listed)
    index = {id(picture): k for k, picture in enumerate(pictures)}
    faces = Faces(
        corners=corners,
        first=first,
        body=body,
        normal=normals[has_area],
        grey=np.array([face.grey for _, face in listed], dtype=float),
        picture=np.array([index.get(id(face.picture), -1) for _, face in listed], dtype=np.int64),
        texel=np.array([face.texel for _, face in listed], dtype=float).reshape(-1, 2, 4),
        nearer=np.array([face.nearer for _, face in listed], dtype=float),
    )
    return faces, build_pictures(pictures)


def _join_corners(faces: list[RenderedFace]) -> tuple[Array, NDArray[np.int64]]:
    """Return the corners (C, 3) of faces, and the first corner (F + 1,) of each."""
    corners = np.concatenate([np.empty((0, 3)), *(face.corners for face in faces)])
    sizes = [len(face.corners) for face in faces]
    return corners, np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)


def _compute_normals(corners: Array, first: NDArray[np.int64]) -> Array:
    """Return the outward unit normals (F, 3) of faces; NaN for a face without area."""
    sizes = np.diff(first)
    spokes = corners - np.repeat(corners[first[:-1]], sizes, axis=0)
    following = np.arange(1, len(corners) + 1)
    following[first[1:] - 1] = first[:-1]
    products = np.cross(spokes, spokes[following])
    areas = np.add.reduceat(products, first[:-1]) if len(sizes) else products
    lengths = np.linalg.norm(areas, axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(lengths > SMALLEST_AREA, areas / lengths, np.nan)


def _list_pictures(pictures: Iterable[NDArray[np.uint8] | None]) -> list[NDArray[np.uint8]]:
    """Return the different pictures of faces."""
    return list({id(each): each for each in pictures if each is not None}.values())


def build_pictures(pictures: Sequence[NDArray[np.uint8]]) -> Pictures:
    """Return pictures with their halved copies."""
    if not pictures:
        return Pictures(None, None, None)
    texels, level = [], np.zeros((len(pictures), MOST_LEVELS, 4), np.int64)
    count, at = np.zeros(len(pictures), dtype=np.int64), 0
    for p, picture in enumerate(pictures):
        packed, table = _find_copies(picture)
        count[p], level[p, : len(table)] = len(table), table
        level[p, : len(table), 0] += at
        texels.append(packed)
        at += len(packed)
    return Pictures(texels[0] if len(texels) == 1 else np.concatenate(texels), level, count)


def _find_copies(picture: NDArray[np.uint8]) -> Copies:
    """Return the halved copies of a picture; the last ones of pictures that cannot change."""
    if picture.flags.writeable or picture.size > MOST_KEPT_TEXELS:
        return _build_copies(picture)
    return _COPIES.find(id(picture), picture, lambda: _build_copies(picture))


def _build_copies(picture: NDArray[np.uint8]) -> Copies:
    """Return the texels of a picture and its halved copies, and the table (levels, 4) of copies.

    A level has the mean of 2 x 2 texels of the level before, with a border of one texel, and one
    more texel at its end. The levels of a picture end with the last one that has at least one texel
    along each side.
    """
    texels: list[NDArray[np.uint16]] = []
    table, at, values = [], 0, picture.astype(float)
    while True:
        table.append([at, values.shape[1] + 2, values.shape[1], values.shape[0]])
        whole = np.pad(np.rint(256.0 * values).astype(np.uint16), 1, mode="edge").ravel()
        texels.append(np.append(whole, whole[-1]))  # the pair of the last texel ends with it
        at += len(texels[-1])
        if min(values.shape) < 2 or len(table) == MOST_LEVELS:
            return np.concatenate(texels), np.array(table)
        values = _halve(values)


def _halve(values: Array) -> Array:
    """Return the means of blocks of 2 x 2 texels; an odd last row or column is weighted by half."""
    for axis in (0, 1):
        values = np.moveaxis(values, axis, 0)
        values = _halve_rows(values) if len(values) > 1 else values
        values = np.moveaxis(values, 0, axis)
    return values


def _halve_rows(values: Array) -> Array:
    """Return the means of pairs of rows, without an odd last row."""
    even = len(values) // 2 * 2
    return np.asarray(0.5 * (values[0:even:2] + values[1:even:2]))
