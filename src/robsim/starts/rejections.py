"""Reasons why random starts are rejected, as text for error messages."""

from __future__ import annotations

import numpy as np

from robsim.base.arrays import Array
from robsim.starts.pose_regions import BoundedQuantity
from robsim.starts.rejection_sampler import Judge, Source
from robsim.starts.start_kinematics import StartKinematics
from robsim.starts.start_samplers import Start
from robsim.statistics.random_numbers import RandomNumbers

SAMPLES = 200  # samples that are counted


def describe_rejections(start: Start, reach: StartKinematics, source: Source, judge: Judge) -> str:
    """Return the counts of rejected samples by their cause, and advice, as clauses of a message.

    Parameters
    ----------
    start : Start
        Sampler without an accepted start.
    reach : StartKinematics
        Moving frame, goal, target and kinematics.
    source, judge : callable
        Random numbers and acceptance of starts, see `draw_starts`.
    """
    draws = np.arange(SAMPLES)
    numbers = source(draws, 0)
    q, reached = start.coordinates(reach, numbers)
    low, high = reach.scene.limits.T
    limited = reached & ((q >= low) & (q <= high)).all(axis=1)
    counts = []
    if start.numbers:
        counts.append(f"{reached.sum()} are within reach of {reach.joints_text}")
    if limited.sum() < (reached.sum() if start.numbers else SAMPLES):
        counts.append(f"{limited.sum()} are within the joint limits")
    cause, more = "", ", a larger image, or visible=False to see why"
    if reached.any():
        seeing = judge(draws[limited], q[limited]).sum() if limited.any() else 0
        counts.append(f"{seeing} see their target")
    else:
        cause, more = _describe_nearest_poses(start, reach, q, numbers), ""
    return f"of {SAMPLES} samples, {' and '.join(counts)}{cause}; try {start.advice}{more}"


def _describe_nearest_poses(
    start: Start, reach: StartKinematics, q: Array, numbers: RandomNumbers
) -> str:
    """Return the bound that the fewest poses near to the sampled ones keep; "" if unknown."""
    region = None
    if start.numbers and not reach.reaches_every_pose:
        region = start.region(reach)
    if region is None:
        return ""
    worst = min(region.quantities(reach.poses(q)), key=lambda each: each.within.sum())
    low, high = float(worst.values.min()), float(worst.values.max())
    return (
        f" (the {worst.name} of the nearest poses is {_format_range(worst, low, high)}, not "
        f"{_format_range(worst, worst.low, worst.high)})"
    )


def _format_range(quantity: BoundedQuantity, low: float, high: float) -> str:
    """Return a range of a quantity as text, with its unit, angles in degrees."""
    is_angle = quantity.unit == "rad"
    numbers = [np.degrees(each) if is_angle else each for each in (low, high)]
    first, last = (f"{each:.3g}" for each in numbers)
    unit = "degrees" if is_angle else "m"
    return f"{first} {unit}" if first == last else f"{first} to {last} {unit}"
