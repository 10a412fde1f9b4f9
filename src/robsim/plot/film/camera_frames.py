"""The frames of a film that shows the pictures of a camera."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.plot.film.film_source import FilmSource
from robsim.plot.film.frame_times import FrameTimes
from robsim.plot.run_pictures import CameraInstants
from robsim.world.scene_picture import CameraPictures

Frame = NDArray[np.uint8]  # (height, width, 4): red, green, blue, and full opacity


class CameraFrames:
    """The pictures of a camera at the instants of a film, drawn again from the run."""

    def __init__(self, source: FilmSource, clock: FrameTimes, camera: str) -> None:
        self.clock = clock
        self._shots = [
            (shot, CameraPictures(shot.scene, shot.scene.camera(camera))) for shot in source.shots
        ]

    def __len__(self) -> int:
        return len(self.clock.instants)

    def __getitem__(self, k: int) -> Frame:
        return _build_frame(self.draw_picture(int(self.clock.instants[k])))

    def draw_picture(self, instant: int) -> NDArray[np.uint8]:
        """Return the picture (h, w) at an instant of the film."""
        shot, pictures = next(each for each in self._shots if instant in each[0].instants)
        return CameraInstants.of(shot.run).take(pictures, instant - shot.first)


def _build_frame(grey: NDArray[np.uint8]) -> Frame:
    """Return a picture (h, w) as a frame with even sides, which MP4 requires."""
    height, width = grey.shape
    even = np.pad(grey, ((0, height % 2), (0, width % 2)), mode="edge")
    opaque = np.full_like(even, 255)
    return np.stack([even, even, even, opaque], axis=-1)
