"""A camera mounted on a frame of a scene."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.errors import InputError, said
from robsim.base.names import checked_name
from robsim.declare import ListOf, Name, Number, Role, Stacked, Table
from robsim.declare.fields import same
from robsim.declare.problems import under
from robsim.declare.spec import Context, NoText
from robsim.declare.words import Reference
from robsim.geometry.pose import IDENTITY, Pose, one_pose
from robsim.geometry.pose_table import FLAT_POSE
from robsim.geometry.primitives import CameraBody
from robsim.vision.camera import Camera
from robsim.vision.camera_files.files import rig_of
from robsim.vision.image_size import SIZE
from robsim.vision.intrinsics import CENTER, MATRIX, PIXELS, Focal, matrix_of, middle, parts_of


@dataclass(frozen=True)
class CameraTable:
    """The text form of a mounted camera."""

    stands: ClassVar[Mapping[str, str]] = {
        "pose": "pose",
        **{key: f"camera.{key}" for key in ("size", "distortion", "body")},
        **{key: f"camera.{key}" for key in ("K", "focal", "center", "skew")},
    }
    rivals: ClassVar[Any] = ((("K",), ("focal", "center", "skew")),)

    name: Annotated[str, Name(), "Name of the camera."]
    on: Annotated[str, Reference, "Frame that carries the camera."] = "world"
    pose: Annotated[Pose, FLAT_POSE, Stacked(), "Pose of the camera in that frame."] = IDENTITY
    size: Annotated[
        Any, SIZE, "[width, height] of the image in pixels; None: an image without border."
    ] = None
    K: Annotated[
        Any,
        MATRIX,
        Stacked((3, 3)),
        "The matrix [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] in pixels.",
    ] = None
    focal: Annotated[Any, Focal(), Stacked((), (2,)), "The focal lengths, instead of K."] = None
    center: Annotated[
        Any, CENTER, Stacked((2,)), "The principal point; without it the middle of the image."
    ] = None
    skew: Annotated[float | None, PIXELS, Stacked(()), "The skew of the axes of the image."] = None
    distortion: Annotated[
        tuple[float, ...],
        ListOf(Number(), most=14),
        Stacked(("n",)),
        "Coefficients k1 k2 p1 p2 [k3 [k4 k5 k6]] as in OpenCV; the six after these must be zero.",
    ] = ()
    body: Annotated[
        Any, Table(CameraBody), Role.FIGURE, "Housing that figures show of the camera."
    ] = None

    def made(self, c: Context) -> MountedCamera:
        """Return the mounted camera that the table describes."""
        K = self.K
        if K is None:
            K = matrix_of(self.focal, self.center, self.skew, self.size)
        with under("K"):
            lens = Camera(np.array(K), self.size, body=self.body)
        with under("distortion"):
            lens = replace(lens, distortion=self.distortion)
        return MountedCamera(self.name, lens, self.on, self.pose)

    @classmethod
    def of(cls, value: MountedCamera, c: Context) -> CameraTable:
        """Return the table that describes a mounted camera."""
        lens = value.camera
        if type(lens) is not Camera:
            raise NoText(f"{type(lens).__name__} is Python code")
        own = {key: getattr(lens, key) for key in ("size", "distortion", "body")}
        return cls(value.name, value.on, value.pose, **own, **_intrinsics(lens, c))


def _intrinsics(lens: Camera, c: Context) -> dict[str, Any]:
    """Return K, or in a short text its parts, where these give the same matrix."""
    parts = parts_of(lens.K)
    if c.facts.get("by_hand"):
        return parts
    in_pixels = min(parts["focal"]) >= 1.0  # else the lens is of normalised coordinates
    if not (c.facts.get("short") and in_pixels) or not same(
        lens.K, np.array(matrix_of(**parts, size=None))
    ):
        return {"K": lens.K.tolist()}
    if c.facts.get("changes"):
        return parts
    usual = {"center": middle(lens.size), "skew": 0.0}
    return {key: None if same(x, usual.get(key)) else x for key, x in parts.items()}


@dataclass(frozen=True)
class MountedCamera:
    """A camera in a scene, at `pose` (the hand-eye pose) on the frame `on`.

    >>> MountedCamera("eye", Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]]), on="arm.tool").on
    'arm.tool'
    """

    name: str
    camera: Camera
    on: str = "world"
    pose: Pose = IDENTITY
    text_form: ClassVar[type[Any]] = CameraTable

    def __post_init__(self) -> None:
        checked_name(self.name, "camera")
        if not isinstance(self.camera, Camera):
            raise InputError(f"camera '{self.name}' needs a Camera, got {said(self.camera)}")
        object.__setattr__(self, "pose", one_pose(self.pose, f"pose of '{self.name}'"))

    @classmethod
    def rig_from_file(
        cls, path: str | os.PathLike[str], on: str = "world", pose: Any = IDENTITY
    ) -> tuple[MountedCamera, ...]:
        """Return the cameras of Kalibr's camchain.yaml, on one frame and with their names.

        The first, cam0, stands at `pose` on `on`, the others where the chain says. FileError: a
        file without such poses, or a lens that is not modelled. It needs the extra `vision`.
        """
        first = one_pose(pose, "pose of cam0")
        return tuple(
            cls(name, camera, on, first @ T_first_camera)
            for name, (camera, T_first_camera) in rig_of(path, Camera).items()
        )
