"""The chapter's ten functions, under its names and with its arguments, in centimetres.

A block is a `Block`, a circ (wheel) a `Wheel`, a cam a `CameraBody` with its intrinsic parameters;
here their numbers are centimetres, and nothing is converted. Moving makes a moved copy.

>>> from robsim.classic import *
>>> cam = init_cam(8, 4, 3, 0.8, 1e-3, 1e-3, 0, 240, 320, "b")
>>> cam = move_cam(cam, np.diag([1, -1, -1]), [0, 0, 100])  # a metre up, looking down
>>> point_view([0, 5, 20], cam.Ki, cam.pose)
array([240., 270.])
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError, prefix_errors
from robsim.geometry.pose import Pose, as_matrix
from robsim.geometry.primitives import Block, CameraBody, Primitive, Wheel
from robsim.vision.camera import Camera
from robsim.vision.chapter import T_CHAPTER_CAMERA, chapter_intrinsics, intrinsics_from_chapter

if TYPE_CHECKING:
    from matplotlib.collections import LineCollection

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

P = TypeVar("P", bound=Primitive)
C = TypeVar("C", bound=CameraBody)


@dataclass(frozen=True)
class ClassicCamera(CameraBody):
    """A camera body with its `intrinsics` (f, px, py, alpha, u0, v0); see `init_cam`."""

    intrinsics: tuple[float, ...] = field(kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        given = as_floats(self.intrinsics, "intrinsics (f, px, py, alpha, u0, v0)", (6,))
        if given.ndim > 1:
            raise InputError(f"intrinsics: expected six numbers, got shape {given.shape}")
        object.__setattr__(self, "intrinsics", tuple(given.tolist()))
        chapter_intrinsics(*self.intrinsics)  # raises InputError for invalid parameters

    @cached_property
    def Ki(self) -> Array:
        """The intrinsic matrix (3, 3) of the chapter's eq. (10), as `point_view` takes it."""
        return make_read_only(chapter_intrinsics(*self.intrinsics))


def init_block(L: float, W: float, H: float, color: str) -> Block:
    """Return a block of length L along x, width W along y and height H along z, in cm.

    The origin is its centre.

    `color` is any colour of Matplotlib, such as "r".

    >>> init_block(30, 20, 10, "r").vertices.max(axis=0)
    array([15., 10.,  5.])
    """
    return Block(L, W, H, color)


