"""Hypotheses on measured joints: offsets, factors and swapped columns."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from robsim.analysis.log_faults.hypothesis import Hypothesis
from robsim.analysis.log_faults.image_comparison import ImageComparison
from robsim.analysis.log_faults.log_images import ImageSeries
from robsim.analysis.log_faults.value_text import format_interval
from robsim.base.arrays import Array

JointCorrection = Callable[[Array, Array], Array]  # coordinates (n, nq), from numbers and readings


class MeasuredJoint(NamedTuple):
    """A joint with a single coordinate, between a camera and its target."""

    name: str
    coordinate: int
    unit: str


def list_joint_hypotheses(images: ImageComparison) -> Iterator[Hypothesis]:
    """Yield the hypotheses on measured coordinates."""
    joints = _list_measured_joints(images)
    for joint in joints:
        yield _make_offset(images, joint)
        yield _make_reading_factor(images, joint)
        yield _make_reversed_reading(images, joint)
    for one, other in combinations(joints, 2):
        if one.unit == other.unit:
            yield _make_swapped_readings(images, one, other)


def _make_offset(images: ImageComparison, joint: MeasuredJoint) -> Hypothesis:
    """Return the hypothesis that a measured joint has an offset."""

    def correct(values: Array, q: Array) -> Array:
        return np.asarray(q + values[0] * (np.arange(q.shape[1]) == joint.coordinate))

    def describe(values: Array, half: Array) -> str:
        factor, word = (180.0 / np.pi, "degrees") if joint.unit == "rad" else (1e3, "mm")
        amount = format_interval(factor * values[0], factor * half[0], word)
        return f"the joint '{joint.name}' has an offset of {amount} from its measured value"

    names = (f"offset_{joint.unit}",)
    return _make(images, "joint offset", joint.name, correct, describe, names)


def _make_reading_factor(images: ImageComparison, joint: MeasuredJoint) -> Hypothesis:
    """Return the hypothesis that a joint moves by a multiple of its measured motion."""
    begin = images.series[0].track.q[0, joint.coordinate]

    def correct(values: Array, q: Array) -> Array:
        true = q.copy()
        true[:, joint.coordinate] = begin + values[0] * (q[:, joint.coordinate] - begin)
        return true

    def describe(values: Array, half: Array) -> str:
        factor = format_interval(values[0], half[0])
        return f"the joint '{joint.name}' moves by {factor} times its measured motion"

    starts = [(1.0,), (-1.0,)]
    return _make(images, "joint reading", joint.name, correct, describe, ("factor",), starts)


def _make_reversed_reading(images: ImageComparison, joint: MeasuredJoint) -> Hypothesis:
    """Return the hypothesis that a measured joint has the wrong sign."""

    def correct(values: Array, q: Array) -> Array:
        true = q.copy()
        true[:, joint.coordinate] *= -1.0
        return true

    text = f"the measured joint '{joint.name}' has the wrong sign"
    return _make(images, "reversed reading", joint.name, correct, lambda *_: text)


def _make_swapped_readings(
    images: ImageComparison, one: MeasuredJoint, other: MeasuredJoint
) -> Hypothesis:
    """Return the hypothesis that two measured joints are swapped."""

    def correct(values: Array, q: Array) -> Array:
        true = q.copy()
        true[:, [one.coordinate, other.coordinate]] = q[:, [other.coordinate, one.coordinate]]
        return true

    names = f"'{one.name}' and '{other.name}'"
    text = f"the measured joints {names} are swapped"
    return _make(images, "swapped joints", names, correct, lambda *_: text)


def _make(
    images: ImageComparison,
    about: str,
    part: str,
    correct: JointCorrection,
    describe: Callable[[Array, Array], str],
    names: tuple[str, ...] = (),
    starts: Sequence[Sequence[float]] = (),
) -> Hypothesis:
    """Return the hypothesis with a correction of the measured coordinates."""

    def change(one: ImageSeries, values: Array) -> Array:
        return one.predict(change=lambda q: correct(values, q))

    return images.make(
        *(about, change, describe, part),
        names=names,
        starts=starts,
        cost=0 if names else 1,
        correct=correct,
    )


def _list_measured_joints(images: ImageComparison) -> list[MeasuredJoint]:
    """Return the single joints that move a camera relative to its target."""
    scene = images.series[0].sight.scene
    columns = np.unique(np.concatenate([each.sight.columns for each in images.series]))
    joints = []
    for i in (index for index in scene.tree.alone(columns).tolist() if index >= 0):
        name = scene.coordinate_names[i]
        joints.append(MeasuredJoint(name, i, scene.coordinate_units[i]))
    return joints
