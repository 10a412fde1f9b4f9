"""The views of a target for the calibration of a camera."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from robsim.base.arrays import Array, as_floats, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.base.value import Value
from robsim.calibration.joint_chain import JointChain
from robsim.calibration.relative_motions import FEWEST
from robsim.vision.camera import Camera
from robsim.vision.pixel_measurement import check_measured_pixels
from robsim.world.mounted_camera import MountedCamera
from robsim.world.object import Object
from robsim.world.scene import Scene

FEWEST_MARKS = 4  # in a view, for a pose
MARGIN = 3.0  # pixels: largest distance of a mark outside the image, for errors of detectors
SLACK = 0.1  # rad or m: largest distance of a joint outside its limits, for encoder offsets


@dataclass(frozen=True, eq=False, repr=False)
class CalibrationViews(Value):
    """Views of a target with the robot at rest: coordinates of the joints, and pixels.

    The camera is on the robot and the target in the world (eye-in-hand), or the camera is in the
    world and the target on the robot (eye-to-hand).

    Parameters
    ----------
    scene : Scene
        Scene with the robot, the camera with a first estimate of its lens, and the marks of the
        target. The poses of the camera and the target on their frames are not used.
    q : array_like of shape (V, nq)
        Coordinates of the scene, one row for each view.
    pixels : array_like of shape (V, N, 2)
        Pixels of the marks, NaN for marks that are not seen, as `Detections.pixels` returns them.
    camera : str, optional
        Name of the camera. Default: the only camera.
    target : str, optional
        Name of an object. Default: the only object with marks.

    Raises
    ------
    InputError
        If there are fewer than three views, fewer than four marks are seen in a view, a mark is
        more than 3 pixels outside the image, a joint is more than 0.1 (rad or m) outside its
        limits, a shape is wrong, or no joint moves the camera relative to the target.

    Examples
    --------
    >>> from robsim import examples, load_scenario
    >>> bench = load_scenario(examples.path("calibration_bench"))
    >>> turns = np.radians([[0, 0, 0, 0, 0, 0], [3, 3, 3, 3, 3, 0], [0, 3, -3, 3, -3, 30]])
    >>> q = bench.start + turns
    >>> CalibrationViews(bench.scene, q, bench.scene.view(q).pixels)
    <CalibrationViews 3 of 'board' by 'camera', 105 marks seen>
    """

    scene: Scene
    q: Array
    pixels: Array
    camera: str | None = None
    target: str | None = None

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            scene: Scene,
            q: ArrayLike,
            pixels: ArrayLike,
            camera: str | None = None,
            target: str | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        if not isinstance(self.scene, Scene):
            raise InputError(f"scene: expected a Scene, got {format_value(self.scene)}")
        eye, thing = self.scene.camera(self.camera), self.scene.object(self.target)
        q = as_floats(self.q, "q", (self.scene.nq,))
        pixels = check_measured_pixels(self.pixels, "pixels", eye.camera, len(thing.marks))
        _check_view_shapes(q, pixels)
        _check_visible_marks(np.isnan(pixels))
        check_pixel_range(pixels, eye.camera)
        check_joint_range(q, self.scene)
        values = {"camera": eye.name, "target": thing.name, "q": make_read_only(q)}
        for name, value in {**values, "pixels": make_read_only(pixels)}.items():
            object.__setattr__(self, name, value)
        if not self.chain.moves:
            raise InputError(
                f"camera '{eye.name}' is on {eye.on}, and target '{thing.name}' on {thing.on}: "
                "no joint moves the camera relative to the target"
            )

    def __len__(self) -> int:
        """Return the number of views."""
        return len(self.q)

    def __repr__(self) -> str:
        return (
            f"<CalibrationViews {len(self)} of '{self.target}' by '{self.camera}', "
            f"{int(self.seen.sum())} marks seen>"
        )

    @property
    def eye(self) -> MountedCamera:
        """The camera of the scene, with its mount."""
        return self.scene.camera(self.camera)

    @property
    def lens(self) -> Camera:
        """The camera of the scene, without its mount."""
        return self.eye.camera

    @property
    def thing(self) -> Object:
        """The target in the scene."""
        return self.scene.object(self.target)

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Whether the marks (V, N) are seen."""
        seen: NDArray[np.bool_] = np.isfinite(self.pixels[..., 0])
        return seen

    @property
    def chain(self) -> JointChain:
        """The joints between camera and target."""
        return JointChain(self.scene, self.eye.on, self.thing.on)

    def poses(self) -> Array:
        """Return the pose of each view, (V, 4, 4): of the target's frame in the camera's frame."""
        return self.chain.poses(self.q)


