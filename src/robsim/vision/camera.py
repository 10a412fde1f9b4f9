"""The camera model: projection, visibility and distortion.

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
from robsim.base.errors import InputError, said
from robsim.base.values import Value, unchecked
from robsim.geometry.pose import Pose, as_pose, common_lead
from robsim.geometry.primitives import CameraBody
from robsim.kernels import camera as kernels
from robsim.kernels import viewing
from robsim.kernels.program import Function, Program
from robsim.vision.image_size import SIZE

COUNTS = 0, 4, 5, 8  # of lens coefficients that are modelled
UNMODELLED = 12, 14  # of those that OpenCV writes for a thin prism, and for a tilted sensor too
_AXES = {"K": 2, "distortion": 1}  # of one camera; one more where they differ from run to run
TINY = 1e-30  # a coefficient of the lens polynomial below is none


class Visibility(IntEnum):
    """The place of a point relative to a camera: in the image, outside it, or behind."""

    IN_IMAGE = kernels.IN_IMAGE
    OUT_OF_IMAGE = kernels.OUT_OF_IMAGE
    BEHIND_CAMERA = kernels.BEHIND_CAMERA


# pose of our camera axes in the chapter's: our x is its y, our y its -x
T_CHAPTER_CAMERA = Pose([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def intrinsics_from_chapter(Ki: ArrayLike) -> Array:
    """Return K for (column, row) in our axes from the chapter's Ki for (u, v) = (row, column).

    The rows change places, and Ki is written for the chapter's camera axes.
    """
    return numbers(Ki, "Ki", (3, 3))[..., [1, 0, 2], :] @ T_CHAPTER_CAMERA.rotation


def chapter_intrinsics(f: float, px: float, py: float, alpha: float, u0: float, v0: float) -> Array:
    """Return Ki of the chapter's eq. (10): (u, v, 1) = Ki (X/Z, Y/Z, 1), with alpha in radians.

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
            check_focal(self.K[0, 0], self.K[1, 1])
        if not isinstance(self.body, CameraBody | None):
            raise InputError(f"body: expected a CameraBody, got {said(self.body)}")
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
        """Return a camera with the parameters of the chapter's eq. (10), alpha in radians.

        f, px and py are in one unit; u0 is the row and v0 the column of the image centre.

        >>> Camera.from_chapter(8e-3, 1e-5, 1e-5, 0, u0=240, v0=320).K[0]
        array([800.,   0., 320.])
        """
        Ki = chapter_intrinsics(f, px, py, alpha, u0, v0)
        return cls(intrinsics_from_chapter(Ki), size, body=body)

    def project(self, points: ArrayLike, T_w_c: Any) -> Array:
        """Return pixels (..., N, 2) = (column, row) of points (N, 3) or (..., N, 3).

        `T_w_c` (..., 4, 4) is the pose of the camera in the frame of the points. Pixels of points
        behind the camera are NaN, see `visibility`.

        >>> Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]).project([[0.1, 0, 2]], Pose.at())
        array([[360., 240.]])
        """
        pixels, _, lead = self._look(points, T_w_c)
        return runs_first(pixels, lead)

    def visibility(self, points: ArrayLike, T_w_c: Any) -> NDArray[np.int8]:
        """Return the `Visibility` (..., N) of points: in the image, outside it, or behind.

        >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
        >>> camera.visibility([[0, 0, 1], [9, 0, 1], [0, 0, -1]], Pose.at()).tolist()
        [0, 1, 2]
        """
        _, status, lead = self._look(points, T_w_c)
        return runs_first(status, lead)

    def normalise(self, pixels: ArrayLike) -> Array:
        """Return the undistorted points (..., N, 2) at unit depth that project to these pixels.

        NaN for a pixel that the lens cannot reach.

        >>> Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]).normalise([[400, 240]])
        array([[0.1, 0. ]])
        """
        first = numbers(pixels, "pixels", ("N", 2))
        return runs_first(self.points_of(runs_last(first, 2)), first.shape[:-2])

    @cached_property
    def lens(self) -> Array:
        """The eight distortion coefficients (k1, k2, p1, p2, k3, k4, k5, k6)."""
        given = np.array(self.distortion)
        return frozen(np.concatenate([given, np.zeros((8 - len(given), *given.shape[1:]))]))

    @cached_property
    def bends(self) -> bool:
        """Whether the lens distorts."""
        return bool(self.lens.any())

    @cached_property
    def rows(self) -> Array:
        """The numbers (22, 1) in the order of `kernels.viewing`, or (22, runs) where they differ.

        As the experiments of a sweep have it: then K is (3, 3, runs), or `distortion` (n, runs).
        """
        given = (self.K, 9), (self.lens, 8), (self.border, 4), (self.valid_radius, 1)
        parts = [np.reshape(values, (count, -1)) for values, count in given]
        runs = max(part.shape[1] for part in parts)
        return np.concatenate([np.broadcast_to(part, (len(part), runs)) for part in parts])

    def of_runs(self, runs: NDArray[np.int64]) -> Camera:
        """Return the camera of some of the runs, by number."""
        if self.rows.shape[1] == 1:
            return self
        chosen = {"K": self.K, "distortion": np.array(self.distortion)}
        return unchecked(self, **{k: v[..., runs] for k, v in chosen.items() if v.ndim != _AXES[k]})

    def image_of(self, X: Array) -> tuple[Array, NDArray[np.int8]]:
        """Return pixels (N, 2, B) and visibility (N, B) of points X (N, 3, B) in camera axes."""
        seen = self._each(self._image, X)
        return np.ascontiguousarray(seen[:, :2]), seen[:, 2].astype(np.int8)

    def points_of(self, pixels: Array) -> Array:
        """Return the undistorted points (N, 2, B) at unit depth of pixels (N, 2, B), or NaN."""
        return self._each(self._straight, pixels)

    def _each(self, function: Function, x: Array) -> Array:
        """Return a function (N, m, B) of N columns x (N, n, B)."""
        N, n, runs = x.shape
        runs = runs if self.rows.shape[1] == 1 else max(runs, self.rows.shape[1])
        wide = np.broadcast_to(x, (N, n, runs))
        columns = np.ascontiguousarray(wide.transpose(1, 0, 2)).reshape(n, N * runs)
        found = function(columns, np.tile(np.arange(runs), N))
        return np.ascontiguousarray(found.reshape(len(found), N, runs).transpose(1, 0, 2))

    @cached_property
    def _image(self) -> Function:
        """The pixel and the visibility of a point in camera axes."""
        program = Program()
        X, found, depth = program.rows(3), program.rows(3), program.rows()
        here, eye = program.constant(np.eye(3, 4)), program.each(self.rows)
        given = X, 1, here, here, eye, self.bends, found, depth, found + 2
        program.add(viewing.project, *given, viewing.EACH)
        return Function(program, X, found, 3)

    @cached_property
    def _straight(self) -> Function:
        """The undistorted point of a pixel."""
        program = Program()
        pixel, point = program.rows(2), program.rows(2)
        program.add(viewing.normalise, program.each(self.rows), 1, pixel, point, self.bends)
        return Function(program, pixel, point, 2)

    @cached_property
    def border(self) -> Array:
        """The limits ((left, right), (top, bottom)) of the image; right and bottom are excluded."""
        low, high = (-np.inf, np.inf) if self.size is None else (-0.5, np.array(self.size) - 0.5)
        return frozen(np.stack([np.full(2, low), np.broadcast_to(high, 2)], axis=1))

    @cached_property
    def valid_radius(self) -> Any:
        """The normalised radius up to which distortion is monotonic; beyond it, the image folds.

        The smallest positive root of d/dr (r N(r^2) / D(r^2)), and of D.
        """
        if self.lens.ndim > 1:
            each = (Camera(np.eye(3), distortion=tuple(lens)) for lens in self.lens.T)
            return np.array([camera.valid_radius for camera in each])
        k1, k2, _, _, k3, k4, k5, k6 = self.lens
        over, under = np.polynomial.Polynomial([1, k1, k2, k3]), np.polynomial.Polynomial([1, k4, k5, k6])  # fmt: skip  # noqa: E501
        t = np.polynomial.Polynomial([0, 1])  # r squared
        slope = over * under + 2 * t * (over.deriv() * under - over * under.deriv())
        roots = np.concatenate([slope.trim(TINY).roots(), under.trim(TINY).roots()])
        real = roots[(np.abs(roots.imag) < 1e-12) & (roots.real > 0)].real
        return float(np.sqrt(real.min())) if real.size else np.inf

    def drawn(self, T_w_c: Any) -> CameraBody | None:
        """Return the camera body at its pose; it has the chapter's axes (x up, y to the right)."""
        return self.body and self.body.at(as_pose(T_w_c) @ T_CHAPTER_CAMERA.inv())

    def _look(
        self, points: ArrayLike, T_w_c: Any
    ) -> tuple[Array, NDArray[np.int8], tuple[int, ...]]:
        """Return run-last pixels and visibility of points, and their leading shape."""
        p, T = numbers(points, "points", ("N", 3)), as_pose(T_w_c).matrix
        lead = common_lead(p.shape[:-2], T.shape[:-2], "points and camera poses")
        inv = Pose(T).inv()
        X = runs_last(np.broadcast_to(inv @ p, (*lead, p.shape[-2], 3)), 2)
        return *self.image_of(X), lead


def check_focal(fx: float, fy: float) -> None:
    """Raise InputError for focal lengths below a pixel, which no lens before an image has."""
    least = min(fx, fy)
    if least < 1.0:
        raise InputError(
            f"a focal length of {least:g} pixels: is it in metres? In pixels it is that divided by "
            f"the size of a pixel, {least:g} / 1e-5 = {least / 1e-5:g} for pixels of 10 micrometres"
        )


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
