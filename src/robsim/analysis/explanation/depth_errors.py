"""Depths assumed by the law that differ from the true ones."""

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


def list_depth_errors(inquiry: RunAnalysis) -> Iterator[Ablation]:
    """Yield the imperfections of scaled depths and of assumed or estimated depths."""
    scales = {leaf.depth_scale for leaf in list_servo_tasks(inquiry.case.task)} - {1.0}
    if scales:
        sentence, evidence = _state_depth_scale(inquiry, np.ravel(next(iter(scales))))
        change, undone = _make_field_change(depth_scale=1.0), "with the true depths"
        yield Ablation("depth scale", "the wrong depths", sentence, change, evidence, undone)
    odd = [leaf.depth for leaf in list_servo_tasks(inquiry.case.task) if leaf.depth != "true"]
    if odd:
        depths = inquiry.depths
        depths = depths[depths > 0] if (depths > 0).any() else depths
        low, high = float(depths.min()), float(depths.max())
        sentence = (
            f"The depth in L is {_describe_depth(odd[0])}, not the true one, which goes from {format_length(low)} "
            f"to {format_length(high)}."
        )
        change, evidence = _make_field_change(depth="true"), {"least_m": low, "most_m": high}
        undone = "with the true depth"
        yield Ablation("depth", "the assumed depth", sentence, change, evidence, undone)


def _describe_depth(depth: Any) -> str:
    if isinstance(depth, DepthFilter):
        return "estimated by a filter"
    return "that of the goal" if depth == "goal" else f"taken as {format_length(depth)}"


def _state_depth_scale(inquiry: RunAnalysis, scale: Any) -> Statement:
    low, high = float(np.min(scale)), float(np.max(scale))
    product = high * inquiry.gain * inquiry.case.dt
    evidence = {"least": low, "most": high, "gain_dt": product, "limit": 2.0}
    if low == high:
        sentence = (
            f"The law takes all depths for {format_number(high)} times what they are, so that "
            f"translations are {format_number(high)} times as fast as they should be: gain times period "
            f"times that factor is {format_number(product)}, and the loop is "
            f"{'unstable from' if product > 2 else 'stable up to'} 2."
        )
        return sentence, evidence
    sentence = (
        f"The depths that the law assumes are wrong by factors from {format_number(low)} to "
        f"{format_number(high)}, not the same for all marks, to which the loop is sensitive (Malis and "
        "Rives 2003)"
    )
    slowest = inquiry.value("contraction")
    if not np.isfinite(slowest):
        return f"{sentence}.", evidence
    ideal = abs(1 - inquiry.gain * inquiry.case.dt)
    sentence += (
        f": of the error of the motion that is served worst {100 * slowest:.4g} percent are left "
        f"after a period, where {100 * ideal:.4g} should be."
    )
    return sentence, evidence | {"contraction": slowest, "ideal": ideal}


def _make_field_change(**values: Any) -> ExperimentChange:
    return lambda case: case.with_(
        task=map_servo_tasks(case.task, lambda leaf: replace_fields(leaf, **values))
    )
