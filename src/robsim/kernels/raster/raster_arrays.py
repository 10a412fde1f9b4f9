"""The arrays that the kernels of a picture share.

A face is a convex polygon of a body. It has a grey value, or a picture. The image coordinates of a
camera without distortion are the pixels (column, row), and the rays of a camera with distortion are
normalised coordinates (X/Z, Y/Z); `ImagePlane` leads from a point in camera axes to both.
"""

from typing import Any, NamedTuple

# Types of the arguments of entries.
FACES = (
    "Faces(float64[:, ::1], int64[::1], int64[::1], float64[:, ::1], float64[::1], int64[::1], "
    "float64[:, :, ::1], float64[::1])"
)
PICTURES = "Pictures(uint16[::1], int64[:, :, ::1], int64[::1])"
NO_PICTURES = "Pictures(None, None, None)"
PINHOLE_PLANE = "ImagePlane(float64[:, ::1], float64[:, ::1], None, None, None)"
LENS_PLANE = (
    "ImagePlane(float64[:, ::1], float64[:, ::1], "
    "float32[:, :, ::1], float64[:, ::1], float64[:, ::1])"
)
PLACED_FACES = (
    "PlacedFaces(float64[:, ::1], float64[:, :, ::1], int64[:, ::1], float64[::1], float64[:, ::1])"
)
PIXEL_BUFFERS = (
    "PixelBuffers(int32[:, ::1], float32[:, ::1], int32[:, ::1], float32[::1], float32[::1], "
    "float32[::1], float32[::1], int32[::1], uint32[::1], uint32[::1], float32[::1], "
    "float32[::1], float32[::1], int32[::1], int32[:, ::1], int32[:, ::1], int64[:, ::1], "
    "float64[:, ::1], float64[:, :, ::1])"
)


class Faces(NamedTuple):
    """The faces of bodies, in body axes.

    corners (C, 3), the corners of all faces, counterclockwise as seen from outside; first (F + 1,),
    the first corner of each face; body (F,); normal (F, 3), outwards; grey (F,), from 0 to 255;
    picture (F,), -1 for none; texel (F, 2, 4), the column and row of the picture as affine
    functions of a point; nearer (F,), a factor of 1/Z, which puts ink before the paper on which it
    lies.
    """

    corners: Any
    first: Any
    body: Any
    normal: Any
    grey: Any
    picture: Any
    texel: Any
    nearer: Any


class Pictures(NamedTuple):
    """Pictures and their halved copies.

    texels (n,) of uint16, each the 256-fold of a grey value; level (P, L, 4), first texel, texels
    in a row, width and height of each copy; count (P,), their number. Without a picture, these are
    None, and the kernels for pictures are not compiled.
    """

    texels: Any
    level: Any
    count: Any


class ImagePlane(NamedTuple):
    """The image of a camera.

    matrix (3, 3), from points in camera axes to image coordinates; inverse (3, 3). With a
    distortion: rays (2, h, w), float32, the image coordinates of each pixel; and, for each row and
    column, the least ones from there to the end and the greatest ones up to there: row_ends (2, h)
    of Y and column_ends (2, w) of X. Without, these are None, and the kernels for lenses are not
    compiled.
    """

    matrix: Any
    inverse: Any
    rays: Any
    row_ends: Any
    column_ends: Any


class PlacedFaces(NamedTuple):
    """The faces before a camera, as functions of the image coordinates (X, Y, 1).

    sides (C, 3), between each corner and the one before, not negative inside; plane (F, 3, 3),
    texel column / Z, texel row / Z and 1/Z; box (F, 4), the first and last column and row, the
    first beyond the last for an unseen face; shade (F,), the grey value in its light, or its factor
    for a picture; points (C, 3), in camera axes.
    """

    sides: Any
    plane: Any
    box: Any
    shade: Any
    points: Any


class PixelBuffers(NamedTuple):
    """The buffers of an image: face (h, w) at the centre of each pixel, 1/Z there, tone and rows.

    The tone (h, w) is a number that is nearly equal for pixels without an edge between them.

    Rows (w,): texel coordinates u and v; their fractions x and y; index, of the texel to the upper
    left; upper and lower, pairs of texels; fine and coarse, grey values of two levels; inside, 1/Z
    of a ray that meets a face; differs, pixels with several tones near them. least and greatest
    (3, w) are the tones near each pixel in three rows.

    Of one pixel at an edge: near (3, 9), the faces near it, the number of their sides that cross
    it, and the last of these or the places inside all sides; shares (9, 3), area and moments of
    each; polygon (2, 2, 68), corners of the part of a pixel that a face covers.
    """

    face: Any
    nearness: Any
    tone: Any
    u: Any
    v: Any
    x: Any
    y: Any
    index: Any
    upper: Any
    lower: Any
    fine: Any
    coarse: Any
    inside: Any
    differs: Any
    least: Any
    greatest: Any
    near: Any
    shares: Any
    polygon: Any
