"""Rendered pictures of the cameras of a recording, as PNG files in data URLs."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robsim.base.errors import InputError
from robsim.geometry.grey_picture import GreyPicture
from robsim.geometry.pose import Pose
from robsim.page.recording_frames import Entry
from robsim.plot.goal_outlines import read_goal_pose
from robsim.plot.run_pictures import CameraInstants, place_goal
from robsim.vision.optics import Optics
from robsim.world.mounted_camera import MountedCamera
from robsim.world.scene import Scene
from robsim.world.scene_picture import CameraPictures

if TYPE_CHECKING:
    import xarray as xr

    from robsim.plot.run_data import RunVariables

WIDEST = 320  # largest side of a picture, pixels
MOST_BYTES = 340_000  # of all pictures of a recording as PNG; base64 takes a third more
# largest side and number of pictures of a camera, the first that MOST_BYTES permits
CHOICES = ((320, 48), (320, 24), (240, 24), (160, 24), (160, 12), (120, 12))
SAMPLES = 3  # pictures from which the size of all is estimated


@dataclass(frozen=True, eq=False)
class PictureSource:
    """The instants of a run at which cameras take the pictures of a recording.

    Attributes
    ----------
    scene : Scene
        The true scene.
    instants : CameraInstants
        Coordinates at all T instants.
    run : mapping of str to xarray.Variable
        The run, with the pixels of feature points at these instants.
    goal : mapping of str to Pose
        Goal pose of a camera or a target by its name; empty if it is unknown.
    first : int
        First instant at which the scene was as it is.
    """

    scene: Scene
    instants: CameraInstants
    run: RunVariables
    goal: Mapping[str, Pose]
    first: int = 0

    @classmethod
    def of(cls, run: xr.Dataset, scene: Scene) -> PictureSource:
        """Return the source of a single run."""
        return cls(scene, CameraInstants.of(run), run, read_goal_pose(run))

    def choose_instants(self, camera: str, number: int) -> list[int]:
        """Return instants that divide the mean of time and image motion into equal parts."""
        own = self.run["mark_camera"].values == camera
        pixels = self.run["pixels"].values[self.first :, own]
        count = len(pixels)
        steps = np.nan_to_num(np.abs(np.diff(pixels, axis=0))).sum(axis=(1, 2))
        moved = np.cumsum(steps, dtype=float)
        progress = np.linspace(0, 1, count)
        if count > 1 and moved[-1] > 0:
            progress[1:] = (progress[1:] + moved / moved[-1]) / 2
        places = np.searchsorted(progress, np.linspace(0, 1, number) - 1e-12)
        return [self.first + int(place) for place in np.unique(np.minimum(places, count - 1))]


def add_pictures(cameras: list[Entry], source: PictureSource) -> list[Entry]:
    """Return the cameras of a run with their pictures, as entries of a header.

    A camera has no pictures if it observes no feature points, has no size, or sees no body.
    """
    seen = [each["name"] for each in cameras if "pixels" in each]
    room = MOST_BYTES // max(len(seen), 1)
    plain = [{key: each[key] for key in each if key != "pictures"} for each in cameras]
    return [
        {**each, **_build_pictures_entry(source, each["name"], room)}
        if each["name"] in seen
        else each
        for each in plain
    ]


def has_pictures(scene: Scene, camera: str) -> bool:
    """Return whether a camera of a scene has a size, and the scene has another body."""
    if scene.camera(camera).camera.size is None:
        return False
    links = [link for robot in scene.robots for link in robot.links]
    others = [each.camera for each in scene.cameras if each.name != camera]
    return (
        any(link.shapes for link in links)
        or any(each.shapes or each.target is not None for each in scene.objects)
        or any(each.drawn(Pose.at()) is not None for each in others)
    )


def has_prints(scene: Scene) -> bool:
    """Return whether a scene has a picture, a tag, a board or a pattern of dots."""
    shapes = [shape for robot in scene.robots for link in robot.links for shape in link.shapes]
    shapes += [shape for each in scene.objects for shape in each.shapes]
    is_target = any(each.target is not None for each in scene.objects)
    return is_target or any(each.face_pictures for each in shapes)


def reduce_camera(eye: MountedCamera, most: int = WIDEST) -> MountedCamera:
    """Return a camera whose picture has sides of at most `most` pixels.

    Its noise is the noise of a mean over pixels of the whole picture.
    """
    assert eye.camera.size is not None
    width, height = eye.camera.size
    share = most / max(width, height)
    if share >= 1:
        return eye
    camera = eye.camera.resized(*(max(round(share * side), 1) for side in (width, height)))
    return replace(eye, camera=camera, optics=eye.optics and _reduce_optics(eye.optics, share))


def _reduce_optics(optics: Optics, share: float) -> Optics:
    """Return the optics of a picture whose sides are reduced to a share."""
    well = None if optics.full_well is None else optics.full_well / share**2
    return replace(
        optics, defocus=share * optics.defocus, read_noise=share * optics.read_noise, full_well=well
    )


def encode_picture(grey: NDArray[np.uint8]) -> str:
    """Return a picture (h, w) as a data URL.

    >>> encode_picture(np.zeros((2, 3), dtype=np.uint8))[:33]
    'data:image/png;base64,iVBORw0KGgo'
    """
    return f"data:image/png;base64,{base64.b64encode(GreyPicture(grey).png).decode()}"


def draw_goal_picture(source: PictureSource, pictures: CameraPictures) -> NDArray[np.uint8] | None:
    """Return the picture (h, w) of a camera at the goal, with other bodies as at the last instant.

    None if the pose of the camera at the goal is unknown.
    """
    eye, last = pictures.eye, len(source.instants.q) - 1
    with suppress(InputError):
        q_last = source.instants.q[last]
        placed, q = place_goal(source.goal, source.scene, q_last, eye.name)
        if placed is not source.scene:
            there = placed.camera(eye.name)
            pictures = CameraPictures(placed, replace(eye, on=there.on, pose=there.pose))
        return source.instants.take_still(pictures, last, q)
    return None


def _build_pictures_entry(source: PictureSource, camera: str, room: int) -> Entry:
    """Return the pictures of a camera of at most `room` bytes; empty if it sees no body."""
    if not has_pictures(source.scene, camera):
        return {}
    eye, instants = _choose_camera(source, camera, room)
    pictures = CameraPictures(source.scene, eye)
    if not _shows_body(pictures, source, instants):
        return {}
    goal = draw_goal_picture(source, pictures)
    entry = {
        "size": list(eye.camera.size or ()),
        "instants": instants,
        "images": [encode_picture(source.instants.take(pictures, t)) for t in instants],
        "goal": None if goal is None else encode_picture(goal),
        "prints": has_prints(source.scene),
    }
    return {"pictures": entry}


def _choose_camera(
    source: PictureSource, camera: str, room: int
) -> tuple[MountedCamera, list[int]]:
    """Return a camera of a smaller image, and the instants of its pictures, for `room` bytes."""
    samples, means = source.choose_instants(camera, SAMPLES), dict[int, float]()
    for most, number in CHOICES:
        eye = reduce_camera(source.scene.camera(camera), most)
        if most not in means:
            pictures = CameraPictures(source.scene, eye)
            greys = [source.instants.take(pictures, t) for t in samples]
            means[most] = float(np.mean([len(GreyPicture(grey).png) for grey in greys]))
        instants = source.choose_instants(camera, number)
        if means[most] * (len(instants) + 1) <= room:
            break
    return eye, instants


def _shows_body(pictures: CameraPictures, source: PictureSource, instants: Iterable[int]) -> bool:
    """Return whether a body is in one of the pictures."""
    q = source.instants.q
    with pictures.lock:
        lights = (pictures.draw(np.ascontiguousarray(q[t][:, None])) for t in instants)
        return any(float(np.ptp(each)) > 0 for each in lights)
