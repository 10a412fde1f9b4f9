"""Imperfections of the depths that the law uses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from robsim.analysis.explanation.ablation import Ablation, ExperimentChange
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_length, format_number
from robsim.analysis.task_tree import list_servo_tasks, map_servo_tasks, replace_fields
from robsim.servo.laws.depth_filter import DepthFilter
from robsim.world.imperfections.imperfection import Statement


def list_depth_errors(analysis: RunAnalysis) -> Iterator[Ablation]:
    """Yield the imperfections of scaled depths and of assumed or estimated depths."""
    scales = {leaf.depth_scale for leaf in list_servo_tasks(analysis.case.task)} - {1.0}
    if scales:
        sentence, evidence = _state_depth_scale(analysis, np.ravel(next(iter(scales))))
        change, undone = _make_field_change(depth_scale=1.0), "with the true depths"
        yield Ablation("depth scale", "the wrong depths", sentence, change, evidence, undone)
    other_depths = [
        leaf.depth for leaf in list_servo_tasks(analysis.case.task) if leaf.depth != "true"
    ]
    if other_depths:
        depths = analysis.depths
        depths = depths[depths > 0] if (depths > 0).any() else depths
        low, high = float(depths.min()), float(depths.max())
        sentence = (
            f"The depth in L is {_describe_depth(other_depths[0])}, not the true depth, between "
            f"{format_length(low)} and {format_length(high)}."
        )
        change, evidence = _make_field_change(depth="true"), {"least_m": low, "most_m": high}
        undone = "with the true depth"
        yield Ablation("depth", "the assumed depth", sentence, change, evidence, undone)


def _describe_depth(depth: Any) -> str:
    """Return a phrase on the depth that the law uses."""
    if isinstance(depth, DepthFilter):
        return "estimated by a filter"
    return "the depth at the goal" if depth == "goal" else f"taken as {format_length(depth)}"


def _state_depth_scale(analysis: RunAnalysis, scale: Any) -> Statement:
    """Return the statement on scaled depths."""
    low, high = float(np.min(scale)), float(np.max(scale))
    product = high * analysis.gain * analysis.case.dt
    evidence = {"least": low, "most": high, "gain_dt": product, "limit": 2.0}
    if low == high:
        sentence = (
            f"All depths of the law are {format_number(high)} times the true depths, so that "
            f"translations are {format_number(high)} times too fast: gain times period "
            f"times this factor is {format_number(product)}, and the loop is "
            f"{'unstable from' if product > 2 else 'stable up to'} 2."
        )
        return sentence, evidence
    sentence = (
        f"The depths of the law are wrong by factors from {format_number(low)} to "
        f"{format_number(high)}, different for each mark; the loop is sensitive to this (Malis and "
        "Rives 2003)"
    )
    slowest = analysis.value("contraction")
    if not np.isfinite(slowest):
        return f"{sentence}.", evidence
    ideal = abs(1 - analysis.gain * analysis.case.dt)
    sentence += (
        f": in the worst motion {100 * slowest:.4g} percent of the error remain after a period "
        f"instead of {100 * ideal:.4g}."
    )
    return sentence, evidence | {"contraction": slowest, "ideal": ideal}


def _make_field_change(**values: Any) -> ExperimentChange:
    """Return the change of the given fields in every servo task."""
    return lambda case: case.with_(
        task=map_servo_tasks(case.task, lambda leaf: replace_fields(leaf, **values))
    )
