"""Common faults in the data of a calibration, each with the views that a user meant to give."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.calibration.calibration_model import predict_pixels, single_joints
from robsim.calibration.calibration_views import CalibrationViews
from robsim.calibration.closed_form import TargetPoses, estimate_first_model, estimate_target_poses
from robsim.calibration.relative_motions import FEWEST
from robsim.geometry.pose import Pose

POSE_UNITS = ("m", "m", "m", "1", "1", "1", "1")  # of the coordinates of a floating joint
TRIPLES = 50  # of views, for the least median of squares
Rows = slice | NDArray[np.int64]  # views


class ViewFault(NamedTuple):
    """A fault of a user, and the repaired views."""

    repair: str  # plural noun of the repaired data, for "... give 0.2 px"
    views: CalibrationViews
    poses: TargetPoses | None  # of the repaired views, None if the fault changes them


def list_view_faults(views: CalibrationViews) -> Iterator[Iterator[ViewFault]]:
    """Yield the faults of each kind: of images, of joints, and of single views."""
    poses = estimate_target_poses(views, views.lens)
    yield list_image_faults(views)
    yield list_joint_faults(views, poses)
    yield list_pairing_faults(views, poses)


def list_image_faults(views: CalibrationViews) -> Iterator[ViewFault]:
    """Yield faults of the pixels and of the order of the marks."""
    pixels, marks = views.pixels, views.thing.marks
    named = {"pixels in the order (row, column)": pixels[..., ::-1]}
    if views.lens.size is not None:
        width, height = views.lens.size
        named["rows counted from the bottom"] = np.array([0, height - 1]) + pixels * [1, -1]
        named["columns counted from the right"] = np.array([width - 1, 0]) + pixels * [-1, 1]
    yield from _repairs(named, lambda value: replace(views, pixels=value))
    orders = {"marks with x and y swapped": marks[:, [1, 0, 2]], **_mark_orders(marks)}
    yield from _repairs(orders, lambda value: _with_marks(views, value))


def list_joint_faults(views: CalibrationViews, poses: TargetPoses) -> Iterator[ViewFault]:
    """Yield faults of the coordinates: units, signs, order, poses and their quaternions."""
    q, names = views.q, views.scene.coordinate_names
    single = dict(single_joints(views))
    angles = [i for i in single.values() if views.scene.coordinate_units[i] == "rad"]
    named = {
        "joints converted from degrees": _converted(q, angles, np.pi / 180),
        "joints converted to degrees": _converted(q, angles, 180 / np.pi),
    }
    for name, i in single.items():
        named[f"opposite signs of joint '{name}'"] = _converted(q, [i], -1.0)
    for i, j in combinations(single.values(), 2):
        order = np.arange(q.shape[1])
        order[[i, j]] = j, i
        named[f"joints '{names[i]}' and '{names[j]}' in each other's place"] = q[:, order]
    named["all joints in reverse order"] = _reversed(q, list(single.values()))
    named["opposite signs of all joints"] = _converted(q, list(single.values()), -1.0)
    for first in _floating_joints(views):
        named.update(_pose_repairs(q, first))
    yield from _repairs(named, lambda value: replace(views, q=value), poses)


def list_pairing_faults(views: CalibrationViews, poses: TargetPoses) -> Iterator[ViewFault]:
    """Yield faults of single views, and of the pairing of views with joints."""
    count = len(views)
    if count <= FEWEST:
        return
    early, late = slice(None, -1), slice(1, None)
    yield _paired(views, poses, "joints of the next view", late, early)
    yield _paired(views, poses, "joints of the previous view", early, late)
    for view in range(count):
        yield _without(views, poses, [view])
    if some := _find_wrong_views(views, poses):
        yield _without(views, poses, some)


def _paired(
    views: CalibrationViews, poses: TargetPoses, repair: str, rows: Rows, images: Rows
) -> ViewFault:
    """Return the fault with a selection of coordinates and a selection of images."""
    paired = replace(views, q=views.q[rows], pixels=views.pixels[images])
    return ViewFault(repair, paired, poses.select(images))


def _without(views: CalibrationViews, poses: TargetPoses, some: list[int]) -> ViewFault:
    """Return the fault of some wrong views, which are left out."""
    rest = np.delete(np.arange(len(views)), some)
    which = f"view {some[0]}" if len(some) == 1 else "views " + " and ".join(map(str, sorted(some)))
    return _paired(views, poses, f"all views but {which}", rest, rest)


def _find_wrong_views(views: CalibrationViews, poses: TargetPoses) -> list[int]:
    """Return several views with larger errors than all others, at most a quarter of all views.

    The errors are from the closed-form mount of three views with the least median error of all
    views (least median of squares: Rousseeuw 1984), of some random triples. The largest ratio of
    consecutive errors separates the wrong views.
    """
    count = len(views)
    random = np.random.default_rng(0)
    best = np.full(count, np.inf)
    for _ in range(TRIPLES):
        three = np.sort(random.permutation(count)[:3])
        errors = _errors_of_views(views, poses, three)
        if np.median(errors) < np.median(best):
            best = errors
    order = np.argsort(-best)
    counts = np.arange(2, count // 4 + 1)
    if not counts.size or not np.isfinite(best).all():
        return []
    ratio = best[order[counts - 1]] / best[order[counts]]
    wrong: list[int] = order[: counts[np.argmax(ratio)]].tolist()
    return wrong


def _errors_of_views(views: CalibrationViews, poses: TargetPoses, three: Rows) -> Array:
    """Return the mean square error (V,) of each view for the mount from three views."""
    try:
        chosen = replace(views, q=views.q[three], pixels=views.pixels[three])
        model = estimate_first_model(chosen, poses=poses.select(three))
    except (InputError, np.linalg.LinAlgError):
        return np.full(len(views), np.inf)
    off = predict_pixels(model, views.thing.marks, views.chain, views.q) - views.pixels
    squares = np.square(np.where(views.seen[..., None], off, 0.0)).sum(axis=(1, 2))
    return np.asarray(np.nan_to_num(squares / views.seen.sum(axis=1), nan=np.inf))


def _repairs(
    named: Mapping[str, Array],
    build: Callable[[Array], CalibrationViews],
    poses: TargetPoses | None = None,
) -> Iterator[ViewFault]:
    """Yield the repairs that are possible: pixels in the image and joints within their limits."""
    for repair, value in named.items():
        try:
            yield ViewFault(repair, build(value), poses)
        except InputError:
            continue


def _with_marks(views: CalibrationViews, marks: Array) -> CalibrationViews:
    """Return the views of a target with other marks."""
    return replace(views, scene=views.scene.replacing(replace(views.thing, marks=marks)))


def _mark_orders(marks: Array) -> dict[str, Array]:
    """Return the marks in the orders in which programs list the marks of a grid."""
    x, y = marks[:, 0].round(9), marks[:, 1].round(9)
    orders = {
        "marks in the order of columns": np.lexsort([y, x]),
        "marks in the order of rows": np.lexsort([x, y]),
        "marks in rows from right to left": np.lexsort([-x, y]),
        "marks in columns from top to bottom": np.lexsort([-y, x]),
        "marks in reverse order": np.arange(len(marks))[::-1],
    }
    named = {}
    columns, rows = len(np.unique(x)), len(np.unique(y))
    grid = marks[np.lexsort([x, y])]
    if columns != rows and columns * rows == len(marks) and np.array_equal(grid, marks):
        pitch = np.array([np.ptp(x) / max(columns - 1, 1), np.ptp(y) / max(rows - 1, 1), 0.0])
        index = np.arange(len(marks))
        turned = np.stack([index % rows, index // rows, 0 * index], axis=1) * pitch
        named[f"marks in {rows} columns and {columns} rows"] = marks[0] + turned
    named.update((name, marks[order]) for name, order in orders.items())
    return {name: value for name, value in named.items() if not np.array_equal(value, marks)}


def _converted(q: Array, indices: list[int], factor: float) -> Array:
    """Return coordinates with some of them multiplied by a factor."""
    changed = q.copy()
    changed[:, indices] *= factor
    return changed


def _reversed(q: Array, indices: list[int]) -> Array:
    """Return coordinates with some of them in reverse order."""
    changed = q.copy()
    changed[:, indices] = q[:, indices[::-1]]
    return changed


def _floating_joints(views: CalibrationViews) -> Iterator[int]:
    """Yield the index of the first coordinate of each floating joint."""
    units = views.scene.coordinate_units
    yield from (i for i in range(len(units) - 6) if units[i : i + 7] == POSE_UNITS)


def _pose_repairs(q: Array, first: int) -> dict[str, Array]:
    """Return coordinates with the poses of a floating joint repaired."""
    position, turn = q[:, first : first + 3], q[:, first + 3 : first + 7]
    inverse = Pose.from_quaternion(position, turn).inv()
    poses = {
        "quaternions read as (w, x, y, z)": (position, np.roll(turn, -1, axis=1)),
        "inverse poses": (inverse.position, inverse.quaternion),
        "inverse rotations": (position, turn * [-1, -1, -1, 1]),
    }
    return {name: _with_pose(q, first, *pose) for name, pose in poses.items()}


def _with_pose(q: Array, first: int, position: Array, turn: Array) -> Array:
    """Return coordinates with another position and quaternion of a floating joint."""
    changed = q.copy()
    changed[:, first : first + 7] = np.concatenate([position, turn], axis=1)
    return changed
