"""The renderer of one camera: it draws the same bodies at many poses."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.kernels.raster.edge_coverage import MOST_CROSSINGS, PLACES
from robsim.kernels.raster.picture import draw_pictures
from robsim.kernels.raster.raster_arrays import ImagePlane, PixelBuffers, PlacedFaces
from robsim.rendering.face_table import build_faces
from robsim.rendering.image_plane import build_image_plane, crop_image_plane
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
        self._windows: dict[tuple[int, int], ImagePlane] = {}  # by first row and end of samples
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
        lights = [FULL_LIGHT] * len(T_c_b) if light is None else light
        return self._draw_window(T_c_b, lights, self._plane, self._buffers, self._size[1])

    def draw_rows(
        self, T_c_b: Array, light: Sequence[float], top: int, end: int
    ) -> NDArray[np.float32]:
        """Return the rows from `top` to `end` of the picture that `draw` returns.

        The values differ from those of `draw` by rounding errors.
        """
        n, height = self._samples, self._size[1]
        first, last = max(top - 1, 0), min(end + 1, height)  # rows to find edges at the border
        window = (first * n, last * n)
        if window not in self._windows:
            self._windows[window] = crop_image_plane(self._plane, *window)
        rows = (last - first) * n
        names = ("face", "nearness", "tone")
        part = {name: getattr(self._buffers, name)[:rows] for name in names}
        buffers = self._buffers._replace(**part)
        poses = np.asarray(T_c_b)[None]
        image = self._draw_window(poses, [light], self._windows[window], buffers, last - first)[0]
        return np.asarray(image[top - first : end - first])

    def _draw_window(
        self,
        T_c_b: Array,
        lights: Sequence[Sequence[float]] | Array,
        plane: ImagePlane,
        buffers: PixelBuffers,
        height: int,
    ) -> NDArray[np.float32]:
        """Return the grey values (B, height, w) of the pixels of an image plane."""
        poses = np.ascontiguousarray(np.asarray(T_c_b, dtype=float)[:, :, :3])
        light = np.array(lights, dtype=float).reshape(-1, 4)
        assert poses.shape == (len(light), self._bodies, 3, 4), poses.shape
        images = np.empty((len(poses), height, self._size[0]), dtype=np.float32)
        draw_pictures(
            self._faces,
            self._pictures,
            plane,
            poses,
            light,
            self._background,
            self._pattern,
            self._samples,
            self._placed,
            buffers,
            self._fine[: height * self._samples],
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
        near=np.empty((3, NEIGHBOURS), dtype=np.int64),
        shares=np.empty((NEIGHBOURS, 3)),
        polygon=np.empty((2, 2, 4 + MOST_CROSSINGS)),
        **floats,
    )
