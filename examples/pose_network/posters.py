"""Procedural posters: pictures of many kinds, as functions of a kind and a seed.

The kinds in `TRAINED` are shown to the network in training, and the kinds in `UNSEEN` are not.
"""

import numpy as np

ROWS, COLUMNS = 138, 192  # a poster of 0.6 x 0.43 m has texels of 3 mm
Y, X = np.mgrid[:ROWS, :COLUMNS].astype(np.float32)


def draw_poster(kind, seed):
    """Return the grey values (138, 192) of the poster of a kind and a seed, as uint8."""
    rng = np.random.default_rng([sorted(KINDS).index(kind), seed])
    return scale_contrast(rng, KINDS[kind](rng))


def scale_contrast(rng, image):
    """Return whole grey values with a random brightest and darkest value."""
    low, high = np.quantile(image, [0.01, 0.99])
    dark, bright = rng.uniform(0, 70), rng.uniform(170, 255)
    greys = dark + (bright - dark) * (image - low) / max(high - low, 1e-6)
    return np.clip(np.rint(greys), 0, 255).astype(np.uint8)


def draw_noise(rng, coarsest=None, decay=None):
    """Return noise of several octaves, from `coarsest` cells across the poster on."""
    cells = rng.integers(2, 7) if coarsest is None else coarsest
    decay = rng.uniform(0.35, 0.85) if decay is None else decay
    image, share = np.zeros((ROWS, COLUMNS), dtype=np.float32), 1.0
    while cells < COLUMNS / 2:
        nodes = rng.standard_normal((max(2, int(cells * ROWS / COLUMNS)) + 1, cells + 1))
        image += share * interpolate(nodes.astype(np.float32))
        cells, share = 2 * cells, decay * share
    return image / image.std()


def interpolate(nodes):
    """Return the values of nodes on a grid, interpolated at all texels."""
    return weigh(ROWS, len(nodes)) @ nodes @ weigh(COLUMNS, nodes.shape[1]).T


def weigh(texels, nodes):
    """Return the smooth weights (texels, nodes) of nodes."""
    at = np.linspace(0, nodes - 1, texels)
    distance = np.clip(np.abs(at[:, None] - np.arange(nodes)), 0, 1)
    return (1 - distance**2 * (3 - 2 * distance)).astype(np.float32)


def mask_shape(rng, smallest, largest):
    """Return the texels (138, 192) of a random ellipse, rectangle, triangle or ring."""
    x, y = X - rng.uniform(0, COLUMNS), Y - rng.uniform(0, ROWS)
    c, s = np.cos(a := rng.uniform(0, np.pi)), np.sin(a)
    half = rng.uniform(smallest, largest) * np.array([1, rng.uniform(0.3, 1)])
    u, v = (c * x + s * y) / half[0], (c * y - s * x) / half[1]
    kind = rng.integers(4)
    if kind == 0:
        return u * u + v * v < 1
    if kind == 1:
        return np.maximum(abs(u), abs(v)) < 1
    if kind == 2:
        return (v > -1) & (v < 1 - 2 * abs(u))
    return abs(u * u + v * v - 1) < 0.4


def draw_shapes(rng):
    """Return flat shapes on a ground with a slight gradient."""
    image = rng.uniform(0, 1) + draw_noise(rng, 2) * rng.uniform(0, 0.1)
    for _ in range(rng.integers(8, 40)):
        image[mask_shape(rng, 4, 40)] = rng.uniform(0, 1)
    return image


def draw_leaves(rng):
    """Return overlapping bodies with shades and textures of their own, as a photograph has."""
    image, grain = draw_noise(rng), draw_noise(rng, rng.integers(6, 20))
    for size in np.sort(rng.uniform(8, 60, rng.integers(20, 50)))[::-1]:
        mask = mask_shape(rng, 0.7 * size, size)
        slope = rng.normal(0, 0.012, 2)
        shade = rng.normal(0, 1.2) + slope[0] * X + slope[1] * Y + rng.uniform(0, 0.5) * grain
        image[mask] = shade[mask]
    return image + draw_noise(rng, 2) * 0.4