def init_circ(R: float, W: float, n: int, color: str) -> Wheel:
    """Return a wheel: two circles of radius R and n points each, W apart along z, in cm.

    The origin lies midway between the centres, x points to the first point of each circle.

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
    """Return a camera of length L along z, height H along x and width W along y, in cm.

    The origin is the centre of the back face. f, the focal length, and px, py, the sizes of a
    pixel, share one unit of length; alpha is the skew angle in radians; (u0, v0) = (row, column)
    is the image centre in pixels. `cam.Ki` is their matrix for `point_view`.

    >>> init_cam(8, 4, 3, 0.8, 1e-3, 1e-3, 0, 240, 320, "b").Ki
    array([[-800.,    0.,  240.],
           [   0.,  800.,  320.],
           [   0.,    0.,    1.]])
    """
    return ClassicCamera(L, W, H, color, intrinsics=(f, px, py, alpha, u0, v0))


def move_block(blk_i: Block, R: ArrayLike, t: ArrayLike) -> Block:
    """Return the block with every point p moved to R p + t.

    R (3, 3) is a rotation, and t is (3,) or (3, 1) in cm.

    >>> move_block(init_block(30, 20, 10, "r"), np.eye(3), [0, 0, 5]).vertices.max(axis=0)
    array([15., 10., 10.])
    """
    return _move_primitive(_check_primitive(blk_i, Block, "move_block: blk_i"), R, t)


def move_circ(circ_i: Wheel, R: ArrayLike, t: ArrayLike) -> Wheel:
    """Return the wheel with every point p moved to R p + t.

    R (3, 3) is a rotation, and t is (3,) or (3, 1) in cm.

    >>> move_circ(init_circ(10, 4, 16, "k"), np.eye(3), [[0], [0], [2]]).vertices[0]
    array([10.,  0.,  0.])
    """
    return _move_primitive(_check_primitive(circ_i, Wheel, "move_circ: circ_i"), R, t)


def move_cam(cam_i: C, R: ArrayLike, t: ArrayLike) -> C:
    """Return the camera with every point p moved to R p + t.

    R (3, 3) is a rotation, and t is (3,) or (3, 1) in cm.

    `cam.pose` is then T_c, the pose of the camera in the base frame.

    >>> cam = init_cam(8, 4, 3, 0.8, 1e-3, 1e-3, 0, 240, 320, "b")
    >>> move_cam(cam, np.eye(3), [0, 0, 5]).pose
    <Pose position [0.0, 0.0, 5.0] rotvec [0.0, 0.0, 0.0]>
    """
    return _move_primitive(_check_primitive(cam_i, CameraBody, "move_cam: cam_i"), R, t)


def plot_block(block: Block) -> list[LineCollection]:
    """Draw the block's 12 edges in the current 3-D axes (cm), as Matlab's plot3 would.

    3-D axes are made where the current figure has none. Returns the artists: a list of one
    Line3DCollection.

    >>> import matplotlib.pyplot as plt
    >>> [lines] = plot_block(init_block(30, 20, 10, "r"))
    >>> lines.axes.get_xlabel()
    'x (cm)'
    >>> plt.close()
    """
    return _draw_primitive(_check_primitive(block, Block, "plot_block: block"))


def plot_circ(circ: Wheel) -> list[LineCollection]:
    """Draw the wheel's two circles in the current 3-D axes (cm); returns as `plot_block`.

    >>> import matplotlib.pyplot as plt
    >>> len(plot_circ(init_circ(10, 4, 16, "k")))
    1
    >>> plt.close()
    """
    return _draw_primitive(_check_primitive(circ, Wheel, "plot_circ: circ"))


def plot_cam(cam: CameraBody) -> list[LineCollection]:
    """Draw the camera's 20 edges in the current 3-D axes (cm); returns as `plot_block`.

    >>> import matplotlib.pyplot as plt
    >>> len(plot_cam(init_cam(8, 4, 3, 0.8, 1e-3, 1e-3, 0, 240, 320, "b")))
    1
    >>> plt.close()
    """
    return _draw_primitive(_check_primitive(cam, CameraBody, "plot_cam: cam"))


def point_view(p3D: ArrayLike, Ki: ArrayLike, T_c: Any) -> Array:
    """Return the pixel (u, v) = (row, column) at which a camera sees a point: eq. (10).

    u = u0 - X f / (Z px cos alpha), v = v0 + Y f / (Z py) + X f tan alpha / (Z py)

    (X, Y, Z) is the point in the camera's frame: X up along its height, Y to the right along its
    width, Z along the optical axis; so rows u grow downwards. (`Camera.project` gives the same
    pixel as (column, row) = (v, u).)

    `p3D` (3,) or (N, 3) in the base frame, cm; `Ki` (3, 3) as in `cam.Ki`; `T_c` (4, 4), the pose
    of the camera in the base frame, as in `cam.pose`. Returns (2,) or (N, 2); NaN for a point
    behind the camera.

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


def _check_primitive(given: P, kind: type[Primitive], what: str) -> P:
    if not isinstance(given, kind):
        raise InputError(f"{what}: expected a {kind.__name__}, got a {type(given).__name__}")
    return given


def _move_primitive(primitive: P, R: ArrayLike, t: ArrayLike) -> P:
    """Return a copy of the primitive, moved rigidly."""
    T = np.eye(4)
    T[:3, :3] = _check_matrix_shape(R, "R", (3, 3))
    T[:3, 3] = _check_matrix_shape(t, "t", (3,), (3, 1)).ravel()
    return primitive.at(_build_rigid_pose(T, "R"))


def _check_matrix_shape(value: ArrayLike, what: str, *shapes: tuple[int, ...]) -> Array:
    array = as_floats(value, what, ())
    if array.shape not in shapes:
        expected = " or ".join(map(str, shapes))
        raise InputError(f"{what}: expected shape {expected}, got {array.shape}")
    return array


def _build_rigid_pose(T: Array, what: str) -> Pose:
    """Return the pose of a matrix; an error names the argument `what`."""
    with prefix_errors(what):
        return Pose(T)


def _draw_primitive(primitive: Block | Wheel | CameraBody) -> list[LineCollection]:
    """Add the primitive's wire frame to the current 3-D axes."""
    from matplotlib.colors import is_color_like
    from mpl_toolkits.mplot3d import art3d  # type: ignore[import-untyped]

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


def _find_3d_axes() -> Any:
    """Return the current axes if 3-D, else others of the figure that are, else new ones."""
    import matplotlib.pyplot as plt

    figure = plt.gcf()
    existing = [figure.gca(), *figure.axes] if figure.axes else []
    for axes in existing:
        if axes.name == "3d":
            return axes
    return (plt.figure() if existing else figure).add_subplot(projection="3d")
