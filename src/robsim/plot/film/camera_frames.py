"""The frames of a film that shows the pictures of a camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.plot.film.film_source import FilmShot, FilmSource
from robsim.plot.film.frame_times import FrameTimes
from robsim.world.scene_picture import CameraPictures, NoiseKey

Frame = NDArray[np.uint8]  # (height, width, 4): red, green, blue, and full opacity


class CameraFrames:
    """The pictures of a camera at the instants of a film, drawn again from the run.

    They are the pictures in which a task detected its marks, if its images were on time and all
    instants are recorded: with the same noise, and with the motion since the instant before.
    """

    def __init__(self, source: FilmSource, clock: FrameTimes, camera: str) -> None:
        self.clock, self._camera = clock, camera
        self._shots = [(shot, _make_pictures(shot, camera)) for shot in source.shots]

    def __len__(self) -> int:
        return len(self.clock.instants)

    def __getitem__(self, k: int) -> Frame:
        grey = self.draw_picture(int(self.clock.instants[k]))
        height, width = grey.shape
        even = np.pad(grey, ((0, height % 2), (0, width % 2)), mode="edge")  # for MP4
        opaque = np.full_like(even, 255)
        return np.stack([even, even, even, opaque], axis=-1)

    def draw_picture(self, instant: int) -> NDArray[np.uint8]:
        """Return the picture (h, w) at an instant of the film."""
        shot, pictures = next(each for each in self._shots if instant in each[0].instants)
        t = instant - shot.first
        q, time = shot.run["q"].values, shot.run["time"].values
        rates = (q[t] - q[t - 1]) / (time[t] - time[t - 1]) if t > 0 else np.zeros_like(q[0])
        number = np.atleast_1d(shot.run["run"].values).astype(np.uint64)
        seed, dt = int(shot.run.attrs.get("seed", 0)), float(shot.run.attrs.get("dt", 1.0))
        key = NoiseKey(seed, number, round(float(time[t]) / dt))
        picture: NDArray[np.uint8] = pictures.take(_column(q[t]), _column(rates), key)[0]
        return picture


def _make_pictures(shot: FilmShot, camera: str) -> CameraPictures:
    """Return the pictures of a camera in the scene of a shot."""
    scene, eye = shot.scene, shot.scene.camera(camera)
    if eye.camera.size is None:
        raise InputError(f"camera '{camera}' has no size, which a picture needs")
    return CameraPictures(scene, eye)


def _column(values: Array) -> Array:
    return np.ascontiguousarray(values[:, None], dtype=float)
