"""Hypotheses on cameras and targets: mount, lens, pose and size of the target, order of pixels."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations, permutations

import numpy as np

from robsim.analysis.explanation.text_format import format_list, format_number
from robsim.analysis.log_faults.hypothesis import Hypothesis
from robsim.analysis.log_faults.image_comparison import ImageComparison
from robsim.analysis.log_faults.log_images import ImageSeries
from robsim.analysis.log_faults.value_text import format_change, format_interval
from robsim.base.arrays import Array
from robsim.geometry.pose import Pose

TWIST = ("x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad")
FITTED = 4  # coefficients of the distortion that a hypothesis estimates
ALL_ORDERS = 4  # marks of which every order is tried; of more, exchanged pairs only
AXES = {  # exchanged axes, reversed columns, reversed rows: the fault
    (True, False, False): "has its columns and rows swapped",
    (False, True, False): "has its columns reversed (a mirrored image)",
    (False, False, True): "has its rows reversed (a mirrored image)",
    (False, True, True): "is turned by 180 degrees",
    (True, True, False): "is turned by 90 degrees",
    (True, False, True): "is turned by -90 degrees",
    (True, True, True): "has its columns and rows swapped and reversed",
}


def list_camera_hypotheses(images: ImageComparison, camera: str) -> Iterator[Hypothesis]:
    """Yield the hypotheses on a camera: its mount, its lens and the axes of its pixels."""
    series = images.find(camera)
    base = _describe_base(series.sight.eye.on, series.sight.target.on)

    def mount(one: ImageSeries, twist: Array) -> Array:
        return one.predict(mount=one.sight.eye.pose @ Pose.exp(twist))

    def describe(twist: Array, half: Array) -> str:
        return f"the mount of '{camera}'{base} is {format_change(twist, half)}"

    path = f"cameras.{camera}.position, cameras.{camera}.rotvec"
    yield images.make("mount", mount, describe, camera, camera, names=TWIST, path=path)
    yield from _list_lens_hypotheses(images, camera)
    for axes, fault in AXES.items():
        yield images.make(
            "swapped axes",
            _change_axes(axes),
            _state(f"the image of '{camera}' {fault}"),
            camera,
            camera,
            cost=1,
        )


def _list_lens_hypotheses(images: ImageComparison, camera: str) -> Iterator[Hypothesis]:
    """Yield the hypotheses on the intrinsics of a camera."""
    yield from _list_focal_hypotheses(images, camera)

    def shift(one: ImageSeries, values: Array) -> Array:
        return one.pixels_of_scene + values

    def describe(values: Array, half: Array) -> str:
        column, row = (format_interval(x, d) for x, d in zip(values, half, strict=True))
        return f"the principal point of '{camera}' is off by ({column}, {row}) px"

    names, path = ("column", "row"), f"cameras.{camera}.center"
    only = camera, camera
    yield images.make("principal point", shift, describe, *only, names=names, path=path)
    yield _make_distortion(images, camera)


def _list_focal_hypotheses(images: ImageComparison, camera: str) -> Iterator[Hypothesis]:
    """Yield the hypotheses that the focal length is wrong, and that both are wrong separately.

    A focal length acts about the principal point on pixels, after the distortion.
    """
    K = images.find(camera).camera.K
    focal, center = np.array([K[0, 0], K[1, 1]]), np.array(K[:2, 2])

    def scale(one: ImageSeries, values: Array) -> Array:
        return center + values * (one.pixels_of_scene - center)

    def describe(values: Array, half: Array) -> str:
        factors = [format_interval(x, d) for x, d in zip(values, half, strict=True)]
        pixels = " by ".join(dict.fromkeys(map(format_number, focal * values)))
        factor = " and ".join(factors)
        return (
            f"the focal length of '{camera}' is {factor} times the length in the scene: {pixels} px"
        )

    for names in (("factor",), ("factor_x", "factor_y")):
        starts, path = [(1.0,) * len(names)], f"cameras.{camera}.focal"
        common = "focal length", scale, describe, camera, camera, names, starts
        yield images.make(*common, path=path)


def _make_distortion(images: ImageComparison, camera: str) -> Hypothesis:
    """Return the hypothesis that the first four coefficients of the distortion are wrong."""
    lens = images.find(camera).camera
    names, known = lens.model.names[:FITTED], np.zeros(max(len(lens.distortion), FITTED))
    known[: len(lens.distortion)] = lens.distortion

    def bend(one: ImageSeries, values: Array) -> Array:
        changed = np.concatenate([values, known[FITTED:]])
        return one.predict(camera=replace(lens, distortion=tuple(changed.tolist())))

    def describe(values: Array, half: Array) -> str:
        each = zip(names, values, half, strict=True)
        numbers = ", ".join(f"{name} {format_interval(x, d)}" for name, x, d in each)
        return f"the distortion of '{camera}' is {numbers}"

    starts, path = [tuple(known[:FITTED].tolist())], f"cameras.{camera}.distortion"
    common = "distortion", bend, describe, camera, camera, names, starts
    return images.make(*common, path=path)


def list_target_hypotheses(images: ImageComparison, target: str) -> Iterator[Hypothesis]:
    """Yield the hypotheses on a target: its pose, its size and the order of its marks."""
    sight, only = images.find(target).sight, (target, target)
    marks, base = sight.target.marks, _describe_base(sight.target.on, sight.eye.on)

    def place(one: ImageSeries, twist: Array) -> Array:
        return one.predict(place=one.sight.target.pose @ Pose.exp(twist))

    def describe(twist: Array, half: Array) -> str:
        return f"'{target}'{base} is {format_change(twist, half)}"

    def grow(one: ImageSeries, values: Array) -> Array:
        return one.predict(marks=values * marks)

    def describe_size(values: Array, half: Array) -> str:
        return f"the marks of '{target}' are {format_interval(values[0], half[0])} times as large"

    path = f"objects.{target}.position, objects.{target}.rotvec"
    yield images.make("target pose", place, describe, *only, names=TWIST, path=path)
    yield from _list_target_moves(images, target)
    yield images.make("target size", grow, describe_size, *only, ("factor",), [(1.0,)])
    for i, j in _list_column_pairs(len(marks)):
        one, other = (f"pixels[{k // 2},{('column', 'row')[k % 2]}]" for k in (i, j))
        text = f"the columns {one} and {other} of '{target}' are swapped"
        yield images.make("swapped pixels", _swap_pixels(i, j), _state(text), *only, cost=1)
    for order in _list_orders(len(marks)):
        text = f"the marks of '{target}' have the order {format_list([str(i) for i in order])}"
        yield images.make("swapped marks", _change_order(order), _state(text), *only, cost=1)


def _list_target_moves(images: ImageComparison, target: str) -> Iterator[Hypothesis]:
    """Yield the hypothesis that the target moves at the time of the largest jump of the marks."""
    series = images.find(target)
    offsets = np.nan_to_num(series.pixels - series.pixels_of_scene)
    jumps = np.abs(np.diff(offsets, axis=0)).max(axis=(1, 2), initial=0.0)
    if not len(jumps):
        return
    begin = series.times[1 + int(np.argmax(jumps))]

    def move(one: ImageSeries, twist: Array) -> Array:
        moves = np.broadcast_to(np.eye(4), (len(one.times), 4, 4)).copy()
        moves[one.times >= begin] = Pose.exp(twist).matrix
        return one.predict(place=one.sight.target.pose @ Pose(moves))

    def describe(twist: Array, half: Array) -> str:
        return f"'{target}' is {format_change(twist, half)} after {format_number(begin)} s"

    yield images.make("target moved", move, describe, target, target, names=TWIST, cost=1)


def _change_axes(axes: tuple[bool, bool, bool]) -> Callable[[ImageSeries, Array], Array]:
    """Return the change of the predicted pixels by exchanged or reversed axes."""

    def change(one: ImageSeries, values: Array) -> Array:
        lens, pixels = one.camera, one.pixels_of_scene
        last = 2.0 * lens.K[:2, 2] if lens.size is None else np.array(lens.size) - 1.0
        if axes[0]:
            pixels, last = pixels[..., ::-1], last[::-1]
        return np.where(axes[1:], last - pixels, pixels)

    return change


def _change_order(order: tuple[int, ...]) -> Callable[[ImageSeries, Array], Array]:
    """Return the change of the predicted pixels by another order of the marks."""
    return lambda one, values: one.pixels_of_scene[:, list(order)]


def _swap_pixels(i: int, j: int) -> Callable[[ImageSeries, Array], Array]:
    """Return the change of the predicted pixels by two swapped columns of a table."""

    def change(one: ImageSeries, values: Array) -> Array:
        flat = one.pixels_of_scene.reshape(len(one.times), -1).copy()
        flat[:, [i, j]] = flat[:, [j, i]]
        return flat.reshape(one.pixels.shape)

    return change


def _list_column_pairs(marks: int) -> Iterator[tuple[int, int]]:
    """Yield the pairs of columns of pixels that are tried: of each mark, or of a few marks all."""
    if marks <= ALL_ORDERS:
        yield from combinations(range(2 * marks), 2)
        return
    yield from ((2 * mark, 2 * mark + 1) for mark in range(marks))


def _list_orders(count: int) -> Iterator[tuple[int, ...]]:
    """Yield the wrong orders of some marks that are tried."""
    right = tuple(range(count))
    if count <= ALL_ORDERS:
        yield from (each for each in permutations(right) if each != right)
        return
    for i, j in combinations(right, 2):
        order = list(right)
        order[i], order[j] = j, i
        yield tuple(order)


def _state(clause: str) -> Callable[[Array, Array], str]:
    """Return the description of a hypothesis without numbers."""
    return lambda values, half: clause


def _describe_base(on: str, under: str) -> str:
    """Return the clause on the robot's base if a part in the world is seen from one robot."""
    if on != "world" or "." not in under:
        return ""
    return f" (or the base of '{under.partition('.')[0]}')"
