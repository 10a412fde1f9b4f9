"""Rendered pictures of the cameras of a recording, as PNG files in data URLs."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.geometry.grey_picture import GreyPicture
from robsim.geometry.pose import Pose
from robsim.page.recording_frames import Entry
from robsim.plot import run_data
from robsim.plot.goal_outlines import read_goal_pose
from robsim.plot.run_pictures import (
    make_camera_pictures,
    make_noise_key,
    place_goal,
    take_picture,
    take_recorded_picture,
)
from robsim.vision.optics import Optics
from robsim.world.mounted_camera import MountedCamera
from robsim.world.scene import Scene
from robsim.world.scene_picture import CameraPictures, NoiseKey

if TYPE_CHECKING:
    import xarray as xr

WIDEST = 320  # largest side of a picture, pixels
MOST_BYTES = 340_000  # of all pictures of a recording as PNG; base64 takes a third more
# largest side and number of pictures of a camera, the first that MOST_BYTES permits
CHOICES = ((320, 48), (320, 24), (240, 24), (160, 24), (160, 12), (120, 12))
SAMPLES = 3  # pictures from which the size of all is estimated


def add_pictures(cameras: list[Entry], run: xr.Dataset, scene: Scene) -> list[Entry]:
    """Return the cameras of a single run with their pictures, as entries of a header.

    A camera has no pictures if it observes no feature points, has no size, or sees no body.
    """
    seen = [each["name"] for each in cameras if "pixels" in each]
    room = MOST_BYTES // max(len(seen), 1)
    return [
        {**each, **_build_pictures_entry(run, scene, each["name"], room)}
        if each["name"] in seen
        else each
        for each in cameras
    ]


def has_pictures(scene: Scene, camera: str) -> bool:
    """Return whether a camera of a scene has a size and another body to see."""
    eye = scene.camera(camera)
    return eye.camera.size is not None and bool(make_camera_pictures(scene, eye).frames)


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

    >>> encode_picture(np.zeros((2, 3), dtype=np.uint8))[:32]
    'data:image/png;base64,iVBORw0KGgo'
    """
    return f"data:image/png;base64,{base64.b64encode(GreyPicture(grey).png).decode()}"


def draw_goal_picture(
    scene: Scene, goal: Mapping[str, Pose], q: Array, eye: MountedCamera, key: NoiseKey
) -> NDArray[np.uint8] | None:
    """Return the picture (h, w) of a camera at the goal; None if its pose there is unknown."""
    with suppress(InputError):
        placed = place_goal(goal, scene, q, eye.name)
        there = placed.camera(eye.name)
        pictures = make_camera_pictures(placed, replace(eye, on=there.on, pose=there.pose))
        return take_picture(pictures, q, np.zeros_like(q), key)
    return None


def _build_pictures_entry(run: xr.Dataset, scene: Scene, camera: str, room: int) -> Entry:
    """Return the pictures of a camera of at most `room` bytes; empty if it sees no body."""
    if not has_pictures(scene, camera):
        return {}
    count, eye = run.sizes["time"], scene.camera(camera)
    samples = np.linspace(0, count - 1, SAMPLES).round().astype(int)
    for most, number in CHOICES:
        reduced = reduce_camera(eye, most)
        pictures = make_camera_pictures(scene, reduced)
        instants = _choose_instants(run, camera, number)
        sizes = [len(GreyPicture(take_recorded_picture(pictures, run, t)).png) for t in samples]
        if np.mean(sizes) * (len(instants) + 1) <= room:
            break
    images = [take_recorded_picture(pictures, run, t) for t in instants]
    if not _shows_body(pictures, run, instants):
        return {}
    q = run_data.read_configurations(run, scene)[-1]
    key = make_noise_key(run, count)
    goal = draw_goal_picture(scene, read_goal_pose(run), q, reduced, key)
    entry = {
        "size": list(reduced.camera.size or ()),
        "instants": instants,
        "images": [encode_picture(each) for each in images],
        "goal": None if goal is None else encode_picture(goal),
        "prints": has_prints(scene),
    }
    return {"pictures": entry}


def _choose_instants(run: xr.Dataset, camera: str, number: int) -> list[int]:
    """Return instants that divide the mean of time and of motion in the image into equal parts."""
    count = run.sizes["time"]
    own = run["mark_camera"].values == camera
    steps = np.abs(np.diff(run["pixels"].values[:, own], axis=0)).reshape(count - 1, -1)
    moved = np.cumsum(np.nan_to_num(steps).sum(axis=1), dtype=float)
    progress = np.linspace(0, 1, count)
    if count > 1 and moved[-1] > 0:
        progress[1:] = (progress[1:] + moved / moved[-1]) / 2
    places = np.searchsorted(progress, np.linspace(0, 1, number) - 1e-12)
    return [int(place) for place in np.unique(np.minimum(places, count - 1))]


def _shows_body(pictures: CameraPictures, run: xr.Dataset, instants: Iterable[int]) -> bool:
    """Return whether a body is in one of the pictures."""
    q = run["q"].values
    with pictures.lock:
        lights = (pictures.draw(np.ascontiguousarray(q[t][:, None])) for t in instants)
        return any(float(np.ptp(each)) > 0 for each in lights)
