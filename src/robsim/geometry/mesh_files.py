"""Mesh files as surfaces to draw, read by trimesh: the extra `mesh`.

A mesh file is untrusted data: its size is looked at before it is read, no other file that it names
is opened, and what is wrong with it is told in one line.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import FileError, format_value

SUFFIXES = (".stl", ".obj", ".dae", ".glb")
LARGEST_FILE = 50_000_000  # bytes
MOST_TRIANGLES = 1_000_000  # in a file
DRAWN_TRIANGLES = 3000  # triangles of a mesh that is drawn, about
AGGRESSIVENESS = (
    2.0,
    5.0,
    7.0,
    7.0,
)  # of passes, until there are few enough: the first keeps the form best
MOST_COLORS = 8
LARGEST_COORDINATE = 1e6  # metres
SHARP_ANGLE = np.radians(30)  # angle between triangles from which an edge is drawn
ENCODINGS = "utf-8", "us-ascii", "ascii", "iso-8859-1"  # that a COLLADA file may declare
_ENCODING = re.compile(rb"encoding\s*=\s*[\"']([ -~]*?)[\"']")
CACHED_MESHES = 128  # files in memory, at most


class ColoredMesh(NamedTuple):
    """Triangles of one colour, with the edges where they bend."""

    points: Array  # (P, 3), metres
    triangles: Any  # (F, 3) numbers of points
    sharp: Any  # (E, 2)
    color: str | None  # "#rrggbb" if the file gives one


def load_mesh(path: Path) -> tuple[ColoredMesh, ...]:
    """Return a mesh file as few triangles as show its form, by colour.

    FileError: it cannot be read, is too large, or is not a mesh; or the extra is not installed.
    """
    try:
        stat = path.stat()
    except OSError as error:
        raise FileError(f"cannot be read: {error.strerror}") from None
    if path.suffix.lower() not in SUFFIXES:
        raise FileError(f"no format of {', '.join(SUFFIXES)}")
    if stat.st_size > LARGEST_FILE:
        raise FileError(f"larger than {LARGEST_FILE // 1_000_000} MB")
    found = _parse_mesh_file(path, stat.st_mtime_ns, stat.st_size)
    if isinstance(found, str):
        raise FileError(found)
    return found


@lru_cache(CACHED_MESHES)
def _parse_mesh_file(path: Path, changed: int, size: int) -> tuple[ColoredMesh, ...] | str:
    """Return the pieces of a file as it was when it changed, or what is wrong with it."""
    try:
        import fast_simplification
        import trimesh
    except ImportError:
        return "trimesh is not installed: pip install 'robsim[mesh]'"
    try:
        data = path.read_bytes()[: LARGEST_FILE + 1]
        _check_collada_text(path, data)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            whole = _group_by_color(_read_scene_meshes(trimesh, path, data))
            share = DRAWN_TRIANGLES / sum(len(triangles) for _, triangles, _ in whole)
            return tuple(
                _make_colored_mesh(
                    trimesh, *_simplify_mesh(fast_simplification, points, triangles, share), color
                )
                for points, triangles, color in whole
            )
    except FileError as error:
        return str(error)
    except Exception as error:  # noqa: BLE001  # whatever a library makes of a wrong file
        return f"not readable: {type(error).__name__}: {format_value(str(error))}"


def _check_collada_text(path: Path, data: bytes) -> None:
    """Raise FileError for XML that defines entities, which could name files or multiply."""
    if path.suffix.lower() != ".dae":
        return
    encoding = _ENCODING.search(data[:200])
    known = encoding is None or encoding[1].decode().lower() in ENCODINGS
    if not known or b"\0" in data[:64] or b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise FileError("not readable: a DOCTYPE, or an encoding that is not allowed")


def _read_scene_meshes(
    trimesh: Any, path: Path, data: bytes
) -> list[tuple[Array, Any, str | None]]:
    """Return points in metres, triangles and colour of each geometry, where its file places it."""
    kind = path.suffix.lower()[1:]
    scene = trimesh.load_scene(io.BytesIO(data), file_type=kind, process=False)
    graph, shapes = scene.graph, scene.geometry
    nodes = [(name, *graph[name]) for name in graph.nodes_geometry]
    solid = [(T, shapes[key]) for _, T, key in nodes if hasattr(shapes[key], "faces")]
    if sum(len(each.faces) for _, each in solid) > MOST_TRIANGLES:
        raise FileError(f"more than {MOST_TRIANGLES} triangles")
    found = [_place_scene_mesh(each, T, kind) for T, each in solid]
    if not any(len(triangles) for _, triangles, _ in found):
        raise FileError("no triangles")
    return [each for each in found if len(each[1])]


def _place_scene_mesh(mesh: Any, T: Array, kind: str) -> tuple[Array, Any, str | None]:
    """Return what a mesh has, in the axes of its file; FileError: numbers that make no sense."""
    points, triangles = np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces)
    if len(triangles) and not 0 <= triangles.min() <= triangles.max() < len(points):
        raise FileError("triangles of points that it does not have")
    placed = (points @ T[:3, :3].T + T[:3, 3]) * _find_length_unit(mesh, kind)
    if not (np.abs(placed) <= LARGEST_COORDINATE).all():
        raise FileError(f"points that are not finite, or beyond {LARGEST_COORDINATE:g} m")
    return placed, triangles, _find_mesh_color(mesh)


def _find_length_unit(mesh: Any, kind: str) -> float:
    """Return the metres of a unit of length, which only COLLADA files tell."""
    told = str(mesh.metadata.get("units", "")) if kind == "dae" else ""
    return float(told.partition(" * ")[0]) if " * meters" in told else 1.0


def _find_mesh_color(mesh: Any) -> str | None:
    """Return the main colour of a mesh whose file gives it one."""
    visual = mesh.visual
    if not visual.defined:
        return None
    material = getattr(visual, "material", None)
    rgba = np.asarray(visual.main_color if material is None else material.main_color)
    return "#" + "".join(f"{int(part):02x}" for part in rgba[:3])


def _group_by_color(
    parts: Iterable[tuple[Array, Any, str | None]],
) -> list[tuple[Array, Any, str | None]]:
    """Return the parts with those of one colour joined; of many colours, all are joined."""
    groups: dict[str | None, list[tuple[Array, Any]]] = {}
    for points, triangles, color in parts:
        rare = len(groups) >= MOST_COLORS and color not in groups
        groups.setdefault(next(iter(groups)) if rare else color, []).append((points, triangles))
    return [(*_merge_meshes(group), color) for color, group in groups.items()]


def _merge_meshes(parts: list[tuple[Array, Any]]) -> tuple[Array, Any]:
    """Return the points, each once, and the triangles of several parts."""
    starts = np.cumsum([0, *(len(points) for points, _ in parts[:-1])])
    triangles = np.concatenate([t + s for (_, t), s in zip(parts, starts, strict=True)])
    corners = np.concatenate([points for points, _ in parts])
    order = np.lexsort(corners.T)
    ranked = corners[order]
    new = np.r_[True, (ranked[1:] != ranked[:-1]).any(axis=1)]
    number = np.empty(len(corners), dtype=np.int64)
    number[order] = np.cumsum(new) - 1
    points, found = ranked[new], number[triangles]
    flat = (found == np.roll(found, 1, axis=1)).any(axis=1)
    return points, found[~flat]


def _simplify_mesh(library: Any, points: Array, triangles: Any, share: float) -> tuple[Array, Any]:
    """Return a surface of a share of the triangles, and at least a few."""
    target = max(round(share * len(triangles)), 40)
    for haste in AGGRESSIVENESS:
        if len(triangles) <= 1.1 * target:
            break
        fewer, faces = library.simplify(
            points.astype(np.float32), triangles.astype(np.int32), target_count=target, agg=haste
        )
        if len(faces) and np.isfinite(fewer).all():
            points, triangles = fewer.astype(float), faces
    return points, triangles


def _make_colored_mesh(
    trimesh: Any, points: Array, triangles: Any, color: str | None
) -> ColoredMesh:
    mesh = trimesh.Trimesh(points, triangles, process=False)
    bent = mesh.face_adjacency_edges[mesh.face_adjacency_angles > SHARP_ANGLE]
    return ColoredMesh(points, triangles, np.sort(bent, axis=1).reshape(-1, 2), color)
