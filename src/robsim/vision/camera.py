"""The camera model: projection, visibility and distortion.

Camera axes follow computer vision: x to the right, y down, z along the optical axis. A pixel is
(column, row). The chapter has other axes (x up, y to the right) and other pixels (u is the row, v
the column); see `robsim.vision.chapter`.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, as_floats, make_read_only, move_runs_first, move_runs_last
from robsim.base.errors import InputError, format_value
from robsim.base.named_integers import NamedInteger
from robsim.base.parameter_names import name_parameters
from robsim.base.value import Value, replace_unchecked
from robsim.geometry.pose import Pose, PoseLike, as_pose, broadcast_leading_shape
from robsim.geometry.primitives import CameraBody
from robsim.kernels.formulas import perspective as kernels
from robsim.kernels.images import projection
from robsim.kernels.machine.program import Program, ProgramFunction
from robsim.vision.camera_checks import check_distortion, check_focal, check_intrinsics, check_lens
from robsim.vision.camera_files import camera_info
from robsim.vision.camera_files.calibration_files import CalibrationOrigin, load_camera, save_camera
from robsim.vision.chapter import T_CHAPTER_CAMERA, chapter_intrinsics, intrinsics_from_chapter
from robsim.vision.crop_and_scale import crop_intrinsics, scale_intrinsics
from robsim.vision.image_size import SIZE
from robsim.vision.intrinsics import PART_INDICES, get_intrinsic_part, replace_intrinsic_part
from robsim.vision.lens_models import LENS_MODELS, LensModel

_SINGLE_NDIM = {"K": 2, "distortion": 1}  # number of dimensions if all runs have the same values


class Visibility(NamedInteger):
    """The position of a point relative to a camera: in the image, outside it, or behind.

    Examples
    --------
    >>> Visibility(2)
    <Visibility.BEHIND_CAMERA: 2>
    """

    IN_IMAGE = kernels.IN_IMAGE
    OUT_OF_IMAGE = kernels.OUT_OF_IMAGE
    BEHIND_CAMERA = kernels.BEHIND_CAMERA


@name_parameters
@dataclass(frozen=True, eq=False)
class Camera(Value):
    """A camera with skew and a perspective or fisheye lens with distortion.

    A point (X, Y, Z) in camera axes has the normalised coordinates x = X/Z, y = Y/Z, which a
    perspective lens distorts to

        x' = x s + 2 p1 x y + p2 (r^2 + 2 x^2),    y' = y s + p1 (r^2 + 2 y^2) + 2 p2 x y,
        s = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6),    r^2 = x^2 + y^2,

    and a fisheye lens to

        x' = x d / r,    y' = y d / r,    theta = atan(r),
        d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8),

    and the pixel is K (x', y', 1). Pixel centres are whole numbers, so an image covers the columns
    [-0.5, width - 0.5). A point with Z <= 0 is behind the camera, also for a fisheye lens.

    Parameters
    ----------
    K : array_like of shape (3, 3)
        Matrix of intrinsics [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] in pixels.
    size : (int, int), optional
        Width and height of the image in pixels. None: the image is unbounded.
    body : CameraBody, optional
        Housing of the camera, shown in figures.
    distortion : array_like, default ()
        Distortion coefficients in the order of OpenCV, as a flat array, a row or a column:
        (k1, k2, p1, p2[, k3[, k4, k5, k6]]) of a perspective lens, (k1, k2, k3, k4) of a fisheye.
        The further coefficients of a thin prism and a tilted sensor (12 or 14 numbers in all) must
        be zero. The attribute is a flat tuple of at most eight numbers; a fisheye has four.
    lens : {"perspective", "fisheye"}, default "perspective"
        Model of the lens. "fisheye" is the model of Kannala and Brandt in OpenCV's module
        `fisheye`, which is "equidistant" in ROS and Kalibr.

    Attributes
    ----------
    origin : CalibrationOrigin or None
        Calibration file that the camera was read from, with the SHA-256 of its content. A changed
        copy has none.

    Raises
    ------
    InputError
        If K is not a matrix of intrinsics, a camera with a size has a focal length below one pixel,
        the model of the lens is unknown, or the distortion has another number of coefficients, or
        coefficients of a thin prism or a tilted sensor.

    Examples
    --------
    >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
    >>> camera.project([[0.1, 0, 1], [0, 0, -1]], Pose.at())
    array([[400., 240.],
           [ nan,  nan]])
    """

    K: Array
    size: tuple[int, int] | None = None
    _: KW_ONLY
    body: CameraBody | None = None
    distortion: tuple[float, ...] = ()
    lens: str = "perspective"
    origin: CalibrationOrigin | None = field(default=None, init=False, repr=False, compare=False)

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            K: ArrayLike,
            size: Sequence[int] | None = None,
            *,
            body: CameraBody | None = None,
            distortion: ArrayLike = (),
            lens: str = "perspective",
        ) -> None: ...

    def __post_init__(self) -> None:
        object.__setattr__(self, "K", make_read_only(check_intrinsics(self.K)))
        if self.size is not None:
            object.__setattr__(self, "size", SIZE.check(self.size, "image size"))
            check_focal(self.K[0, 0], self.K[1, 1])
        if not isinstance(self.body, CameraBody | None):
            raise InputError(f"body: expected a CameraBody, got {format_value(self.body)}")
        model = check_lens(self.lens)
        object.__setattr__(self, "distortion", check_distortion(self.distortion, model))

    @property
    def focal(self) -> float | Array:
        """The focal length in pixels, or both focal lengths (2,) if they differ."""
        focal: float | Array = get_intrinsic_part(self.K, "focal")
        return focal

    @property
    def center(self) -> Array:
        """The principal point (2,) in pixels."""
        point: Array = get_intrinsic_part(self.K, "center")
        return point

    @property
    def skew(self) -> float:
        """The skew of the image axes, in pixels."""
        return float(get_intrinsic_part(self.K, "skew"))

    def revised(self, **changes: Any) -> Camera:  # Any: values of the fields named
        """Return a copy with another K, focal, center, skew, size, distortion, lens or body.

        Examples
        --------
        >>> Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]).revised(focal=900).K[0]
        array([900.,   0., 320.])
        """
        K = self.K
        for name in PART_INDICES.keys() & changes:
            K = replace_intrinsic_part(K, name, changes.pop(name))
        return replace(self, **{"K": K, **changes})

    def held(self, **changes: Array) -> Camera:
        """Return the cameras of a batch, with parameters (..., runs) that differ between runs."""
        K, parts = self.K, {name: changes.pop(name) for name in PART_INDICES.keys() & changes}
        for name, new in parts.items():
            wide = np.repeat(K[..., None], new.shape[-1], axis=2) if K.ndim == 2 else K
            K = make_read_only(replace_intrinsic_part(wide, name, new))
        return replace_unchecked(self, **{"K": K, **changes})

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
        """Return a camera from the parameters of eq. (10) of the chapter.

        A point (X, Y, Z) in the camera axes of the chapter (x up, y to the right) has the pixel

            u = u0 - f X / (Z px cos alpha),    v = v0 + f (Y + X tan alpha) / (Z py),

        with the row u and the column v. The camera that is returned has the axes and the pixels
        (column, row) of this package.

        Parameters
        ----------
        f, px, py : float
            Focal length, and height and width of a pixel, in the same unit.
        alpha : float
            Skew angle in radians, between -pi/2 and pi/2.
        u0, v0 : float
            Row and column of the principal point in pixels.
        size : (int, int), optional
            Width and height of the image in pixels.
        body : CameraBody, optional
            Housing of the camera, shown in figures.

        Raises
        ------
        InputError
            If a length is not positive, or the skew angle is outside its range.

        Examples
        --------
        >>> Camera.from_chapter(8e-3, 1e-5, 1e-5, 0, u0=240, v0=320).K[0]
        array([800.,   0., 320.])
        """
        Ki = chapter_intrinsics(f, px, py, alpha, u0, v0)
        return cls(intrinsics_from_chapter(Ki), size, body=body)

    @classmethod
    def from_file(
        cls,
        path: str | os.PathLike[str],
        name: str | None = None,
        *,
        lens: Literal["perspective", "fisheye"] | None = None,
    ) -> Camera:
        """Return the camera of a calibration file of OpenCV, ROS, Kalibr or COLMAP.

        The format is detected from the content; docs/cameras.md lists the supported formats. YAML
        needs the extra `vision`.

        Parameters
        ----------
        path : path_like
            Calibration file.
        name : str, optional
            Name of the camera if the file has several: "cam0", or the number in COLMAP.
        lens : {"perspective", "fisheye"}, optional
            Model of the lens in a file that does not name it, such as K and D of `cv2.fisheye`. By
            default such a file has a perspective lens.

        Raises
        ------
        FileError
            If the file is not a calibration file, the file has several cameras and `name` is None,
            the file names another model than `lens`, or the camera model is not supported, for
            example an omnidirectional lens.

        Examples
        --------
        >>> Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], (640, 480)).to_file("eye.xml").name
        'eye.xml'
        >>> Camera.from_file("eye.xml").size
        (640, 480)
        """
        model = None if lens is None else check_lens(lens).name
        camera, origin = load_camera(path, name, cls, model)
        return camera.read_from(origin)

    def read_from(self, origin: CalibrationOrigin | None) -> Camera:
        """Return the camera with the file that it was read from; it remains equal.

        Examples
        --------
        >>> Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]).read_from(None).origin is None
        True
        """
        return replace_unchecked(self, origin=origin)

    def to_file(self, path: str | os.PathLike[str]) -> Path:
        """Write a calibration file, which `from_file` reads without loss, and return its path.

        Parameters
        ----------
        path : path_like
            File to write. The suffix selects the format: ".yaml" or ".yml" for OpenCV and ROS,
            ".xml" for OpenCV, ".txt" for COLMAP's cameras.txt.

        Raises
        ------
        FileError
            If the suffix is unknown, the camera has a skew, which these formats cannot store, or
            COLMAP needs the size of the image and the camera has none.

        Examples
        --------
        >>> Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], (640, 480)).to_file("eye.yaml").name
        'eye.yaml'
        """
        return save_camera(path, self.K, self.size, self.distortion, self.lens)

    @classmethod
    def from_ros(cls, message: object, *, rectified: bool = False) -> Camera:
        """Return the camera of a ROS message `sensor_msgs/CameraInfo`.

        The camera describes the published image, with binning and region of interest applied.

        Parameters
        ----------
        message : object or mapping
            Message of ROS 1 or ROS 2, or a dictionary of its fields.
        rectified : bool, default False
            Return the camera of the rectified image, with K from P and no distortion.

        Raises
        ------
        InputError
            If the camera model is not supported, or the camera is not calibrated.

        Examples
        --------
        >>> k = [800, 0, 320, 0, 800, 240, 0, 0, 1]
        >>> info = {"width": 640, "height": 480, "k": k, "d": [], "distortion_model": "plumb_bob"}
        >>> Camera.from_ros(info).size
        (640, 480)
        """
        return camera_info.camera_from_message(message, rectified, cls)

    def resized(self, width: int, height: int, *, stretch: bool = False) -> Camera:
        """Return the camera of the image scaled to another size in pixels.

        A column u of the image becomes u' = (u + 0.5) width' / width - 0.5, as in `cv2.resize`,
        because pixel centres are whole numbers.

        Parameters
        ----------
        width, height : int
            Size of the scaled image in pixels.
        stretch : bool, default False
            Allow another aspect ratio.

        Raises
        ------
        InputError
            If `stretch` is false and the new aspect ratio changes a side by a pixel or more.

        Examples
        --------
        >>> Camera([[800, 0, 319.5], [0, 800, 239.5], [0, 0, 1]], (640, 480)).resized(320, 240).K[0]
        array([400. ,   0. , 159.5])
        """
        K, size = scale_intrinsics(self.K, self.size, (width, height), stretch)
        return replace(self, K=K, size=size)

    def cropped(self, left: int, top: int, width: int, height: int) -> Camera:
        """Return the camera of a rectangular region of the image.

        Parameters
        ----------
        left, top : int
            First column and row of the region.
        width, height : int
            Size of the region in pixels.

        Raises
        ------
        InputError
            If the region is not inside the image.

        Examples
        --------
        >>> Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], (640, 480)).cropped(
        ...     100, 50, 320, 240).K[:2, 2]
        array([220., 190.])
        """
        K, size = crop_intrinsics(self.K, self.size, left, top, (width, height))
        return replace(self, K=K, size=size)

    def project(self, points: ArrayLike, T_w_c: PoseLike) -> Array:
        """Return the pixels of points.

        Parameters
        ----------
        points : array_like of shape (N, 3) or (..., N, 3)
            Points in any frame, in metres.
        T_w_c : pose_like of shape (..., 4, 4)
            Pose of the camera in the frame of the points.

        Returns
        -------
        ndarray of shape (..., N, 2)
            Pixels (column, row), also outside the image; NaN for points behind the camera.

        Examples
        --------
        >>> Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]).project([[0.1, 0, 2]], Pose.at())
        array([[360., 240.]])
        """
        pixels, _, lead = self._project_and_classify(points, T_w_c)
        return move_runs_first(pixels, lead)

    def visibility(self, points: ArrayLike, T_w_c: PoseLike) -> NDArray[np.int8]:
        """Return the `Visibility` (..., N) of points: in the image, outside it, or behind.

        Parameters
        ----------
        points : array_like of shape (N, 3) or (..., N, 3)
            Points in any frame, in metres.
        T_w_c : pose_like of shape (..., 4, 4)
            Pose of the camera in the frame of the points.

        Returns
        -------
        ndarray of int8, shape (..., N)
            Members of `Visibility`.

        Examples
        --------
        >>> camera = Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], size=(640, 480))
        >>> camera.visibility([[0, 0, 1], [9, 0, 1], [0, 0, -1]], Pose.at()).tolist()
        [0, 1, 2]
        """
        _, status, lead = self._project_and_classify(points, T_w_c)
        return move_runs_first(status, lead)

    def normalise(self, pixels: ArrayLike) -> Array:
        """Return the undistorted, normalised coordinates of pixels: points at unit depth.

        Parameters
        ----------
        pixels : array_like of shape (..., N, 2)
            Pixels (column, row).

        Returns
        -------
        ndarray of shape (..., N, 2)
            Normalised coordinates (X/Z, Y/Z), NaN for a pixel that is not the image of any point.

        Examples
        --------
        >>> Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]).normalise([[400, 240]])
        array([[0.1, 0. ]])
        """
        first = as_floats(pixels, "pixels", ("N", 2))
        return move_runs_first(self.points_of(move_runs_last(first, 2)), first.shape[:-2])

    @property
    def model(self) -> LensModel:
        """The model of the lens."""
        return LENS_MODELS[self.lens]

    @cached_property
    def coefficients(self) -> Array:
        """The eight coefficients of the lens for the kernels; those that it lacks are zero."""
        given = np.array(self.distortion)
        return make_read_only(np.concatenate([given, np.zeros((8 - len(given), *given.shape[1:]))]))

    @cached_property
    def lens_kind(self) -> int:
        """The kind of lens for the kernels: NO_LENS without any distortion, BROWN or FISHEYE."""
        bends = self.lens == "fisheye" or self.coefficients.any()
        return self.model.kind if bends else kernels.NO_LENS

    @cached_property
    def rows(self) -> Array:
        """The rows (22, 1) or (22, runs) that describe the camera to the kernels.

        They are K, the lens, the image border and the valid radius, in the order of
        `robsim.kernels.images.projection`. In a batch with different cameras K is (3, 3, runs), or
        `distortion` is (n, runs).
        """
        groups = (self.K, 9), (self.coefficients, 8), (self.border, 4), (self.valid_radius, 1)
        parts = [np.reshape(values, (count, -1)) for values, count in groups]
        runs = max(part.shape[1] for part in parts)
        return np.concatenate([np.broadcast_to(part, (len(part), runs)) for part in parts])

    def of_runs(self, runs: NDArray[np.int64]) -> Camera:
        """Return the cameras of the runs with some indices, from the cameras of a batch."""
        if self.rows.shape[1] == 1:
            return self
        arrays = {"K": self.K, "distortion": np.array(self.distortion)}
        return replace_unchecked(
            self, **{k: v[..., runs] for k, v in arrays.items() if v.ndim != _SINGLE_NDIM[k]}
        )

    def of_run(self, run: int) -> Camera:
        """Return the camera of one run of a batch."""
        chosen = self.of_runs(np.array([run]))
        if not chosen.differs_by_run:
            return self
        arrays = {"K": np.asarray(chosen.K), "distortion": np.array(chosen.distortion)}
        one = {k: v[..., 0] if v.ndim != _SINGLE_NDIM[k] else v for k, v in arrays.items()}
        return replace(self, K=one["K"], distortion=tuple(one["distortion"].tolist()))

    def image_of(self, X: Array) -> tuple[Array, NDArray[np.int8]]:
        """Return pixels (N, 2, B) and visibility (N, B) of points X (N, 3, B) in camera axes."""
        result = self._apply_to_points(self._projection, X)
        return np.ascontiguousarray(result[:, :2]), result[:, 2].astype(np.int8)

    def points_of(self, pixels: Array) -> Array:
        """Return the undistorted points (N, 2, B) at unit depth of pixels (N, 2, B), or NaN."""
        return self._apply_to_points(self._undistortion, pixels)

    def _apply_to_points(self, function: ProgramFunction, x: Array) -> Array:
        """Return the values (N, m, B) of a function at N points x (N, n, B) of each run."""
        N, n, runs = x.shape
        runs = runs if self.rows.shape[1] == 1 else max(runs, self.rows.shape[1])
        wide = np.broadcast_to(x, (N, n, runs))
        columns = np.ascontiguousarray(wide.transpose(1, 0, 2)).reshape(n, N * runs)
        values = function(columns, np.tile(np.arange(runs), N))
        return np.ascontiguousarray(values.reshape(len(values), N, runs).transpose(1, 0, 2))

    @cached_property
    def _projection(self) -> ProgramFunction:
        """The function from a point in camera axes to its pixel and visibility."""
        program = Program()
        X, result, identity = program.rows(1, 3), program.rows(3), program.constant(np.eye(3, 4))
        program.add(
            projection.project_to_pixels,
            marks=X,
            T_w_c=identity,
            T_w_o=identity,
            camera=program.each(self.rows),
            lens=self.lens_kind,
            pixels=result[:2].reshape(1, 2),
            depth=program.rows(1),
            status=result[2:],
            mode=projection.EACH_STATUS,
        )
        return ProgramFunction(program, X, result, 3)

    @cached_property
    def _undistortion(self) -> ProgramFunction:
        """The function from a pixel to its undistorted point."""
        program = Program()
        pixel, point = program.rows(1, 2), program.rows(1, 2)
        program.add(
            projection.normalise_mark_pixels,
            camera=program.each(self.rows),
            pixels=pixel,
            points=point,
            lens=self.lens_kind,
        )
        return ProgramFunction(program, pixel, point, 2)

    @cached_property
    def border(self) -> Array:
        """The limits ((left, right), (top, bottom)) of the image; right and bottom are excluded."""
        low, high = (-np.inf, np.inf) if self.size is None else (-0.5, np.array(self.size) - 0.5)
        return make_read_only(np.stack([np.full(2, low), np.broadcast_to(high, 2)], axis=1))

    @property
    def differs_by_run(self) -> bool:
        """Whether K or the distortion has a value for each run."""
        return self.K.ndim > 2 or np.ndim(self.distortion) > 1

    @cached_property
    def normalised_width(self) -> float:
        """The largest distance of two normalised points along an axis of the image.

        Infinity if unknown: without a size, or if the camera differs from run to run.

        >>> Camera(np.diag([512, 512, 1]), (640, 480)).normalised_width
        1.25
        """
        if self.size is None or self.differs_by_run:
            return np.inf
        corners = np.array(np.meshgrid(*self.border)).reshape(2, -1).T
        sides = np.ptp(self.normalise(corners), axis=0)
        return float(sides.max()) if np.isfinite(sides).all() else np.inf

    @cached_property
    def valid_radius(self) -> float | Array:
        """The largest normalised radius r at which the distortion is monotonic.

        Beyond this radius different points have the same pixel. See `find_brown_radius` and
        `find_fisheye_radius` of `robsim.vision.lens_models`.
        """
        find, lens = self.model.find_radius, self.coefficients
        return np.array(list(map(find, lens.T))) if lens.ndim > 1 else find(lens)

    def drawn(self, T_w_c: PoseLike) -> CameraBody | None:
        """Return the camera body at a pose of the camera, or None without a body.

        The axes of the body are those of the chapter: x up, y to the right.
        """
        return self.body and self.body.at(as_pose(T_w_c) @ T_CHAPTER_CAMERA.inv())

    def _project_and_classify(
        self, points: ArrayLike, T_w_c: PoseLike
    ) -> tuple[Array, NDArray[np.int8], tuple[int, ...]]:
        """Return pixels (N, 2, B) and visibility (N, B) of points, and the leading shape of B."""
        p, T = as_floats(points, "points", ("N", 3)), as_pose(T_w_c).matrix
        lead = broadcast_leading_shape(p.shape[:-2], T.shape[:-2], "points and camera poses")
        X = move_runs_last(np.broadcast_to(Pose(T).inv() @ p, (*lead, p.shape[-2], 3)), 2)
        return *self.image_of(X), lead
