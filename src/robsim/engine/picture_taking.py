"""Pictures that the cameras of a task take, as a stage of the image stream."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.features.images.taken_pictures import TakenPictures, store_pictures
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Blocks
from robsim.servo.camera_target import CameraTarget
from robsim.world.imperfections.image_effect import ImageRows
from robsim.world.mounted_camera import get_picture_size
from robsim.world.scene_picture import CameraPictures, NoiseKey, warn_missing_meshes


@dataclass(frozen=True, eq=False)
class PictureRows:
    """The rows that the stage of pictures reads and writes.

    Attributes
    ----------
    image : ImageRows
        Whether the image is lost, and the keys of the noise.
    exposed : Rows
        Coordinates of the scene at the time of the image (nq,) and earlier (nq,), and the seconds
        between them.
    hashes : Rows
        Hash of the newest picture of each camera, in the order of their names.
    """

    image: ImageRows
    exposed: BlockRows
    hashes: BlockRows


class PictureTaking:
    """The Python stage that draws the pictures of an instant.

    Each camera draws one picture for all detectors and features. Lost images are not drawn.
    """

    def __init__(self, sights: Mapping[str, CameraTarget], rows: PictureRows) -> None:
        self.sights, self.rows, self.seed = sights, rows, int(rows.image.seed)
        self._of_thread = threading.local()

    def __call__(self, blocks: Blocks, step: int) -> None:
        """Store the pictures of all runs whose image arrives."""
        image = self.rows.image
        if step % image.every:
            store_pictures(blocks, {})
            return
        q, rates = self._find_motion(blocks)
        arrived = (blocks.get(image.lost) == 0.0) | (step == 0)
        runs = np.flatnonzero(arrived & np.isfinite(q).all(axis=0))
        key = NoiseKey(self.seed, blocks.get(image.run).view(np.uint64)[runs], step)
        taken, hashes = {}, blocks.get(self.rows.hashes)
        for number, (name, source) in enumerate(self._pictures.items()):
            grey = source.take(q[:, runs], rates[:, runs], key, blocks.rows[runs])
            taken[name] = TakenPictures(grey, runs)
            hashes[number, runs] = [compute_picture_hash(picture) for picture in grey]
        blocks.put(self.rows.hashes, hashes)
        store_pictures(blocks, taken)

    def _find_motion(self, blocks: Blocks) -> tuple[Array, Array]:
        """Return the coordinates (nq, B) at the exposure, and their velocities (nq, B)."""
        exposed = blocks.get(self.rows.exposed)
        nq = len(exposed) // 2
        q, before = exposed[:nq], exposed[nq : 2 * nq]
        with np.errstate(all="ignore"):  # a run may contain NaN, and the first image no motion
            return q, np.where(q == before, 0.0, (q - before) / exposed[-1])

    @property
    def _pictures(self) -> dict[str, CameraPictures]:
        """The pictures of each camera; each thread has its own."""
        if not hasattr(self._of_thread, "pictures"):
            self._of_thread.pictures = {
                name: CameraPictures(each.scene, each.eye) for name, each in self.sights.items()
            }
        pictures: dict[str, CameraPictures] = self._of_thread.pictures
        return pictures


def check_pictures(sights: Mapping[str, CameraTarget], dt: float) -> None:
    """Raise InputError if a camera has no size, or its exposure is too long."""
    for sight in sights.values():
        eye = sight.eye
        get_picture_size(eye)
        warn_missing_meshes(sight.scene)
        seconds = 0.0 if eye.optics is None else float(np.max(eye.optics.duration))
        if seconds > dt:
            raise InputError(
                f"the exposure and readout of camera '{eye.name}' take {seconds:g} s; at most the "
                f"control period, {dt:g} s"
            )


def compute_picture_hash(picture: NDArray[np.uint8]) -> float:
    """Return 52 bits of the BLAKE2b hash of a picture, which a float stores exactly.

    >>> compute_picture_hash(np.zeros((2, 3), dtype=np.uint8))
    679958814734852.0
    """
    words = blake2b(picture.tobytes(), digest_size=8).digest()
    return float(int.from_bytes(words, "little") >> 12)