def draw_text(rng):
    """Return lines of random letters of some sizes, and a picture beside them."""
    image = np.full((ROWS, COLUMNS), 1.0, dtype=np.float32) + draw_noise(rng, 2) * 0.04
    top = int(rng.integers(2, 10))
    while top < ROWS - 10:
        size = int(rng.choice([1, 1, 2, 2, 3, 4]))  # texels of a stroke
        image[top : top + 7 * size, :] -= draw_line(rng, size)[: ROWS - top]
        top += int((8 + rng.integers(1, 5)) * size)
    if rng.random() < 0.6:
        left, high = rng.integers(0, COLUMNS - 60), rng.integers(0, ROWS - 50)
        part = draw_noise(rng)[high : high + 50, left : left + 60] * 0.3
        image[high : high + 50, left : left + 60] = 0.5 + part
    return image if rng.random() < 0.7 else -image


def draw_line(rng, size):
    """Return one line of random letters (7 size, 192) with strokes of `size` texels."""
    line, left = np.zeros((7, COLUMNS // size + 8), dtype=np.float32), int(rng.integers(1, 8))
    while left < COLUMNS // size - rng.integers(1, 12):
        word = int(rng.integers(1, 9))
        for _ in range(word):
            if left < COLUMNS // size:
                line[:, left : left + 4] = draw_letter(rng)
            left += 5
        left += 3
    return np.kron(line, np.ones((size, size), dtype=np.float32))[:, :COLUMNS] * 0.85


def draw_letter(rng):
    """Return a letter (7, 4) of vertical and horizontal strokes."""
    letter = np.zeros((7, 4), dtype=np.float32)
    letter[:, rng.integers(0, 4)] = 1
    for _ in range(rng.integers(1, 3)):
        letter[rng.integers(0, 7), rng.integers(0, 2) : rng.integers(3, 5)] = 1
    if rng.random() < 0.5:
        letter[rng.integers(0, 4) :, rng.integers(0, 4)] = 1
    return letter


def draw_blots(rng):
    """Return noise cut at a level, with some grey in it."""
    noise = draw_noise(rng, rng.integers(4, 12))
    return np.tanh(noise * rng.uniform(1, 6)) + 0.3 * draw_noise(rng)


def draw_cells(rng):
    """Return the Voronoi cells of random points, each with its grey value."""
    count = int(rng.integers(20, 120))
    x, y = rng.uniform(0, COLUMNS, count), rng.uniform(0, ROWS, count)
    distance = (X[..., None] - x) ** 2 + (Y[..., None] - y) ** 2
    return rng.uniform(0, 1, count)[distance.argmin(axis=-1)] + 0.05 * draw_noise(rng)


def draw_streets(rng):
    """Return a map: streets of several widths on blocks, and a river."""
    image = 0.6 + 0.1 * draw_noise(rng, 4)
    image[abs(draw_noise(rng, 3, 0.3)) < 0.2] = 0.3
    for width in rng.choice([1.0, 1.5, 2.5, 4.0], rng.integers(12, 35)):
        a, bend = rng.uniform(0, np.pi), rng.normal(0, 0.004)
        x, y = X - rng.uniform(0, COLUMNS), Y - rng.uniform(0, ROWS)
        along, across = np.cos(a) * x + np.sin(a) * y, np.cos(a) * y - np.sin(a) * x
        image[abs(across + bend * along**2) < width] = rng.choice([0.0, 1.0])
    return image


KINDS = {
    "noise": draw_noise,
    "shapes": draw_shapes,
    "leaves": draw_leaves,
    "text": draw_text,
    "blots": draw_blots,
    "cells": draw_cells,
    "streets": draw_streets,
}
UNSEEN = ("cells", "streets")
TRAINED = tuple(sorted(set(KINDS) - set(UNSEEN)))
