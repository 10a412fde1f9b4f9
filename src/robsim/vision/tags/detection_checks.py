"""Reasons to doubt a detected tag: small cells, image border, low contrast, wrong cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.vision.plane import estimate_homography
from robsim.vision.tags.edges import sample_image
from robsim.vision.tags.tag import Tag

SMALL = 3.0  # pixels of a cell: tags with smaller cells have corner errors above 0.1 pixels
TINY = 1e-9  # pixels: smallest length of a side
FAINT = 20.0  # smallest difference of grey values between black and white cells


def cell_width(corners: Array, tag: Tag) -> float:
    """Return the smallest width of the cells of a tag in the image, in pixels."""
    after = np.roll(corners, -1, axis=0) - corners
    before = np.roll(after, 1, axis=0)
    area = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
    longer = np.maximum(np.hypot(*before.T), np.hypot(*after.T))
    return float((area / np.maximum(longer, TINY)).min()) / len(tag.cells)


def find_doubts(image: NDArray[np.uint8], tag: Tag, corners: Array) -> list[str]:
    """Return reasons to doubt a detected tag, an empty list for nearly all detections."""
    cell, reasons = cell_width(corners, tag), []
    h, w = image.shape
    if cell < SMALL:
        reasons.append(f"cells of {cell:.1f} pixels")
    if corners.min() < cell or (corners > np.array([w, h]) - 1 - cell).any():
        reasons.append("at the border of the image")
    return reasons + _check_cells(image, tag, corners)


def _check_cells(image: NDArray[np.uint8], tag: Tag, corners: Array) -> list[str]:
    """Return reasons to doubt a tag, from the grey values in the middle of its cells."""
    cells = tag.cells
    n = len(cells)
    H = estimate_homography(tag.marks[:, :2] / tag.pitch + n / 2, corners)
    column, row = np.meshgrid(np.arange(n) + 0.5, np.arange(n) + 0.5)
    rays = np.stack([column, row, np.ones((n, n))], axis=-1) @ H.T
    grey = sample_image(image, rays[..., :2] / rays[..., 2:])
    if not np.isfinite(grey).all():
        return ["partly outside the image"]
    dark, light = grey[cells].mean(), grey[~cells].mean()
    if light - dark < FAINT:
        return [f"a contrast of {light - dark:.0f} grey values"]
    wrong = int(((grey < (dark + light) / 2) != cells).sum())
    return [f"{wrong} of {n * n} cells do not match"] if wrong else []
