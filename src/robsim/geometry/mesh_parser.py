"""Parsing of mesh files by trimesh (the extra `mesh`), and simplification for figures.

A mesh file is untrusted data. `robsim.geometry.mesh_process` parses it in a process with limits of
time and memory, because a small file can describe a scene of a billion triangles. No other file
that it names is opened, and every error is reported in one line.
"""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import FileError, format_value
from robsim.base.file_content import read_bytes
from robsim.base.xml_elements import check_plain_xml

LARGEST_FILE = 50_000_000  # bytes
MOST_TRIANGLES = 1_000_000  # in a file
DRAWN_TRIANGLES = 3000  # approximate number of triangles in figures
# aggressiveness of each pass of simplification; a low value preserves the shape best
AGGRESSIVENESS = (2.0, 5.0, 7.0, 7.0)
MOST_COLORS = 8
LARGEST_COORDINATE = 1e6  # metres
SHARP_ANGLE = np.radians(30)  # an edge is drawn if its two triangles meet at a larger angle
Indices = NDArray[np.integer]


class ColoredMesh(NamedTuple):
    """Triangles of one colour, with the sharp edges between them."""

    points: Array  # (P, 3), metres
    triangles: Indices  # (F, 3) of points
    sharp: Indices  # (E, 2) of points
    color: str | None  # "#rrggbb", or None if the file has no colour


def parse_mesh_file(path: Path) -> tuple[ColoredMesh, ...]:
    """Return the simplified triangles of a mesh file, grouped by colour.

    Raise FileError if the file is not a mesh, or is too large. Libraries may need any time and
    memory for a hostile file.
    """
    import fast_simplification
    import trimesh

    try:
        data = read_bytes(path, "a mesh", LARGEST_FILE)
        if path.suffix.lower() == ".dae":
            check_plain_xml(data, path.name)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            whole = _group_by_color(_read_scene_meshes(trimesh, path, data))
            count = sum(len(triangles) for _, triangles, _ in whole)
            if not count:
                raise FileError("no triangles with an area")
            share = DRAWN_TRIANGLES / count
            return tuple(
                _make_colored_mesh(
                    trimesh, *_simplify_mesh(fast_simplification, points, triangles, share), color
                )
                for points, triangles, color in whole
            )
    except MemoryError:
        raise FileError("not readable: it needs more memory than its size allows") from None
    except FileError as error:
        raise FileError(str(error).removeprefix(f"{path}: ")) from None
    except Exception as error:  # noqa: BLE001  a library may raise anything for a wrong file
        reason = f"{type(error).__name__}: {format_value(str(error))}"
        raise FileError(f"not readable: {reason}") from None


def _read_scene_meshes(
    trimesh: Any, path: Path, data: bytes
) -> list[tuple[Array, Indices, str | None]]:
    """Return points in metres, triangles and colour of each geometry, in the frame of the scene."""
    kind = path.suffix.lower()[1:]
    scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False)
    graph, shapes = scene.graph, scene.geometry
    nodes = [(name, *graph[name]) for name in graph.nodes_geometry]
    meshes = [(T, shapes[key]) for _, T, key in nodes if hasattr(shapes[key], "faces")]
    if sum(len(each.faces) for _, each in meshes) > MOST_TRIANGLES:
        raise FileError(f"more than {MOST_TRIANGLES} triangles")
    placed = [_place_scene_mesh(each, T, kind) for T, each in meshes]
    if not any(len(triangles) for _, triangles, _ in placed):
        raise FileError("no triangles")
    return [each for each in placed if len(each[1])]


def _place_scene_mesh(mesh: Any, T: Array, kind: str) -> tuple[Array, Indices, str | None]:
    """Return points in metres, triangles and colour of a mesh at its pose T in the scene.

    Raise FileError if indices or coordinates are not valid.
    """
    points, triangles = np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces)
    if len(triangles) and not 0 <= triangles.min() <= triangles.max() < len(points):
        raise FileError("triangles refer to points that do not exist")
    placed = (points @ T[:3, :3].T + T[:3, 3]) * _find_length_unit(mesh, kind)
    if not (np.abs(placed) <= LARGEST_COORDINATE).all():
        raise FileError(f"points that are not finite, or beyond {LARGEST_COORDINATE:g} m")
    return placed, triangles, _find_mesh_color(mesh)


def _find_length_unit(mesh: Any, kind: str) -> float:
    """Return the length of the file's unit in metres, which only COLLADA files define."""
    units = str(mesh.metadata.get("units", "")) if kind == "dae" else ""
    return float(units.partition(" * ")[0]) if " * meters" in units else 1.0


def _find_mesh_color(mesh: Any) -> str | None:
    """Return the main colour of a mesh as "#rrggbb", or None if the file has none."""
    visual = mesh.visual
    if not visual.defined:
        return None
    material = getattr(visual, "material", None)
    rgba = np.asarray(visual.main_color if material is None else material.main_color)
    return "#" + "".join(f"{int(part):02x}" for part in rgba[:3])


def _group_by_color(
    parts: Iterable[tuple[Array, Indices, str | None]],
) -> list[tuple[Array, Indices, str | None]]:
    """Return the parts merged by colour; further colours beyond the limit join the first group."""
    groups: dict[str | None, list[tuple[Array, Indices]]] = {}
    for points, triangles, color in parts:
        is_excess = len(groups) >= MOST_COLORS and color not in groups
        groups.setdefault(next(iter(groups)) if is_excess else color, []).append(
            (points, triangles)
        )
    return [(*_merge_meshes(group), color) for color, group in groups.items()]


def _merge_meshes(parts: list[tuple[Array, Indices]]) -> tuple[Array, Indices]:
    """Return the distinct points and the triangles of several parts, without flat triangles."""
    starts = np.cumsum([0, *(len(points) for points, _ in parts[:-1])])
    triangles = np.concatenate([t + s for (_, t), s in zip(parts, starts, strict=True)])
    corners = np.concatenate([points for points, _ in parts])
    order = np.lexsort(corners.T)
    ranked = corners[order]
    is_first = np.r_[True, (ranked[1:] != ranked[:-1]).any(axis=1)]
    index = np.empty(len(corners), dtype=np.int64)
    index[order] = np.cumsum(is_first) - 1
    points, merged = ranked[is_first], index[triangles]
    is_degenerate = (merged == np.roll(merged, 1, axis=1)).any(axis=1)
    return points, merged[~is_degenerate]


def _simplify_mesh(
    library: Any, points: Array, triangles: Indices, share: float
) -> tuple[Array, Indices]:
    """Return the surface simplified to about this share of its triangles, but at least 40."""
    target = max(round(share * len(triangles)), 40)
    for aggressiveness in AGGRESSIVENESS:
        if len(triangles) <= 1.1 * target:
            break
        vertices, faces = library.simplify(
            points.astype(np.float32),
            triangles.astype(np.int32),
            target_count=target,
            agg=aggressiveness,
        )
        if len(faces) and np.isfinite(vertices).all():
            points, triangles = vertices.astype(float), faces
    return points, triangles


def _make_colored_mesh(
    trimesh: Any, points: Array, triangles: Indices, color: str | None
) -> ColoredMesh:
    """Return the triangles of one colour with their sharp edges."""
    mesh = trimesh.Trimesh(points, triangles, process=False)
    sharp = mesh.face_adjacency_edges[mesh.face_adjacency_angles > SHARP_ANGLE]
    return ColoredMesh(points, triangles, np.sort(sharp, axis=1).reshape(-1, 2), color)
