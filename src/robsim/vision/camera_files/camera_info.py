"""The camera of a ROS message `sensor_msgs/CameraInfo`, of ROS 1 or 2."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, Self, TypeVar

from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_bool, as_floats, as_integer
from robsim.base.errors import InputError, format_value, prefix_errors
from robsim.vision.camera_files.camera_tables import MakeCamera, read_table_cameras

FIELDS = "width", "height", "distortion_model"
MATRICES = "k", "d", "p"  # upper case in ROS 1


class ResizableCamera(Protocol):
    """The members of a camera that binning and a region of interest need."""

    @property
    def size(self) -> tuple[int, int] | None:
        """The width and height of the image in pixels."""

    def cropped(self, left: int, top: int, width: int, height: int) -> Self:
        """Return the camera of a region of the image."""

    def resized(self, width: int, height: int, *, stretch: bool = False) -> Self:
        """Return the camera of the image scaled to another size."""


CameraOfMessage = TypeVar("CameraOfMessage", bound=ResizableCamera)


def camera_from_message(
    message: object, rectified: bool, make: MakeCamera[CameraOfMessage]
) -> CameraOfMessage:
    """Return the camera of the image that a message describes; see `Camera.from_ros`."""
    with prefix_errors("camera_info"):
        table = _message_fields(message)
        if not as_floats(table["k"], "k", ()).any():
            raise InputError("k is zero: this camera is not calibrated")
        if as_bool(rectified, "rectified"):
            table.update(k=_rectified_intrinsics(table.pop("p", None)), d=[], distortion_model="")
        fields = {key: value for key, value in table.items() if key != "p"}
        return _apply_binning(
            _crop_to_region(read_table_cameras(fields, make)["camera"], message), message
        )


def _rectified_intrinsics(p: ArrayLike | None) -> Array:
    """Return the first three columns of a projection matrix P of 3 x 4 numbers."""
    matrix = None if p is None else as_floats(p, "p", ())
    if matrix is None or matrix.size != 12:
        raise InputError("rectified: expected P of 3 x 4 numbers")
    return matrix.reshape(3, 4)[:, :3]


def _message_fields(message: object) -> dict[str, Any]:
    """Return the fields of a message by their names in ROS 2."""
    values = {name: _find_field(message, name) for name in FIELDS}
    values |= {name: _find_field(message, name, name.upper()) for name in MATRICES}
    if isinstance(message, Mapping) and values["k"] is None:
        raise InputError(f"k is missing; keys: {format_value(', '.join(map(str, message)))}")
    if values["k"] is None:
        raise InputError(
            f"expected a CameraInfo message or a dict of its fields, got {format_value(message)}"
        )
    return {name: value for name, value in values.items() if value is not None}


def _find_field(message: object, *names: str) -> Any:
    """Return the field of a message or dictionary with the first name that it has, or None."""
    if isinstance(message, Mapping):
        return next((message[name] for name in names if name in message), None)
    return next((getattr(message, name) for name in names if hasattr(message, name)), None)


def _crop_to_region(camera: CameraOfMessage, message: object) -> CameraOfMessage:
    """Return the camera of the region of interest; a region of zeros is the whole image."""
    region = _find_field(message, "roi")
    fields = ("x_offset", "y_offset", "width", "height")
    left, top, width, height = (
        as_integer(_find_field(region, f) or 0, f"roi.{f}", 0) for f in fields
    )
    if not (left or top or width or height):
        return camera
    size = camera.size or (0, 0)
    return camera.cropped(left, top, width or size[0] - left, height or size[1] - top)


def _apply_binning(camera: CameraOfMessage, message: object) -> CameraOfMessage:
    """Return the camera of the image after binning; a binning of 0 means 1."""
    across, down = (
        as_integer(_find_field(message, f"binning_{axis}") or 1, "binning", 1) for axis in "xy"
    )
    if across == down == 1 or camera.size is None:
        return camera
    width, height = camera.size[0] // across, camera.size[1] // down
    whole_bins = camera.cropped(0, 0, width * across, height * down)
    return whole_bins.resized(width, height, stretch=True)
