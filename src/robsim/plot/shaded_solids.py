"""Solids as shaded faces, with their shadows on the ground."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d import Axes3D, proj3d  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection  # type: ignore[import-untyped]

from robsim.base.arrays import Array
from robsim.plot import palette
from robsim.plot.face_order import FaceOrder, PaintedFaces, find_viewer
from robsim.plot.painted_parts import list_painted_parts
from robsim.plot.polygons import FaceArrays, Indices, PathPool
from robsim.plot.solid_shadows import ShadowOutlines
from robsim.plot.wireframe import WireSolid

LIGHT = np.array([0.35, -0.55, 1.1])  # towards the lamp, in the frame of the figures
AMBIENT = 0.62  # brightness of a face turned away from the lamp; 1 is full light
PALE, GREY = 0.25, 0.38  # shares of white in a face and in a black face, so that edges are visible
SHADOW = "#dcdcda"
GROUNDED, SHADED, LINED, TRANSPARENT = 1, 4, 5, 6  # z-order of the artists
EDGE = 0.6  # width of an edge, points
_Look = dict[str, Any]  # properties of an artist


@dataclass(frozen=True)
class MovableArtist:
    """An artist in 3-D axes, and a function that moves it to new positions of the same solids."""

    artist: Any
    move: Callable[[Sequence[WireSolid]], None]


class SolidFaces(Poly3DCollection):  # type: ignore[misc]
    """The faces of several solids, painted from the farthest to the nearest.

    `labels` are the labels of the faces. `FaceOrder` returns their order for the view of the axes.
    Faces without edges are painted slightly larger, so that no gap appears between neighbours.
    """

    _viewer: Array
    _painted: PaintedFaces

    def __init__(self, wires: Sequence[WireSolid]) -> None:
        sides = [(wire, i) for wire in wires for i in range(len(wire.faces))]
        self.labels = [wire.label for wire, _ in sides]
        self._has_border = np.array([wire.has_border[i] for wire, i in sides], dtype=bool)
        self._solid = np.repeat(np.arange(len(wires)), [len(wire.faces) for wire in wires])
        dark, self._pale = np.array([_choose_tints(wire.color) for wire, _ in sides]).swapaxes(0, 1)
        self._edges = np.pad(dark, ((0, 0), (0, 1)), constant_values=1.0)  # opaque
        self._order = FaceOrder([wire.faces for wire in wires])
        self._padding = _pad_corners(self._order.faces.counts)
        self._pool = PathPool()
        super().__init__([], zorder=SHADED, joinstyle="bevel", capstyle="round")
        self.move(wires)

    def move(self, wires: Sequence[WireSolid]) -> None:
        """Move the faces to new poses of the same solids, and shade them for these poses."""
        faces = self._order.faces.move([face for wire in wires for face in wire.faces])
        self.set_verts(faces.corners[self._padding])
        self.set_facecolor(_shade_faces(self._pale, faces))
        self._order.place(faces)
        self._viewer = np.zeros(4)

    def do_3d_projection(self) -> float:
        """Project the faces onto the paper in the order of the painter; return the least depth."""
        viewer = find_viewer(self.axes.M)
        if not np.array_equal(viewer, self._viewer):
            self._viewer, self._painted = viewer, self._order.arrange(viewer)
        x, y, depth = proj3d.proj_transform(*self._painted.corners.T, self.axes.M)
        scale = self._measure_scale()
        corners = np.column_stack([x, y]) * scale
        parts = list_painted_parts(self._painted, corners, self._has_border, self._solid)
        corners = parts.place_corners(corners, EDGE / 2) / scale
        self._paths = self._pool.build(corners, parts.codes, parts.ends)
        fills, dark = self._facecolor3d[parts.sources], self._edges[parts.sources]
        self._facecolors2d = np.where(parts.is_line[:, None], dark, fills)
        self._edgecolors2d = np.where(parts.is_lined[:, None], dark, fills)
        self._linewidths = np.where(parts.is_lined, EDGE, 0.0)
        return float(np.min(depth))

    def _measure_scale(self) -> Array:
        """Return the points (2,) on the paper for a unit of each coordinate of the projection."""
        pixels = np.diag(self.axes.transData.get_affine().get_matrix())[:2]
        return np.asarray(pixels * 72 / self.get_figure(root=True).dpi)


def _pad_faces(faces: Sequence[Array]) -> Array:
    """Return faces (F, n, 3) with equal numbers of corners, by repeating corners evenly.

    Without this, Matplotlib would pad faces of unequal size with uninitialised memory.
    """
    counts = np.array([len(face) for face in faces])
    return np.asarray(np.concatenate(faces)[_pad_corners(counts)])


def _pad_corners(counts: Indices) -> Indices:
    """Return the indices (F, n) of the corners of padded faces among all corners."""
    starts, most = np.cumsum(counts) - counts, int(counts.max())
    return np.asarray(starts[:, None] + np.arange(most) * counts[:, None] // most)


def _shade_faces(colors: Array, faces: FaceArrays) -> Array:
    """Return the colours (F, 3) of faces in the light of the lamp."""
    a, b, c = (faces.corners[faces.starts + i] for i in range(3))
    normals = np.cross(b - a, c - b)
    lengths = np.linalg.norm(normals, axis=1) * float(np.linalg.norm(LIGHT))
    cosines = normals @ LIGHT / np.where(lengths > 0, lengths, 1.0)
    return np.asarray((AMBIENT + (1 - AMBIENT) * np.maximum(cosines, 0.0))[:, None] * colors)


def draw_solids(axes: Axes3D, wires: Sequence[WireSolid]) -> list[MovableArtist]:
    """Draw solids as shaded faces; solids without faces as lines."""
    artists, dense = [], _list_opaque_solids(wires)
    if dense:
        solids = SolidFaces([wires[i] for i in dense])
        _add_unclipped_collection(axes, solids)
        artists.append(MovableArtist(solids, lambda now: solids.move([now[i] for i in dense])))
    for i, wire in enumerate(wires):
        if wire.transparent:
            look = {"facecolors": wire.color, "alpha": 0.1, "linewidths": 0, "zorder": TRANSPARENT}
            artists.append(_add_face_collection(axes, wire, i, look))
        if wire.transparent or not wire.faces:
            thick = 1.2 if wire.transparent else 3.0
            look = {"colors": wire.color, "linewidths": thick, "zorder": LINED, "label": wire.label}
            artists.append(_add_line_collection(axes, wires, i, look))
    return artists


def draw_shadows(axes: Axes3D, wires: Sequence[WireSolid], ground: float) -> list[MovableArtist]:
    """Draw the shadows of a lamp straight above, on ground at a height in metres."""
    artists, dense = [], _list_opaque_solids(wires)
    if dense:
        look = {"facecolors": SHADOW, "edgecolors": SHADOW, "linewidths": 0.5, "zorder": GROUNDED}
        artists.append(_add_shadow_collection(axes, [wires[i] for i in dense], dense, look, ground))
    look = {"colors": SHADOW, "linewidths": 3.0, "zorder": GROUNDED}
    lines = [i for i, wire in enumerate(wires) if not wire.faces]
    return [*artists, *(_add_line_collection(axes, wires, i, look, ground) for i in lines)]


def _list_opaque_solids(wires: Sequence[WireSolid]) -> list[int]:
    """Return the indices of the solids that have faces and are not transparent."""
    return [i for i, wire in enumerate(wires) if wire.faces and not wire.transparent]


def _project_to_ground(points: Array, ground: float | None) -> Array:
    """Return points (..., 3), projected down to the ground at a height in metres if given."""
    return points if ground is None else points * (1, 1, 0) + (0, 0, ground)


def draw_solid_outline(axes: Axes3D, wire: WireSolid, label: str, look: dict[str, Any]) -> Any:
    """Draw the edges of a solid with the line properties `look`; return the artist."""
    lines = Line3DCollection(wire.segments, **look, label=label)
    _add_unclipped_collection(axes, lines)
    return lines


def _add_shadow_collection(
    axes: Axes3D, solids: Sequence[WireSolid], indices: list[int], look: _Look, ground: float
) -> MovableArtist:
    """Add the shadows of solids on the ground."""
    shadows = ShadowOutlines(solids)

    def outlines(now: Sequence[WireSolid]) -> Array:
        """Return the outlines (N, n, 3) on the ground."""
        return _project_to_ground(_pad_faces(shadows.compute(now)), ground)

    collection = Poly3DCollection(outlines(solids), **look)
    _add_unclipped_collection(axes, collection)
    return MovableArtist(
        collection, lambda now: collection.set_verts(outlines([now[i] for i in indices]))
    )


def _add_face_collection(axes: Axes3D, solid: WireSolid, i: int, look: _Look) -> MovableArtist:
    """Add the faces of a solid, in the order of their centres."""
    collection = Poly3DCollection(_pad_faces(solid.faces), **look)
    _add_unclipped_collection(axes, collection)
    return MovableArtist(collection, lambda now: collection.set_verts(_pad_faces(now[i].faces)))


def _add_line_collection(
    axes: Axes3D, wires: Sequence[WireSolid], i: int, look: _Look, ground: float | None = None
) -> MovableArtist:
    """Add the edges of a solid, or their shadow on the ground."""
    lines = Line3DCollection(
        _project_to_ground(wires[i].segments, ground), capstyle="round", **look
    )
    _add_unclipped_collection(axes, lines)
    return MovableArtist(
        lines, lambda now: lines.set_segments(_project_to_ground(now[i].segments, ground))
    )


def _add_unclipped_collection(axes: Axes3D, collection: Any) -> None:
    """Add a collection that is not clipped at the axes."""
    axes.add_collection3d(collection, autolim=False)
    collection.set_clip_on(False)  # the box may be larger than its axes


def _choose_tints(color: str) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return the colours of the edges and the faces of a solid."""
    if color == palette.BLACK:
        return to_rgb(color), to_rgb(palette.tint_color(color, GREY))
    return to_rgb(palette.tint_color(color, -0.55)), to_rgb(palette.tint_color(color, PALE))
