"""The renderer of one camera: it draws the same bodies at many poses."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.kernels.raster.edge_coverage import PLACES
from robsim.kernels.raster.picture import draw_pictures
from robsim.kernels.raster.raster_arrays import PixelBuffers, PlacedFaces
from robsim.rendering.face_table import build_faces
from robsim.rendering.image_plane import build_image_plane
from robsim.rendering.rendered_face import RenderedFace
from robsim.vision.camera import Camera
from robsim.vision.tags.target_renderer import BACKGROUND, spread_places

NEIGHBOURS = 9  # pixels whose faces a pixel at an edge may see
FULL_LIGHT = (0.0, 0.0, 1.0, 1.0)


class Renderer:
    """Draws bodies as a camera sees them.

    Parameters
    ----------
    camera : Camera
        Camera with a size.
    bodies : sequence of lists of RenderedFace
        Faces of each body, in its axes.
    samples : int, default 1
        Divisions along each side of a pixel.
    background : float, default 128
        Grey value of pixels without a body.
    """

    def __init__(
        self,
        camera: Camera,
        bodies: Sequence[Iterable[RenderedFace]],
        samples: int = 1,
        background: float = BACKGROUND,
    ) -> None:
        assert camera.size is not None
        width, height = self._size = camera.size
        self._samples, self._background = samples, float(background)
        self._bodies = len(bodies)
        self._faces, self._pictures = build_faces(bodies)
        self._plane = build_image_plane(camera, samples)
        self._pattern = np.ascontiguousarray(spread_places(math.isqrt(PLACES)).T, dtype=np.float32)
        self._placed = _allocate_placed(len(self._faces.body), len(self._faces.corners))
        self._buffers = _allocate_buffers(width * samples, height * samples)
        rows = height * samples if samples > 1 else 0
        self._fine = np.empty((rows, width * samples), dtype=np.float32)

    def draw(self, T_c_b: Array, light: Sequence[float] = FULL_LIGHT) -> NDArray[np.float32]:
        """Return the grey values (h, w) of the bodies at poses (bodies, 4, 4) in camera axes.

        `light` is (lx, ly, lz, ambient): the unit direction of the rays in camera axes, and the
        share of light from everywhere.
        """
        image: NDArray[np.float32] = self.draw_many(np.asarray(T_c_b)[None], [light])[0]
        return image

    def draw_many(
        self, T_c_b: Array, light: Sequence[Sequence[float]] | Array | None = None
    ) -> NDArray[np.float32]:
        """Return the grey values (B, h, w) of the bodies at poses (B, bodies, 4, 4).

        The pictures are drawn one after the other in one call, without the GIL, and have the bits
        of single pictures. `light` (B, 4) has a row for each picture; by default, all light is
        from everywhere.
        """
        poses = np.ascontiguousarray(np.asarray(T_c_b, dtype=float)[:, :, :3])
        lights = np.array([FULL_LIGHT] * len(poses) if light is None else light, dtype=float)
        lights = lights.reshape(-1, 4)
        assert poses.shape == (len(lights), self._bodies, 3, 4), poses.shape
        width, height = self._size
        images = np.empty((len(poses), height, width), dtype=np.float32)
        draw_pictures(
            self._faces,
            self._pictures,
            self._plane,
            poses,
            lights,
            self._background,
            self._pattern,
            self._samples,
            self._placed,
            self._buffers,
            self._fine,
            images,
        )
        return images


def _allocate_placed(faces: int, corners: int) -> PlacedFaces:
    return PlacedFaces(
        sides=np.zeros((corners, 3)),
        plane=np.zeros((faces, 3, 3)),
        box=np.zeros((faces, 4), dtype=np.int64),
        shade=np.zeros(faces),
        points=np.zeros((corners, 3)),
    )


def _allocate_buffers(width: int, height: int) -> PixelBuffers:
    floats = {name: np.empty(width, dtype=np.float32) for name in ("u", "v", "x", "y")}
    floats |= {name: np.empty(width, dtype=np.float32) for name in ("fine", "coarse", "inside")}
    return PixelBuffers(
        face=np.empty((height, width), dtype=np.int32),
        nearness=np.empty((height, width), dtype=np.float32),
        index=np.empty(width, dtype=np.int32),
        upper=np.empty(width, dtype=np.uint32),
        lower=np.empty(width, dtype=np.uint32),
        tone=np.empty((height, width), dtype=np.int32),
        differs=np.empty(width, dtype=np.int32),
        least=np.empty((3, width), dtype=np.int32),
        greatest=np.empty((3, width), dtype=np.int32),
        near=np.empty((4, NEIGHBOURS), dtype=np.int64),
        shares=np.empty((NEIGHBOURS, 3)),
        **floats,
    )
