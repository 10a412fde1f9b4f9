"""Solids as shaded faces, with their shadows on the ground."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d import Axes3D, proj3d  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection  # type: ignore[import-untyped]
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.plot import palette
from robsim.plot.face_order import FaceOrder, PaintedFaces, find_viewer
from robsim.plot.polygons import Indices, PolygonPool, expand_ranges, list_following
from robsim.plot.solid_shadows import ShadowOutlines
from robsim.plot.wireframe import WireSolid

LIGHT = np.array([0.35, -0.55, 1.1])  # towards the lamp, in the frame of the figures
AMBIENT = 0.62  # brightness of a face turned away from the lamp; 1 is full light
PALE, GREY = 0.25, 0.38  # shares of white in a face and in a black face, so that edges are visible
SHADOW = "#dcdcda"
GROUNDED, SHADED, LINED, TRANSPARENT = 1, 4, 5, 6  # z-order of the artists
_Look = dict[str, Any]  # properties of an artist


@dataclass(frozen=True)
class MovableArtist:
    """An artist in 3-D axes, and a function that moves it to new positions of the same solids."""

    artist: Any
    move: Callable[[Sequence[WireSolid]], None]


class SolidFaces(Poly3DCollection):  # type: ignore[misc]
    """The faces of several solids, painted from the farthest to the nearest.

    `labels` are the labels of the faces. `FaceOrder` returns their order for the view of the axes.
    """

    _order: FaceOrder | None = None
    _viewer: Array
    _painted: PaintedFaces

    def __init__(self, wires: Sequence[WireSolid]) -> None:
        faces = [(wire, i) for wire in wires for i in range(len(wire.faces))]
        self.labels = [wire.label for wire, _ in faces]
        self._has_border = np.array([wire.has_border[i] for wire, i in faces], dtype=bool)
        self._pool = PolygonPool()
        dark, self._pale = np.array([_choose_tints(wire.color) for wire, _ in faces]).swapaxes(0, 1)
        self._edges = np.pad(dark, ((0, 0), (0, 1)), constant_values=1.0)  # opaque
        super().__init__([], linewidths=0.6, zorder=SHADED)
        self.move(wires)

    def move(self, wires: Sequence[WireSolid]) -> None:
        """Move the faces to new poses of the same solids, and shade them for these poses."""
        faces = [face for wire in wires for face in wire.faces]
        self.set_verts(_pad_faces(faces))
        self.set_facecolor(shade_faces(self._pale, faces))
        self._order = FaceOrder([wire.faces for wire in wires], self._order)
        self._viewer = np.zeros(4)

    def do_3d_projection(self) -> float:
        """Project the faces onto the paper in the order of the painter; return the least depth."""
        viewer = find_viewer(self.axes.M)
        assert self._order is not None
        if not np.array_equal(viewer, self._viewer):
            self._viewer, self._painted = viewer, self._order.arrange(viewer)
        x, y, depth = proj3d.proj_transform(*self._painted.corners.T, self.axes.M)
        parts = self._list_painted_parts()
        self._paths = self._pool.build(np.column_stack([x, y])[parts.corners], parts.counts)
        fills, dark = self._facecolor3d[parts.sources], self._edges[parts.sources]
        self._facecolors2d = np.where(parts.is_line[:, None], dark, fills)
        self._edgecolors2d = np.where(parts.is_lined[:, None], dark, fills)
        return float(np.min(depth))

    def _list_painted_parts(self) -> _PaintedParts:
        """Return the faces of each group, and then the sides of its cut faces as lines."""
        painted = self._painted
        ends = np.cumsum(painted.counts)
        starts, bordered = ends - painted.counts, self._has_border[painted.sources]
        whole = bordered & np.logical_and.reduceat(painted.is_side, starts)
        part = np.repeat(np.arange(len(starts)), painted.counts)  # of each corner
        side = np.flatnonzero(painted.is_side & (bordered & ~whole)[part])
        following = list_following(starts, painted.counts)
        owner = np.concatenate([np.arange(len(starts)), part[side]])
        is_line = np.arange(len(owner)) >= len(starts)
        order = np.argsort(2 * painted.groups[owner] + is_line, kind="stable")
        lines = np.column_stack([side, following[side]]).ravel()
        counts = np.concatenate([painted.counts, np.full(len(side), 2)])
        first = np.concatenate([starts, len(part) + 2 * np.arange(len(side))])
        corners = np.concatenate([np.arange(len(part)), lines])
        return _PaintedParts(
            corners[expand_ranges(first[order], counts[order])],
            counts[order],
            painted.sources[owner[order]],
            is_line[order],
            (whole[owner] | is_line)[order],
        )


class _PaintedParts(NamedTuple):
    """Faces and lines in the order of painting: their corners among those of all faces.

    `counts` are the numbers of corners of the parts, `sources` the indices of their faces, and
    `is_lined` is true for lines and for faces with a dark edge.
    """

    corners: Indices
    counts: Indices
    sources: Indices
    is_line: NDArray[np.bool_]
    is_lined: NDArray[np.bool_]


def _pad_faces(faces: Sequence[Array]) -> Array:
    """Return faces (F, n, 3) with equal numbers of corners, by repeating corners evenly.

    Without this, Matplotlib would pad faces of unequal size with uninitialised memory.
    """
    counts = np.array([len(face) for face in faces])
    starts, most = np.cumsum(counts) - counts, int(counts.max())
    corners: Array = np.concatenate(faces)[
        starts[:, None] + np.arange(most) * counts[:, None] // most
    ]
    return corners


def shade_faces(colors: Array, faces: Sequence[Array]) -> Array:
    """Return the colours (F, 3) of faces, each (n, 3), in the light of the lamp."""
    counts = np.array([len(face) for face in faces])
    points, starts = np.concatenate(faces), np.cumsum(counts) - counts
    a, b, c = (points[starts + i] for i in range(3))
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
