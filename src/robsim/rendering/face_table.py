"""The faces of all bodies as arrays, as the kernels take them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.kernels.raster.raster_arrays import Faces, Pictures
from robsim.rendering.rendered_face import RenderedFace

MOST_LEVELS = 16
SMALLEST_AREA = 1e-30  # m^2; smaller faces have no direction and are left out


def build_faces(bodies: Sequence[Iterable[RenderedFace]]) -> tuple[Faces, Pictures]:
    """Return the faces and pictures of bodies, each a list of faces."""
    listed = [(b, face) for b, faces in enumerate(bodies) for face in faces]
    normals = _compute_normals([face.corners for _, face in listed])
    kept = [k for k, normal in enumerate(normals) if np.isfinite(normal).all()]
    listed, normals = [listed[k] for k in kept], normals[kept]
    sizes = np.array([len(face.corners) for _, face in listed], dtype=np.int64)
    body = np.array([b for b, _ in listed], dtype=np.int64)
    pictures = _list_pictures(face.picture for _, face in listed)
    index = {id(picture): k for k, picture in enumerate(pictures)}
    faces = Faces(
        corners=np.concatenate([np.empty((0, 3)), *(face.corners for _, face in listed)]),
        first=np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64),
        body=body,
        normal=normals,
        grey=np.array([face.grey for _, face in listed], dtype=float),
        picture=np.array([index.get(id(face.picture), -1) for _, face in listed], dtype=np.int64),
        texel=np.array([face.texel for _, face in listed], dtype=float).reshape(-1, 2, 4),
        nearer=np.array([face.nearer for _, face in listed], dtype=float),
    )
    return faces, build_pictures(pictures)


def _compute_normals(faces: list[Array]) -> Array:
    """Return the outward unit normals (F, 3) of faces; NaN for a face without area."""
    areas = np.empty((len(faces), 3))
    for k, corners in enumerate(faces):
        spokes = corners[1:] - corners[0]
        areas[k] = np.cross(spokes[:-1], spokes[1:]).sum(axis=0)
    lengths = np.linalg.norm(areas, axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(lengths > SMALLEST_AREA, areas / lengths, np.nan)


def _list_pictures(pictures: Iterable[NDArray[np.uint8] | None]) -> list[NDArray[np.uint8]]:
    """Return the different pictures of faces."""
    return list({id(each): each for each in pictures if each is not None}.values())


def build_pictures(pictures: Sequence[NDArray[np.uint8]]) -> Pictures:
    """Return pictures with their halved copies.

    A level has the mean of 2 x 2 texels of the level before, with a border of one texel. The levels
    of a picture end with the last one that has at least one texel along each side.
    """
    pairs, level = [], np.zeros((len(pictures), MOST_LEVELS, 4), dtype=np.int64)
    count, at = np.zeros(len(pictures), dtype=np.int64), 0
    for p, picture in enumerate(pictures):
        values = picture.astype(float)
        for k in range(MOST_LEVELS):
            level[p, k] = at, values.shape[1] + 2, values.shape[1], values.shape[0]
            pairs.append(_pack_pairs(values))
            at, count[p] = at + len(pairs[-1]), k + 1
            if min(values.shape) < 2:
                break
            values = _halve(values)
    return Pictures(np.concatenate([np.zeros(1, np.uint32), *pairs])[1:], level, count)


def _pack_pairs(values: Array) -> NDArray[np.uint32]:
    """Return the 256-fold of each value and of its right neighbour, with a border of one texel."""
    whole = np.pad(np.rint(256.0 * values).astype(np.uint32), 1, mode="edge")
    right = np.concatenate([whole[:, 1:], whole[:, -1:]], axis=1)
    packed: NDArray[np.uint32] = (whole | right << np.uint32(16)).ravel()
    return packed


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
