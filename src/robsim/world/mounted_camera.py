"""A camera mounted on a frame of a scene."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from robsim.base.errors import InputError, format_value
from robsim.base.name_check import check_name
from robsim.base.parameter_names import name_parameters
from robsim.declare import Name, PerRun, Role, Table
from robsim.declare.context import Context, NoTextError
from robsim.declare.texts import FrameReference
from robsim.geometry.pose import IDENTITY, Pose, PoseLike, check_single_pose
from robsim.geometry.pose_table import FLAT_POSE
from robsim.geometry.primitives import CameraBody
from robsim.vision.camera import Camera
from robsim.vision.camera_files.calibration_files import load_rig
from robsim.vision.image_size import SIZE
from robsim.vision.intrinsics import CENTER, FOCAL, MATRIX, PIXELS
from robsim.vision.optics import Optics
from robsim.world.calibrated_camera import (
    CALIBRATION,
    COEFFICIENTS,
    LENS,
    build_camera,
    describe_lens,
)


@dataclass(frozen=True)
class CameraTable:
    """The text form of a mounted camera."""

    stands: ClassVar[Mapping[str, str]] = {
        "pose": "pose",
        "optics": "optics",
        **{key: f"camera.{key}" for key in ("size", "distortion", "lens", "body")},
        **{key: f"camera.{key}" for key in ("K", "focal", "center", "skew")},
    }
    rivals: ClassVar[Any] = (
        (("K",), ("focal", "center", "skew"), ("calibration",)),
        (("distortion", "lens"), ("calibration",)),
    )

    name: Annotated[str, Name(), "Name of the camera."]
    on: Annotated[str, FrameReference, "Frame that carries the camera."] = "world"
    pose: Annotated[Pose, FLAT_POSE, PerRun(), "Pose of the camera in that frame."] = IDENTITY
    size: Annotated[
        Any, SIZE, "[width, height] of the image in pixels. None: an image without border."
    ] = None
    K: Annotated[
        Any,
        MATRIX,
        PerRun((3, 3)),
        "Matrix of intrinsics [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] in pixels.",
    ] = None
    focal: Annotated[Any, FOCAL, PerRun((), (2,)), "Focal lengths, instead of K."] = None
    center: Annotated[
        Any, CENTER, PerRun((2,)), "Principal point, instead of K. None: the middle of the image."
    ] = None
    skew: Annotated[float | None, PIXELS, PerRun(()), "Skew of the image axes, instead of K."] = (
        None
    )
    distortion: Annotated[
        tuple[float, ...],
        COEFFICIENTS,
        PerRun(("n",)),
        "Distortion coefficients k1 k2 p1 p2 [k3 [k4 k5 k6]] as in OpenCV. The six coefficients "
        "after these must be zero. A fisheye has k1 k2 k3 k4.",
    ] = ()
    lens: Annotated[
        str | None, LENS, 'Model of the lens. "fisheye" is "equidistant" in ROS and Kalibr.'
    ] = "perspective"
    body: Annotated[
        Any, Table(CameraBody), Role.FIGURE, "Housing of the camera, shown in figures."
    ] = None
    optics: Annotated[
        Optics | None, Table(Optics), Role.FIGURE, "Errors of the pictures of the camera."
    ] = None
    calibration: Annotated[
        Any, CALIBRATION, "Calibration file of the camera, instead of K and distortion."
    ] = None

    def build_value(self, c: Context) -> MountedCamera:
        """Return the mounted camera that the table describes."""
        return MountedCamera(self.name, build_camera(self, c), self.on, self.pose, self.optics)

    @classmethod
    def of(cls, value: MountedCamera, c: Context) -> CameraTable:
        """Return the table that describes a mounted camera."""
        lens = value.camera
        if type(lens) is not Camera:
            raise NoTextError(f"{type(lens).__name__} is Python code")
        own: dict[str, Any] = {"body": lens.body, "optics": value.optics}
        return cls(value.name, value.on, value.pose, **own, **describe_lens(lens, c))


@name_parameters
@dataclass(frozen=True)
class MountedCamera:
    """A camera mounted on a frame of a scene.

    Parameters
    ----------
    name : str
        Name of the camera, which is also the name of its frame.
    camera : Camera
        Projection and distortion of the camera.
    on : str, default "world"
        Frame that carries the camera: "world", an object, or a link such as "arm.tool".
    pose : pose_like, default the identity
        Pose of the camera axes in the frame `on`. For a camera on a robot, this is the hand-eye
        pose.
    optics : Optics, optional
        Errors of the pictures of the camera. The belief of a controller has the same optics or
        none, because a controller does not use them.

    Raises
    ------
    InputError
        If the name is not valid, or an argument has another type.

    Examples
    --------
    >>> MountedCamera("eye", Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]), on="arm.tool").on
    'arm.tool'
    """

    name: str
    camera: Camera
    on: str = "world"
    pose: Pose = IDENTITY
    optics: Optics | None = None
    text_form: ClassVar[type[Any]] = CameraTable

    if TYPE_CHECKING:  # the types of the arguments are wider than the types of the attributes

        def __init__(
            self,
            name: str,
            camera: Camera,
            on: str = "world",
            pose: PoseLike = IDENTITY,
            optics: Optics | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        check_name(self.name, "camera")
        if not isinstance(self.camera, Camera):
            raise InputError(
                f"camera '{self.name}' needs a Camera, got {format_value(self.camera)}"
            )
        if not isinstance(self.optics, Optics | None):
            given = format_value(self.optics)
            raise InputError(f"optics of '{self.name}': expected Optics, got {given}")
        object.__setattr__(self, "pose", check_single_pose(self.pose, f"pose of '{self.name}'"))

    @property
    def samples(self) -> int:
        """The divisions along each side of a pixel of its pictures, 1 without optics."""
        return 1 if self.optics is None else self.optics.samples

    @classmethod
    def rig_from_file(
        cls, path: str | os.PathLike[str], on: str = "world", pose: PoseLike = IDENTITY
    ) -> tuple[MountedCamera, ...]:
        """Return the cameras of Kalibr's camchain.yaml, mounted on one frame.

        The cameras have the names in the file. The first camera, cam0, has the pose `pose` in the
        frame `on`; the poses of the other cameras follow from the chain of the file. This method
        needs the extra `vision`.

        Parameters
        ----------
        path : path_like
            File of Kalibr.
        on : str, default "world"
            Frame that carries all cameras.
        pose : pose_like, default the identity
            Pose of cam0 in that frame.

        Returns
        -------
        tuple of MountedCamera
            The cameras, in the order of the file.

        Raises
        ------
        FileError
            If the file has no poses of cameras, or a lens model that is not supported.
        """
        first = check_single_pose(pose, "pose of cam0")
        return tuple(
            cls(name, camera.read_from(origin), on, first @ T_first_camera)
            for name, (camera, origin, T_first_camera) in load_rig(path, Camera).items()
        )


def get_picture_size(eye: MountedCamera) -> tuple[int, int]:
    """Return the width and height of the pictures of a camera; InputError without a size."""
    if eye.camera.size is None:
        raise InputError(f"camera '{eye.name}' has no size, which a picture needs")
    return eye.camera.size
