"""Draw the picture of the shipped experiment `photometric`, always the same one.

python tools/draw_photometric_poster.py

Random grey values in five grids, each twice as fine and with 0.6 times the contrast, are blended
smoothly: a texture with coarse and fine parts, as natural pictures have.
"""

from pathlib import Path

import numpy as np
from PIL import Image

import robsim as rs

SIZE = (300, 215)  # pixels, 0.6 x 0.43 m
COARSEST, GRIDS, SHARE = 8, 4, 0.7
TARGET = Path(rs.examples.path("visp_tutorial")).parent / "photometric.png"


def blend_grid(rng: np.random.Generator, columns: int) -> np.ndarray:
    """Return random values between -1 and 1, blended by a cubic between the nodes of a grid."""
    width, height = SIZE
    rows = columns * height // width + 2
    nodes = rng.uniform(-1, 1, (rows + 1, columns + 2))
    x, y = (np.arange(n) * columns / width for n in SIZE)
    j, i = x.astype(int), y.astype(int)
    u, v = ((3 - 2 * t) * t**2 for t in (x - j, (y - i)[:, None]))
    upper, lower = ((1 - u) * nodes[k][:, j] + u * nodes[k][:, j + 1] for k in (i, i + 1))
    return (1 - v) * upper + v * lower


def main() -> None:
    """Write the picture."""
    rng = np.random.default_rng(32)
    grey = sum(SHARE**k * blend_grid(rng, COARSEST * 2**k) for k in range(GRIDS))
    low, high = np.quantile(grey, [0.01, 0.99])
    levels = np.clip((grey - low) / (high - low), 0, 1)
    picture = np.round(10 + 235 * levels).astype(np.uint8)
    Image.fromarray(picture).save(TARGET, optimize=True)
    print(f"{TARGET}: {TARGET.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
