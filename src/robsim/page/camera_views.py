"""Cameras of a recording: images, fields of view, and feature points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from robsim.base.arrays import Array
from robsim.page.camera_pictures import has_pictures, has_prints
from robsim.page.recording_frames import Entry, RecordingFrames
from robsim.plot import camera_frustum, palette, run_data, wireframe
from robsim.vision.camera import Camera
from robsim.vision.plane import append_one
from robsim.world.mounted_camera import MountedCamera

if TYPE_CHECKING:
    from robsim.plot.run_data import RunVariables

SIDE = 12  # points along each side of the image border, which distortion curves


def list_mark_entries(frames: RecordingFrames, first: dict[str, int]) -> list[Entry]:
    """Return the feature points of all objects, with the colours they have in the images."""
    targets = [obj for obj in frames.motion.scene.objects if len(obj.marks)]
    return [
        {
            "frame": frames.add_frame(each.name),
            "points": frames.shapes.store_points(each.marks),
            "colors": wireframe.list_object_mark_colors(each, first),
        }
        for each in targets
    ]


def list_camera_entries(
    frames: RecordingFrames,
    depth: float,
    run: RunVariables | None,
    margins: Sequence[tuple[str | None, float]] = (),
) -> list[Entry]:
    """Return the cameras of a scene: first the cameras of the run, with their images.

    `margins` are the camera and the margin in pixels of constraints of the field of view; the
    camera None is every camera of the run.
    """
    used = [] if run is None else run_data.list_run_cameras(run)
    order = sorted(frames.motion.scene.cameras, key=lambda eye: (eye.name not in used, eye.name))
    return [
        {
            "name": eye.name,
            "frame": frames.add_frame(eye.name),
            "frustum": frames.shapes.store_points(2 * depth * _compute_view_lines(eye.camera)),
            **_build_lens_entry(eye.camera),
            **(_build_live_pictures_entry(frames, eye) if frames.live else {}),
            **(
                _build_pixels_entry(frames, run, eye) | _build_margins_entry(eye, margins)
                if run is not None and eye.name in used
                else {}
            ),
        }
        for eye in order
    ]


def _build_lens_entry(camera: Camera) -> Entry:
    """Return the image size and the image centre of a camera."""
    centre = np.atleast_3d(camera.K)[:2, 2, 0].tolist()
    return {"size": None if camera.size is None else list(camera.size), "centre": centre}


def _build_live_pictures_entry(frames: RecordingFrames, eye: MountedCamera) -> Entry:
    """Return that a studio draws pictures of a camera on request; empty without other bodies."""
    scene = frames.motion.scene
    return {"pictures": {"prints": has_prints(scene)}} if has_pictures(scene, eye.name) else {}


def _compute_view_lines(camera: Camera) -> Array:
    """Return the ends (n, 3) of lines at unit depth, around the image and to its corners."""
    rays = (
        camera_frustum.compute_corner_rays(camera)
        if camera.size is None
        else _compute_border_rays(camera)
    )
    around = np.stack([rays, np.roll(rays, -1, axis=0)], axis=1)
    corners = rays[:: len(rays) // 4]
    spokes = np.stack([np.zeros_like(corners), corners], axis=1)
    lines = np.concatenate([around, spokes])
    return np.asarray(lines[np.isfinite(lines).all(axis=(1, 2))].reshape(-1, 3))


def _compute_border_rays(camera: Camera) -> Array:
    """Return points (4 SIDE, 3) at unit depth on the rays through the border of the image."""
    corners = camera_frustum.list_border_corners(camera)
    share = np.arange(SIDE)[:, None] / SIDE
    sides = [a + share * (b - a) for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)]
    return append_one(camera_frustum.compute_drawn_points(camera, np.concatenate(sides)))


def collect_mark_pixels(run: RunVariables, suffix: str = "") -> dict[str, Array]:
    """Return the pixels (T, N, 2) of the feature points in each image, by the name of the array.

    If `suffix` is empty, the goals (N, 2) are included.
    """
    arrays = {}
    for eye in run_data.list_run_cameras(run):
        own = run["mark_camera"].values == eye
        arrays[f"{eye}.pixels{suffix}"] = run["pixels"].values[:, own]
        if not suffix:
            arrays[f"{eye}.goal"] = run["pixels_goal"].values[own]
    return arrays


def _build_margins_entry(eye: MountedCamera, margins: Sequence[tuple[str | None, float]]) -> Entry:
    """Return the margins in pixels that constraints keep in an image; empty without any."""
    own = sorted({margin for name, margin in margins if name in (None, eye.name)})
    return {"margins": own} if own and eye.camera.size else {}


def _build_pixels_entry(frames: RecordingFrames, run: RunVariables, eye: MountedCamera) -> Entry:
    """Return the names of the arrays of an image, and colours and targets of its feature points."""
    targets = run_data.number_camera_marks(run, eye.name)
    second = {"second": f"{eye.name}.pixels second"} if frames.motion.second else {}
    return {
        "pixels": f"{eye.name}.pixels",
        **second,
        "goal": f"{eye.name}.goal",
        "colors": [palette.cycle_color(number) for number in targets],
        "targets": list(targets.values()),
    }
