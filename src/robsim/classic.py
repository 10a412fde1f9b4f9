"""The ten functions of the chapter, with its names and arguments, in centimetres.

A block is a `Block`, a circ (wheel) is a `Wheel`, and a cam is a `ClassicCamera`. Lengths are in
centimetres and are not converted. The move functions return copies.

>>> from robsim.classic import *
>>> cam = init_cam(8, 4, 3, 0.8, 1e-3, 1e-3, 0, 240, 320, "b")
>>> cam = move_cam(cam, np.diag([1, -1, -1]), [0, 0, 100])  # a metre up, looking down
>>> point_view([0, 5, 20], cam.Ki, cam.pose)
array([240., 270.])
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError, prefix_errors
from robsim.geometry.pose import Pose, PoseLike, as_matrix
from robsim.geometry.primitives import Block, CameraBody, Primitive, Wheel
from robsim.vision.camera import Camera
from robsim.vision.chapter import T_CHAPTER_CAMERA, chapter_intrinsics, intrinsics_from_chapter

if TYPE_CHECKING:
    from matplotlib.collections import LineCollection
    from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]

__all__ = [
    "init_block",
    "init_cam",
    "init_circ",
    "move_block",
    "move_cam",
    "move_circ",
    "plot_block",
    "plot_cam",
    "plot_circ",
    "point_view",
]


def __dir__() -> list[str]:
    """Return the public names."""
    return __all__


P = TypeVar("P", bound=Primitive)
C = TypeVar("C", bound=CameraBody)


@dataclass(frozen=True)
class ClassicCamera(CameraBody):
    """A camera body with intrinsic parameters, as `init_cam` returns it.

    Attributes
    ----------
    intrinsics : (float, float, float, float, float, float)
        Focal length f, pixel sizes px and py, skew angle alpha, and image centre u0 and v0.
    """

    intrinsics: tuple[float, ...] = field(kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        values = as_floats(self.intrinsics, "intrinsics (f, px, py, alpha, u0, v0)", (6,))
        if values.ndim > 1:
            raise InputError(f"intrinsics: expected six numbers, got shape {values.shape}")
        object.__setattr__(self, "intrinsics", tuple(values.tolist()))
        chapter_intrinsics(*self.intrinsics)  # raises InputError for invalid parameters

    @cached_property
    def Ki(self) -> Array:
        """The intrinsic matrix (3, 3) of eq. (10) of the chapter, as used by `point_view`."""
        return make_read_only(chapter_intrinsics(*self.intrinsics))


def init_block(L: float, W: float, H: float, color: str) -> Block:
    """Return a block with its origin at the centre.

    Parameters
    ----------
    L, W, H : float
        Length along x, width along y and height along z in cm.
    color : str
        Any colour of Matplotlib, such as "r".

    Returns
    -------
    Block
        The block.

    Examples
    --------
    >>> init_block(30, 20, 10, "r").vertices.max(axis=0)
    array([15., 10.,  5.])
    """
    return Block(L, W, H, color)


def init_circ(R: float, W: float, n: int, color: str) -> Wheel:
    """Return a wheel: two circles with their origin midway between the centres.

    The x axis points to the first point of each circle, and the z axis along the axle.

    Parameters
    ----------
    R : float
        Radius in cm.
    W : float
        Distance of the circles along z in cm.
    n : int
        Number of points of each circle.
    color : str
        Any colour of Matplotlib.

    Returns
    -------
    Wheel
        The wheel.

    Examples
    --------
    >>> init_circ(10, 4, 16, "k").vertices[[0, 16]].tolist()
    [[10.0, 0.0, -2.0], [10.0, 0.0, 2.0]]
    """
    return Wheel(R, W, n, color)


def init_cam(
    L: float,
    W: float,
    H: float,
    f: float,
    px: float,
    py: float,
    alpha: float,
    u0: float,
    v0: float,
    color: str,
) -> ClassicCamera:
    """Return a camera with its origin at the centre of the back face.

    Parameters
    ----------
    L, W, H : float
        Length along z, width along y and height along x in cm.
    f : float
        Focal length.
    px, py : float
        Sizes of a pixel, in the same unit as f.
    alpha : float
        Skew angle in radians.
    u0, v0 : float
        Row and column of the image centre in pixels.
    color : str
        Any colour of Matplotlib.

    Returns
    -------
    ClassicCamera
        The camera. `cam.Ki` is its intrinsic matrix for `point_view`.

    Examples
    --------
    >>> init_cam(8, 4, 3, 0.8, 1e-3, 1e-3, 0, 240, 320, "b").Ki
    array([[-800.,    0.,  240.],
           [   0.,  800.,  320.],
           [   0.,    0.,    1.]])
    """
    return ClassicCamera(L, W, H, color, intrinsics=(f, px, py, alpha, u0, v0))


def move_block(blk_i: Block, R: ArrayLike, t: ArrayLike) -> Block:
    """Return a copy of a block, displaced by the rigid motion p -> R p + t of its vertices.

    Parameters
    ----------
    blk_i : Block
        Block to move.
    R : array_like of shape (3, 3)
        Rotation matrix.
    t : array_like of shape (3,) or (3, 1)
        Translation in cm.

    Returns
    -------
    Block
        The moved block.

    Raises
    ------
    InputError
        If `blk_i` is not a block, or `R` is not a rotation.

    Examples
    --------
    >>> move_block(init_block(30, 20, 10, "r"), np.eye(3), [0, 0, 5]).vertices.max(axis=0)
    array([15., 10., 10.])
    """
    return _move_primitive(_check_primitive(blk_i, Block, "move_block: blk_i"), R, t)


def move_circ(circ_i: Wheel, R: ArrayLike, t: ArrayLike) -> Wheel:
    """Return a copy of a wheel, displaced by the rigid motion p -> R p + t of its vertices.

    Parameters
    ----------
    circ_i : Wheel
        Wheel to move.
    R : array_like of shape (3, 3)
        Rotation matrix.
    t : array_like of shape (3,) or (3, 1)
        Translation in cm.

    Returns
    -------
    Wheel
        The moved wheel.

    Raises
    ------
    InputError
        If `circ_i` is not a wheel, or `R` is not a rotation.

    Examples
    --------
    >>> move_circ(init_circ(10, 4, 16, "k"), np.eye(3), [[0], [0], [2]]).vertices[0]
    array([10.,  0.,  0.])
    """
    return _move_primitive(_check_primitive(circ_i, Wheel, "move_circ: circ_i"), R, t)


def move_cam(cam_i: C, R: ArrayLike, t: ArrayLike) -> C:
    """Return a copy of a camera, displaced by the rigid motion p -> R p + t of its vertices.

    Parameters
    ----------
    cam_i : CameraBody
        Camera to move.
    R : array_like of shape (3, 3)
        Rotation matrix.
    t : array_like of shape (3,) or (3, 1)
        Translation in cm.

    Returns
    -------
    CameraBody
        The moved camera, of the same class. `cam.pose` is T_c, its pose in the base frame.

    Raises
    ------
    InputError
        If `cam_i` is not a camera body, or `R` is not a rotation.

    Examples
    --------
    >>> cam = init_cam(8, 4, 3, 0.8, 1e-3, 1e-3, 0, 240, 320, "b")
    >>> move_cam(cam, np.eye(3), [0, 0, 5]).pose
    <Pose position [0.0, 0.0, 5.0] rotvec [0.0, 0.0, 0.0]>
    """
    return _move_primitive(_check_primitive(cam_i, CameraBody, "move_cam: cam_i"), R, t)


def plot_block(block: Block) -> list[LineCollection]:
    """Draw the 12 edges of a block in the current 3-D axes (cm).

    3-D axes are created if the current figure has none.

    Parameters
    ----------
    block : Block
        Block to draw.

    Returns
    -------
    list of Line3DCollection
        The artist, as a list of one element.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> [lines] = plot_block(init_block(30, 20, 10, "r"))
    >>> lines.axes.get_xlabel()
    'x (cm)'
    >>> plt.close()
    """
    return _draw_primitive(_check_primitive(block, Block, "plot_block: block"))


def plot_circ(circ: Wheel) -> list[LineCollection]:
    """Draw the two circles of a wheel in the current 3-D axes (cm).

    3-D axes are created if the current figure has none.

    Parameters
    ----------
    circ : Wheel
        Wheel to draw.

    Returns
    -------
    list of Line3DCollection
        The artist, as a list of one element.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> len(plot_circ(init_circ(10, 4, 16, "k")))
    1
    >>> plt.close()
    """
    return _draw_primitive(_check_primitive(circ, Wheel, "plot_circ: circ"))


def plot_cam(cam: CameraBody) -> list[LineCollection]:
    """Draw the 20 edges of a camera in the current 3-D axes (cm).

    3-D axes are created if the current figure has none.

    Parameters
    ----------
    cam : CameraBody
        Camera to draw.

    Returns
    -------
    list of Line3DCollection
        The artist, as a list of one element.

    Examples
    --------
    >>> import matplotlib.pyplot as plt
    >>> len(plot_cam(init_cam(8, 4, 3, 0.8, 1e-3, 1e-3, 0, 240, 320, "b")))
    1
    >>> plt.close()
    """
    return _draw_primitive(_check_primitive(cam, CameraBody, "plot_cam: cam"))


def point_view(p3D: ArrayLike, Ki: ArrayLike, T_c: PoseLike) -> Array:
    """Return the pixels (u, v) = (row, column) of points in a camera image, by eq. (10).

        u = u0 - X f / (Z px cos alpha)
        v = v0 + Y f / (Z py) + X f tan alpha / (Z py)

    (X, Y, Z) is the point in the frame of the camera. X points up, along the height of the camera,
    Y to the right, along its width, and Z along the optical axis. Rows u grow downwards.
    `Camera.project` returns the same pixel as (column, row) = (v, u).

    Parameters
    ----------
    p3D : array_like of shape (3,) or (N, 3)
        Points in the base frame in cm.
    Ki : array_like of shape (3, 3)
        Intrinsic matrix, such as `cam.Ki`.
    T_c : array_like of shape (4, 4) or Pose
        Pose of the camera in the base frame, such as `cam.pose`.

    Returns
    -------
    array of shape (2,) or (N, 2)
        Pixels; NaN for a point behind the camera.

    Raises
    ------
    InputError
        If `Ki` is not the matrix of eq. (10), or `T_c` is not a pose.

    Examples
    --------
    >>> Ki = init_cam(8, 4, 3, 0.8, 1e-3, 1e-3, 0, 240, 320, "b").Ki
    >>> point_view([[10, 0, 100], [0, 10, 100], [0, 0, -100]], Ki, np.eye(4))
    array([[160., 320.],
           [240., 400.],
           [ nan,  nan]])
    """
    points = as_floats(p3D, "p3D", (3,))
    T_w_c = _build_rigid_pose(as_floats(as_matrix(T_c), "T_c", (4, 4)), "T_c") @ T_CHAPTER_CAMERA
    pixels = _build_chapter_camera(Ki).project(np.atleast_2d(points), T_w_c)[..., [1, 0]]
    return pixels[..., 0, :] if points.ndim == 1 else pixels


def _build_chapter_camera(Ki: ArrayLike) -> Camera:
    """Return the camera with an intrinsic matrix of the chapter."""
    matrix = as_floats(Ki, "Ki", (3, 3))
    if matrix.ndim != 2:
        raise InputError(f"Ki: expected one matrix of shape (3, 3), got {matrix.shape}")
    try:
        return Camera(intrinsics_from_chapter(matrix))
    except InputError:
        raise InputError(
            "Ki: expected the matrix of eq. (10), "
            "[[-f/(px cos alpha), 0, u0], [f tan alpha/py, f/py, v0], [0, 0, 1]] with f, px, py "
            f"above zero, as in init_cam(...).Ki; got {matrix.tolist()}"
        ) from None


def _check_primitive(primitive: P, kind: type[Primitive], argument: str) -> P:
    """Return the primitive; raise InputError unless it is a `kind`."""
    if not isinstance(primitive, kind):
        raise InputError(
            f"{argument}: expected a {kind.__name__}, got a {type(primitive).__name__}"
        )
    return primitive


def _move_primitive(primitive: P, R: ArrayLike, t: ArrayLike) -> P:
    """Return a copy of the primitive, moved by R and t."""
    T = np.eye(4)
    T[:3, :3] = _check_matrix_shape(R, "R", (3, 3))
    T[:3, 3] = _check_matrix_shape(t, "t", (3,), (3, 1)).ravel()
    return primitive.at(_build_rigid_pose(T, "R"))


def _check_matrix_shape(value: ArrayLike, argument: str, *shapes: tuple[int, ...]) -> Array:
    """Return an array; raise InputError unless it has one of the shapes."""
    array = as_floats(value, argument, ())
    if array.shape not in shapes:
        expected = " or ".join(map(str, shapes))
        raise InputError(f"{argument}: expected shape {expected}, got {array.shape}")
    return array


def _build_rigid_pose(T: Array, argument: str) -> Pose:
    """Return the pose of a matrix; the error message names the argument."""
    with prefix_errors(argument):
        return Pose(T)


def _draw_primitive(primitive: Block | Wheel | CameraBody) -> list[LineCollection]:
    """Draw the edges of the primitive in the current 3-D axes."""
    from matplotlib.colors import is_color_like
    from mpl_toolkits.mplot3d import art3d

    if not is_color_like(primitive.color):
        raise InputError(f"expected a colour of Matplotlib such as 'r', got {primitive.color!r}")
    axes = _find_3d_axes()
    had_data = axes.has_data()
    lines = art3d.Line3DCollection(primitive.vertices[primitive.edges], colors=primitive.color)
    axes.add_collection3d(lines)
    axes.auto_scale_xyz(*primitive.vertices.T, had_data)
    axes.set(xlabel="x (cm)", ylabel="y (cm)", zlabel="z (cm)")
    axes.set_aspect("equal")
    return [lines]


def _find_3d_axes() -> Axes3D:
    """Return the current axes if they are 3-D, else other 3-D axes of the figure, else new axes."""
    import matplotlib.pyplot as plt

    figure = plt.gcf()
    existing = [figure.gca(), *figure.axes] if figure.axes else []
    for axes in existing:
        if axes.name == "3d":
            return axes
    return (plt.figure() if existing else figure).add_subplot(projection="3d")
