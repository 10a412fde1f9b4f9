"""The images of a log at the times of their exposure, and their prediction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, move_runs_first, move_runs_last
from robsim.geometry.pose import Pose
from robsim.robot.tree import Tree
from robsim.servo.camera_target import CameraTarget
from robsim.vision.camera import Camera

if TYPE_CHECKING:
    import xarray as xr

MOST_IMAGES = 200  # images of a fit; more are thinned out evenly
EARLY, FEWEST_LATER = 6, 30  # first periods without images of a fit, if so many images are later
SAME_TIME = 1e-6  # seconds between the times of one image in two periods

JointChange = Callable[[Array], Array]  # measured coordinates (n, nq) to true coordinates


@dataclass(frozen=True, eq=False)
class JointTrack:
    """The measured coordinates (T, nq) of the joints at times (T,) in seconds."""

    tree: Tree
    times: Array
    q: Array

    def at(self, times: Array) -> Array:
        """Return the coordinates (n, nq) at times, by interpolation."""
        right = np.clip(np.searchsorted(self.times, times, side="right"), 1, len(self.times) - 1)
        left, step = right - 1, self.times[right] - self.times[right - 1]
        share = np.clip((times - self.times[left]) / step, 0.0, 1.0)
        q = self.tree.between(
            move_runs_last(self.q[left], 1), move_runs_last(self.q[right], 1), share
        )
        return move_runs_first(q)


@dataclass(frozen=True, eq=False)
class ImageSeries:
    """The images of a target by a camera: their times (n,), and pixels (n, N, 2)."""

    sight: CameraTarget
    times: Array
    pixels: Array
    track: JointTrack

    @property
    def camera(self) -> Camera:
        """The camera of the scene."""
        return self.sight.eye.camera

    @cached_property
    def pixels_of_scene(self) -> Array:
        """The pixels (n, N, 2) that the scene predicts."""
        return self.predict()

    def predict(
        self,
        change: JointChange | None = None,
        times: Array | None = None,
        mount: Pose | None = None,
        place: Pose | None = None,
        camera: Camera | None = None,
        marks: Array | None = None,
    ) -> Array:
        """Return the pixels (n, N, 2) with some changes of joints, times, poses, lens or marks.

        `mount` and `place` are poses T_m_c and T_f_o of camera and target in their frames, single
        or one for each image.
        """
        A = self._chain_of_scene
        if change is not None or times is not None:
            q = self._q if times is None else self.track.at(times)
            A = self._chain(q if change is None else change(q))
        X = self.sight.eye.pose if mount is None else mount
        Z = self.sight.target.pose if place is None else place
        T = np.linalg.inv(X.matrix) @ A @ Z.matrix
        p = self.sight.target.marks if marks is None else marks
        points = p @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
        pixels, _ = (self.camera if camera is None else camera).image_of(move_runs_last(points, 2))
        return move_runs_first(pixels)

    @cached_property
    def _chain_of_scene(self) -> Array:
        return self._chain(self._q)

    @cached_property
    def _q(self) -> Array:
        return self.track.at(self.times)

    def _chain(self, q: Array) -> Array:
        """Return the poses T_m_f (n, 4, 4) of the target's frame in the frame of the camera."""
        scene, (eye, target) = self.sight.scene, (self.sight.eye, self.sight.target)
        return (scene.pose(eye.on, q).inv() @ scene.pose(target.on, q)).matrix


def collect_image_series(
    run: xr.Dataset, track: JointTrack, sights: tuple[CameraTarget, ...]
) -> list[ImageSeries]:
    """Return the new images of each camera and target in a recorded run.

    An image counts once, at the time of its exposure: the time of the first period that has it,
    minus its age. The first period is left out, as its marks may be of several images, and in a
    longer log the next periods: an image with a wrong time may be of joints before the run. An
    image with the same pixels as the image before it counts as a repetition.
    """
    series, first = [], 0
    for sight in sights:
        count = len(sight.target.marks)
        pixels = run["pixels"].values[:, first : first + count]
        times = track.times - run["image_age"].values[:, first]
        first += count
        rows = _find_new_images(times, pixels)
        later = rows[times[rows] > track.times[min(EARLY, len(times) - 1)]]
        rows = later if len(later) >= FEWEST_LATER else rows
        rows = rows[np.linspace(0, len(rows) - 1, min(len(rows), MOST_IMAGES)).astype(int)]
        series.append(ImageSeries(sight, times[rows], pixels[rows], track))
    return series


def _find_new_images(times: Array, pixels: Array) -> NDArray[np.int64]:
    """Return the periods with a new image of at least one mark."""
    seen = np.asarray(np.isfinite(pixels).all(axis=2)).any(axis=1)
    newer = np.diff(times, prepend=times[0]) > SAME_TIME
    other = np.asarray(pixels[1:] != pixels[:-1]).any(axis=(1, 2))
    return np.flatnonzero(seen & newer & np.concatenate([[False], other]))


def join_series(parts: list[Array]) -> Array:
    """Return the pixels of several series side by side, as signals (n, M) padded by NaN."""
    rows = max((len(part) for part in parts), default=0)
    padded = []
    for part in parts:
        wide = np.full((rows, part[0].size if len(part) else 0), np.nan)
        wide[: len(part)] = part.reshape(len(part), -1)
        padded.append(wide)
    return np.concatenate(padded, axis=1) if padded else np.empty((0, 0))
