"""A face of a body with its grey value or its picture."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.geometry.primitives import Primitive
from robsim.vision.tags.board import Board
from robsim.vision.tags.dot_pattern import DotPattern
from robsim.vision.tags.tag import Tag
from robsim.vision.tags.target_renderer import INK, PAPER

INK_NEARNESS = 1.0 + 2.0**-18  # factor of 1/Z of ink, which lies on its paper
WHITE = 255.0


@dataclass(frozen=True)
class RenderedFace:
    """A convex face in axes of its body.

    Attributes
    ----------
    corners : ndarray of shape (n, 3)
        Corners in metres, counterclockwise as seen from outside.
    grey : float
        Grey value in full light, from 0 to 255; the factor of a picture is 1.
    picture : ndarray of uint8, shape (h, w), optional
        Picture on the face.
    texel : ndarray of shape (2, 4)
        Column and row of the picture as affine functions of a point (x, y, z, 1).
    nearer : float
        Factor of 1/Z, larger than 1 for a face that lies on another one.
    """

    corners: Array
    grey: float
    picture: NDArray[np.uint8] | None = None
    texel: Array = field(default_factory=lambda: np.zeros((2, 4)))
    nearer: float = 1.0


def find_shape_grey(shape: Primitive) -> float:
    """Return the grey value of a shape in full light, from 0 to 255."""
    return WHITE * shape.albedo


def list_shape_faces(shape: Primitive) -> list[RenderedFace]:
    """Return the faces of a solid with its pictures, or of the content of a mesh file.

    >>> from robsim.shapes import Block
    >>> faces = list_shape_faces(Block(0.1, 0.1, 0.1, albedo=0.4))
    >>> len(faces), faces[0].grey
    (6, 102.0)
    """
    faces = []
    for solid in shape.shown():
        points, polygons = solid.skin
        faces += [RenderedFace(points[list(each)], find_shape_grey(shape)) for each in polygons]
    for k, each in shape.face_pictures.items():
        faces[k] = RenderedFace(faces[k].corners, 1.0, each.picture.grey, each.texel)
    return faces


def list_target_faces(target: Tag | Board | DotPattern) -> list[RenderedFace]:
    """Return the faces of a printed target: both sides of its paper, and its ink."""
    (left, top), (right, bottom) = target.paper
    sheet = _build_rectangle(left, top, right, bottom)
    is_bright = isinstance(target, DotPattern) and target.bright
    paper, ink = (INK, PAPER) if is_bright else (PAPER, INK)
    return [
        RenderedFace(sheet, paper),
        RenderedFace(sheet[::-1], PAPER),
        *(RenderedFace(each, ink, nearer=INK_NEARNESS) for each in _list_outlines(target)),
    ]


def _list_outlines(target: Tag | Board | DotPattern) -> list[Array]:
    """Return the outlines (n, 3) of the ink, which are seen from -z."""
    if isinstance(target, DotPattern):
        return [np.column_stack([each, np.zeros(len(each))])[::-1] for each in target.discs]
    return [_build_rectangle(*each) for each in target.ink]


def _build_rectangle(left: float, top: float, right: float, bottom: float) -> Array:
    """Return the corners (4, 3) of a rectangle in the plane z = 0, which is seen from -z."""
    x, y = np.array([left, left, right, right]), np.array([top, bottom, bottom, top])
    return np.column_stack([x, y, np.zeros(4)])
