"""Solids as shaded faces, with their shadows on the ground."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import (  # type: ignore[import-untyped]
    Line3DCollection,
    Poly3DCollection,
)

from robsim.base.arrays import Array
from robsim.plot import palette
from robsim.plot.wireframe import Wire

LIGHT = np.array([0.35, -0.55, 0.76])  # towards the lamp, in the axes of the figures
AMBIENT = 0.62  # brightness of a face turned away from the lamp; 1 in full light
PALE, GREY = (
    0.25,
    0.38,
)  # shares of white in a face, so that its dark edges are seen; in a black one
SHADOW = "#dcdcda"
GROUNDED, SHADED, LINED, SHEER = 1, 4, 5, 6  # the order in which they are drawn


class Solids(Poly3DCollection):  # type: ignore[misc]
    """The faces of several solids, sorted by depth together; `labels` names their solids."""

    def __init__(self, wires: Sequence[Wire]) -> None:
        faces = [(wire, i) for wire in wires for i in range(len(wire.faces))]
        fills = [shaded(wire.color, wire.faces[i]) for wire, i in faces]
        pairs = zip(faces, fills, strict=True)
        edges = [_dark(wire.color) if wire.bordered[i] else fill for (wire, i), fill in pairs]
        super().__init__(
            _padded([wire.faces[i] for wire, i in faces]),
            facecolors=fills,
            edgecolors=edges,
            linewidths=0.6,
            zorder=SHADED,
        )
        self.labels = [wire.label for wire, _ in faces]


def _padded(faces: Sequence[Array]) -> list[Array]:
    """Return faces with equal numbers of corners, by repeating corners evenly.

    Matplotlib pads faces of unequal size with uninitialised memory.
    """
    most = max(len(face) for face in faces)
    return [face[np.arange(most) * len(face) // most] for face in faces]


def shaded(color: str, face: Array) -> tuple[float, float, float]:
    """Return the colour of a face (n, 3) under a lamp; faces turned towards it are brighter."""
    normal = np.cross(face[1] - face[0], face[2] - face[1])
    cosine = float(normal @ LIGHT) / (float(np.linalg.norm(normal) * np.linalg.norm(LIGHT)) or 1.0)
    bright = AMBIENT + (1 - AMBIENT) * max(cosine, 0.0)
    red, green, blue = bright * np.array(
        to_rgb(palette.tinted(color, GREY if color == palette.BLACK else PALE))
    )
    return float(red), float(green), float(blue)


def draw(axes: Any, wires: Sequence[Wire]) -> None:
    """Draw solids, shaded where they have faces, else as lines."""
    dense = [wire for wire in wires if wire.faces and not wire.sheer]
    if dense:
        _add(axes, Solids(dense))
    for wire in wires:
        if wire.sheer:
            look = {"facecolors": wire.color, "alpha": 0.1, "linewidths": 0, "zorder": SHEER}
            _add(axes, Poly3DCollection(wire.faces, **look))
        if wire.sheer or not wire.faces:
            thick = 1.2 if wire.sheer else 3.0
            look = {"colors": wire.color, "linewidths": thick, "zorder": LINED, "label": wire.label}
            _add(axes, Line3DCollection(wire.segments, capstyle="round", **look))


def draw_shadows(axes: Any, wires: Sequence[Wire], ground: float) -> None:
    """Draw the shadows of a lamp straight above, on ground at a height in metres."""
    faces = [face for wire in wires if not wire.sheer for face in wire.faces]
    flat = [np.column_stack([face[:, :2], np.full(len(face), ground)]) for face in faces]
    look = {"facecolors": SHADOW, "edgecolors": SHADOW, "linewidths": 0.5, "zorder": GROUNDED}
    if flat:
        _add(axes, Poly3DCollection(_padded(flat), **look))
    for wire in wires:
        if not wire.faces:
            below = wire.segments * (1, 1, 0) + (0, 0, ground)
            look = {"colors": SHADOW, "linewidths": 3.0, "zorder": GROUNDED}
            _add(axes, Line3DCollection(below, capstyle="round", **look))


def draw_outline(axes: Any, wire: Wire, label: str, look: dict[str, Any]) -> None:
    """Draw only the edges of a solid, with the properties of a line."""
    plural = {f"{name}s": value for name, value in look.items() if name != "zorder"}
    lines = Line3DCollection(wire.segments, **plural, zorder=look["zorder"], label=label)
    _add(axes, lines)


def _add(axes: Any, collection: Any) -> None:
    axes.add_collection3d(collection, autolim=False)
    collection.set_clip_on(False)  # the box may be larger than the axes that hold it


def _dark(color: str) -> str:
    return palette.tinted(color, -0.55) if color != palette.BLACK else palette.BLACK
