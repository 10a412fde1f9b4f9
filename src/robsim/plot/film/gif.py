"""Films as GIF: one palette for all frames, and only the changed region of each frame."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from io import BytesIO

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray
from PIL import GifImagePlugin, Image

from robsim.plot import palette
from robsim.plot.film.film_frames import Frame

FASTEST = 50.0  # frames per second; viewers slow down a faster GIF
COLORS, EXACT = 255, 96  # colours of a palette; frequent colours that are kept exactly
RESERVED = (*palette.CYCLE, palette.GOAL, palette.GREY)  # colours of thin lines, kept exactly
UNCHANGED = 255  # palette index of an unchanged pixel
_KEEP = 1  # disposal method that keeps the pixels outside of the region
_FOR_EVER = b"!\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00"
_END = b";"


def encode_gif(
    frames: Iterable[Frame], count: int, palette_frames: Sequence[Frame], fps: float, pause: float
) -> bytes:
    """Return a GIF of `count` frames that repeats forever.

    The last frame stays for `pause` additional seconds. The palette is computed from a sample
    of the frames. Times in a GIF are hundredths of a second; each frame begins at the hundredth
    nearest to its time.

    Source: CompuServe, Graphics Interchange Format, version 89a, 1990.
    """
    colors, last, before = _GifPalette(palette_frames), count - 1, None
    file = BytesIO()
    file.write(_encode_gif_header(colors, palette_frames[0].shape))
    for k, now in enumerate(frames):
        end = (k + 1) / fps + (pause if k == last else 0.0)
        file.write(_encode_control_block(round(100 * end) - round(100 * k / fps)))
        file.write(_encode_image_block(colors, now, before))
        before = now
    file.write(_END)
    return file.getvalue()


class _GifPalette:
    """The palette of some frames: reserved and frequent colours exactly, other colours quantised.

    Quantisation would mix the colours of paper, ground, faces and goals with the edges of letters.
    """

    def __init__(self, palette_frames: Sequence[Frame]) -> None:
        ours = np.array([to_rgb(name) for name in RESERVED]) * 255
        exact = np.concatenate(
            [ours.round().astype(np.uint8), _find_frequent_colors(palette_frames)]
        )
        pixels = Image.fromarray(np.concatenate(palette_frames)).convert("RGB")
        mixed = pixels.quantize(COLORS - len(exact), dither=Image.Dither.NONE).getpalette() or []
        self.table = bytes([*exact.ravel().tolist(), *mixed][: 3 * COLORS]).ljust(768, b"\0")
        image = Image.new("P", (1, 1))
        image.putpalette(self.table[: 3 * COLORS])
        cells = Image.fromarray(_CELL_COLORS).quantize(palette=image, dither=Image.Dither.NONE)
        self._nearest = np.array(cells).ravel()
        self._nearest[_compute_color_cell(exact[::-1])] = np.arange(len(exact), dtype=np.uint8)[
            ::-1
        ]

    def find_indices(self, pixels: Frame) -> NDArray[np.uint8]:
        """Return the palette index of the nearest colour of each pixel."""
        return np.asarray(self._nearest[_compute_color_cell(pixels)])


def _compute_color_cell(pixels: Frame) -> NDArray[np.int32]:
    """Return the index of the colour cell of each pixel (..., 3), among 64^3 cells."""
    red, green, blue = (pixels[..., i].astype(np.int32) >> 2 for i in range(3))
    return np.asarray((red << 12) | (green << 6) | blue)


def _compute_cell_colors() -> Frame:
    """Return the colour (512, 512, 3) in the middle of each cell, in the order of the cells."""
    steps = (4 * np.arange(64) + 2).astype(np.uint8)
    return np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(512, 512, 3)


_CELL_COLORS = _compute_cell_colors()


def _find_frequent_colors(palette_frames: Sequence[Frame]) -> Frame:
    """Return the most frequent colours (N, 3) of frames, the most frequent first."""
    red, green, blue, _ = np.concatenate(palette_frames).reshape(-1, 4).T.astype(np.int32)
    colors, counts = np.unique((red << 16) | (green << 8) | blue, return_counts=True)
    often = colors[np.argsort(-counts, kind="stable")[:EXACT]]
    return np.stack([often >> 16, often >> 8 & 255, often & 255], axis=-1).astype(np.uint8)


def _find_changed_pixels(now: Frame, before: Frame | None) -> NDArray[np.intp]:
    """Return the indices of the pixels that differ between two frames, row by row."""
    if before is None:
        return np.arange(now.shape[0] * now.shape[1])
    one, other = (frame.view(np.uint32).ravel() for frame in (now, before))  # a pixel as one number
    return np.flatnonzero(one != other)


def _find_region(pixels: NDArray[np.intp], width: int) -> tuple[slice, slice]:
    """Return the smallest region with some pixels as two slices; one pixel without any."""
    if not len(pixels):
        return np.s_[:1, :1]
    rows, columns = np.divmod(pixels, width)
    return np.s_[rows[0] : rows[-1] + 1, columns.min() : columns.max() + 1]


def _encode_image_block(colors: _GifPalette, now: Frame, before: Frame | None) -> bytes:
    """Return the block of the file for the changed region of a frame."""
    changed = _find_changed_pixels(now, before)
    part = _find_region(changed, now.shape[1])
    numbers = np.full(now.shape[:2], UNCHANGED, dtype=np.uint8)
    numbers.ravel()[changed] = colors.find_indices(now.reshape(-1, 4)[changed])
    corner = (int(part[1].start or 0), int(part[0].start or 0))
    return b"".join(GifImagePlugin.getdata(Image.fromarray(numbers[part]), corner, interlace=0))


def _encode_control_block(hundredths: int) -> bytes:
    """Return the block of the file that shows an image for hundredths of a second."""
    return struct.pack("<3sBHBB", b"!\xf9\x04", _KEEP << 2 | 1, hundredths, UNCHANGED, 0)


def _encode_gif_header(colors: _GifPalette, shape: tuple[int, ...]) -> bytes:
    """Return the header of a file of frames of shape (height, width, 4)."""
    size = struct.pack("<6sHHBBB", b"GIF89a", shape[1], shape[0], 0xF7, 0, 0)
    return size + colors.table + _FOR_EVER