def _check_view_shapes(q: Array, pixels: Array) -> None:
    """Raise InputError unless there are enough views, with a row of coordinates for each."""
    if q.ndim != 2 or pixels.ndim != 3 or len(q) != len(pixels):
        raise InputError(
            "q and pixels: expected a row for each view, (V, nq) and (V, N, 2), got "
            f"{q.shape} and {pixels.shape}"
        )
    if len(q) < FEWEST:
        raise InputError(f"views: expected {FEWEST} or more, got {len(q)}")


def _check_visible_marks(missing: NDArray[np.bool_]) -> None:
    """Raise InputError for a mark with one coordinate, or a view with fewer than four marks."""
    half = np.argwhere(missing[..., 0] != missing[..., 1])
    if half.size:
        view, mark = half[0].tolist()
        raise InputError(
            f"pixels: mark {mark} of view {view} has one coordinate only; both coordinates of a "
            "mark that is not seen are NaN"
        )
    count = (~missing[..., 0]).sum(axis=1)
    few = np.flatnonzero(count < FEWEST_MARKS)
    if few.size:
        raise InputError(
            f"pixels: {count[few[0]]} marks seen in view {few[0]}; a view needs {FEWEST_MARKS} or "
            "more: leave it out"
        )


def is_off_image(pixels: Array, camera: Camera) -> NDArray[np.bool_]:
    """Return whether pixels (..., 2) are more than MARGIN outside the image.

    The result is false for NaN, and for a camera without a size.

    >>> camera = Camera(np.eye(3), size=(640, 480))
    >>> is_off_image(np.array([[640.0, 2], [642, -2], [2, 640]]), camera)
    array([False, False,  True])
    """
    if camera.size is None:
        return np.zeros(pixels.shape[:-1], dtype=bool)
    outside = (pixels < -MARGIN) | (pixels > np.add(camera.size, MARGIN))
    return np.asarray(outside.any(axis=-1))


def check_pixel_range(pixels: Array, camera: Camera) -> None:
    """Raise InputError if a mark of pixels (V, N, 2) is more than MARGIN outside the image."""
    outside = np.argwhere(is_off_image(pixels, camera))
    if outside.size:
        view, mark = outside[0].tolist()
        (u, v), (width, height) = pixels[view, mark], camera.size or (0, 0)
        raise InputError(
            f"pixels: mark {mark} of view {view} is at ({u:.6g}, {v:.6g}), outside the image of "
            f"{width} x {height}: is the order (column, row), and is this the size of the image?"
        )


def check_joint_range(q: Array, scene: Scene) -> None:
    """Raise InputError if a coordinate of q (V, nq) is more than SLACK outside its limits."""
    low, high = scene.limits.T
    outside = np.argwhere((q < low - SLACK) | (q > high + SLACK))
    if outside.size:
        view, i = outside[0].tolist()
        unit = scene.coordinate_units[i]
        others, factor = {"rad": ("degrees", np.pi / 180)}.get(unit, ("millimetres", 1e-3))
        guess = f": in {others}?" if low[i] <= factor * q[view, i] <= high[i] else ""
        raise InputError(
            f"q: joint '{scene.coordinate_names[i]}' in view {view} is {q[view, i]:.6g} {unit}, "
            f"outside its limits [{low[i]:.6g}, {high[i]:.6g}] {unit}{guess}"
        )
