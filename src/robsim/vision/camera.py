"""The camera: what it sees of points in the world.

Camera axes are those of computer vision: x to the right, y down, z along the optical axis; a
pixel is (column, row). The chapter's own camera axes (x up, y to the right; u the row, v the
column) are turned into these here and nowhere else.
"""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from enum import IntEnum
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, frozen, numbers, positive, runs_first, runs_last
from robsim.base.errors import InputError
from robsim.base.values import Value
from robsim.declare import ListOf, Whole
from robsim.declare.spec import Spec
from robsim.geometry.pose import Pose, as_pose, common_lead
from robsim.geometry.primitives import CameraBody
from robsim.kernels import camera as kernels

COUNTS = 0, 4, 5, 8  # of lens coefficients that are modelled
UNMODELLED = 12, 14  # of those that OpenCV writes for a thin prism, and for a tilted sensor too
TINY = 1e-30  # a coefficient of the lens polynomial below is none

PIXELS = Whole(1, 1_000_000)


class Visibility(IntEnum):
    """Where a point is for a camera."""

    IN_IMAGE = kernels.IN_IMAGE
    OUT_OF_IMAGE = kernels.OUT_OF_IMAGE
    BEHIND_CAMERA = kernels.BEHIND_CAMERA


# pose of our camera axes in the chapter's: our x is its y, our y its -x
T_CHAPTER_CAMERA = Pose([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def intrinsics_from_chapter(Ki: ArrayLike) -> Array:
    """K for (column, row) in our axes from the chapter's Ki for (u, v) = (row, column).

    The rows change places, and Ki is written for the chapter's camera axes.
    """
    return numbers(Ki, "Ki", (3, 3))[..., [1, 0, 2], :] @ T_CHAPTER_CAMERA.rotation


def chapter_intrinsics(f: float, px: float, py: float, alpha: float, u0: float, v0: float) -> Array:
    """The matrix Ki of the chapter's eq. (10): (u, v, 1) = Ki (X/Z, Y/Z, 1), alpha in radians.

    u = u0 - X f / (Z px cos alpha), v = v0 + Y f / (Z py) + X f tan alpha / (Z py)

    >>> chapter_intrinsics(8e-3, 1e-5, 1e-5, 0.0, 240, 320)[0]
    array([-800.,    0.,  240.])
    """
    f, px, py = positive(f, "f"), positive(px, "px"), positive(py, "py")
    a, u0, v0 = numbers([alpha, u0, v0], "alpha, u0, v0", (3,))
    if not abs(a) < np.pi / 2:
        raise InputError(f"alpha is the skew angle in radians, within +-pi/2, got {a}")
    return np.array([[-f / (px * np.cos(a)), 0, u0], [f * np.tan(a) / py, f / py, v0], [0, 0, 1]])


@dataclass(frozen=True, eq=False)
class Camera(Value):
    """A perspective camera with skew and radial-tangential distortion.

    K is [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] in pixels; `size` is (width, height) in pixels,
    None for an image without border; `distortion` is (k1, k2, p1, p2[, k3[, k4, k5, k6]]) in the
    order and in any shape of OpenCV's `dist`: flat, a row or a column, with the coefficients of a
    thin prism and a tilted sensor (12 or 14 numbers) if these are zero; a flat tuple of at most
    eight is kept. Pixel centres are whole numbers, so an image covers [-0.5, width - 0.5).

    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
    >>> camera.project([[0.1, 0, 1], [0, 0, -1]], Pose.at())
    array([[400., 240.],
           [ nan,  nan]])
    """

    K: Any
    size: tuple[int, int] | None = None
    _: KW_ONLY
    body: CameraBody | None = None
    distortion: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "K", frozen(_checked_intrinsics(self.K)))
        if self.size is not None:
            object.__setattr__(self, "size", SIZE.check(self.size, "image size"))
        if not isinstance(self.body, CameraBody | None):
            raise InputError(f"body: expected a CameraBody, got {self.body!r:.80}")
        object.__setattr__(self, "distortion", _checked_distortion(self.distortion))

    @classmethod
    def from_chapter(
        cls,
        f: float,
        px: float,
        py: float,
        alpha: float,
        u0: float,
        v0: float,
        *,
        size: tuple[int, int] | None = None,
        body: CameraBody | None = None,
    ) -> Camera:
        """From the parameters of the chapter's eq. (10): f, px, py in one unit, alpha in radians.

        There u0 is the row and v0 the column of the image centre.

        >>> Camera.from_chapter(8e-3, 1e-5, 1e-5, 0, u0=240, v0=320).K[0]
        array([800.,   0., 320.])
        """
        Ki = chapter_intrinsics(f, px, py, alpha, u0, v0)
        return cls(intrinsics_from_chapter(Ki), size, body=body)

    def project(self, points: ArrayLike, T_w_c: Any) -> Array:
        """Pixels (..., N, 2) = (column, row) of points (N, 3) or (..., N, 3); NaN behind.

        `T_w_c` (..., 4, 4) is the pose of the camera. See `visibility` for the flags.

        >>> Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]).project([[0.1, 0, 2]], Pose.at())
        array([[360., 240.]])
        """
        _, pixels, lead = self._look(points, T_w_c)
        return runs_first(pixels, lead)

    def visibility(self, points: ArrayLike, T_w_c: Any) -> NDArray[np.int8]:
        """(..., N) of `Visibility`: in the image, out of it, or behind the camera.

        >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
        >>> camera.visibility([[0, 0, 1], [9, 0, 1], [0, 0, -1]], Pose.at()).tolist()
        [0, 1, 2]
        """
        X, pixels, lead = self._look(points, T_w_c)
        status = np.empty((X.shape[0], X.shape[2]), dtype=np.int8)
        kernels.visibility(X, pixels, self.border, self.valid_radius, status)
        return runs_first(status, lead)

    def normalise(self, pixels: ArrayLike) -> Array:
        """(..., N, 2) points at unit depth that project to these pixels: undistorted.

        NaN for a pixel that the lens cannot reach.

        >>> Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]).normalise([[400, 240]])
        array([[0.1, 0. ]])
        """
        first = numbers(pixels, "pixels", ("N", 2))
        last = runs_last(first, 2)
        x = np.empty_like(last)
        kernels.normalise(last, self.K, self.lens, self.valid_radius, x)
        return runs_first(x, first.shape[:-2])

    @cached_property
    def lens(self) -> Array:
        """The eight numbers (k1, k2, p1, p2, k3, k4, k5, k6)."""
        return frozen(np.pad(np.array(self.distortion), (0, 8 - len(self.distortion))))

    @cached_property
    def border(self) -> Array:
        """((left, right), (top, bottom)) of the image, right and bottom not included."""
        low, high = (-np.inf, np.inf) if self.size is None else (-0.5, np.array(self.size) - 0.5)
        return frozen(np.stack([np.full(2, low), np.broadcast_to(high, 2)], axis=1))

    @cached_property
    def valid_radius(self) -> float:
        """The normalised radius up to which the lens moves points outwards; beyond, it folds.

        The smallest positive root of d/dr (r N(r^2) / D(r^2)), and of D.
        """
        k1, k2, _, _, k3, k4, k5, k6 = self.lens
        over, under = np.polynomial.Polynomial([1, k1, k2, k3]), np.polynomial.Polynomial([1, k4, k5, k6])  # fmt: skip  # noqa: E501
        t = np.polynomial.Polynomial([0, 1])  # r squared
        slope = over * under + 2 * t * (over.deriv() * under - over * under.deriv())
        roots = np.concatenate([slope.trim(TINY).roots(), under.trim(TINY).roots()])
        real = roots[(np.abs(roots.imag) < 1e-12) & (roots.real > 0)].real
        return float(np.sqrt(real.min())) if real.size else np.inf

    def drawn(self, T_w_c: Any) -> CameraBody | None:
        """The body where it is drawn; it keeps the chapter's axes (x up, y to the right)."""
        return self.body and self.body.at(as_pose(T_w_c) @ T_CHAPTER_CAMERA.inv())

    def _look(self, points: ArrayLike, T_w_c: Any) -> tuple[Array, Array, tuple[int, ...]]:
        """Run-last points in camera axes and pixels, and the leading shape."""
        p, T = numbers(points, "points", ("N", 3)), as_pose(T_w_c).matrix
        lead = common_lead(p.shape[:-2], T.shape[:-2], "points and camera poses")
        inv = Pose(T).inv()
        X = runs_last(np.broadcast_to(inv @ p, (*lead, p.shape[-2], 3)), 2)
        pixels = np.empty((X.shape[0], 2, X.shape[2]))
        kernels.project(X, self.K, self.lens, pixels)
        return X, pixels, lead


def _checked_intrinsics(given: Any) -> Array:
    K = numbers(given, "K", (3, 3))
    if K.ndim != 2 or K[1, 0] != 0 or not np.array_equal(K[2], (0, 0, 1)):
        raise InputError(f"K must be [[fx, skew, cx], [0, fy, cy], [0, 0, 1]], got {K.tolist()}")
    if not (K[0, 0] > 0 and K[1, 1] > 0):
        raise InputError(f"K: focal lengths must be above zero, got {K[0, 0]} and {K[1, 1]} px")
    return K


def _checked_distortion(given: Any) -> tuple[float, ...]:
    """The coefficients in a flat tuple, from a row, a column or a flat array of OpenCV."""
    array = numbers(given, "distortion", ())
    lens = array.ravel()
    if array.ndim not in (1, 2) or lens.size not in (*COUNTS, *UNMODELLED):
        raise InputError(
            "distortion: expected 0, 4 (k1 k2 p1 p2), 5 (.. k3) or 8 (.. k4 k5 k6) numbers, flat, "
            f"in a row or in a column, got shape {array.shape}"
        )
    if array.ndim == 2 and 1 not in array.shape and lens.size:
        raise InputError(f"distortion: expected one row or column, got shape {array.shape}")
    if lens[8:].any():
        raise InputError(
            "distortion: thin prisms and tilted sensors (s1 s2 s3 s4 tau_x tau_y, from the ninth "
            f"on) are not modelled: these coefficients must be zero, got {lens[8:].tolist()}"
        )
    if (np.abs(lens) > 1e6).any():
        raise InputError(f"distortion: coefficients are at most 1e6, got {lens.tolist()}")
    return tuple(lens[:8].tolist())


@dataclass(frozen=True)
class ImageSize(ListOf):
    """Width and height of an image in whole pixels."""

    item: Spec = PIXELS
    least: int = 2
    most: int = 2

    def check(self, value: Any, what: str) -> tuple[int, int]:
        pair = numbers(value, what, ())
        if pair.shape != (2,) or (pair < 1).any() or (pair != np.round(pair)).any():
            raise InputError(f"{what} must be (width, height) in whole pixels, got {value!r}")
        return int(pair[0]), int(pair[1])

    def words(self) -> str:
        return "[width, height] in pixels"


SIZE = ImageSize()
