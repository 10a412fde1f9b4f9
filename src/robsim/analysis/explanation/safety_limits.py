"""Safety limits that may have kept a run from its goal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from robsim.analysis.explanation.ablation import Ablation, ExperimentChange
from robsim.analysis.explanation.run_analysis import RunAnalysis
from robsim.analysis.explanation.text_format import format_angle, format_length, format_number
from robsim.base.arrays import Array
from robsim.servo.safety.safety import Safety
from robsim.servo.shaping.command_shaper import find_coordinates
from robsim.world.imperfections.imperfection import Statement

AT_LIMIT = 1.0 - 1e-9  # share of a limit above which it is active
NEAR = 1e-3  # distance from a limit in rad or metres


def list_safety_limits(analysis: RunAnalysis) -> list[Ablation]:
    """Return the active safety limits of a run, each with the change that removes it."""
    safety = analysis.case.safety
    if safety is None:
        return []
    removals = []
    for field, (name, finding) in SAFETY_LIMITS.items():
        if getattr(safety, field) is not None:
            sentence, evidence = finding(analysis, safety)
            if evidence.get("share") != 0.0:
                removals.append(
                    Ablation(
                        f"safety.{field}", name, sentence, _make_limit_removal(field), evidence
                    )
                )
    return removals


def _make_limit_removal(field: str) -> ExperimentChange:
    """Return the change that removes a safety limit from an experiment."""
    no_limit: dict[str, Any] = {field: None}
    return lambda case: case.with_(safety=replace(case.safety or Safety(), **no_limit))


def _commanded_velocities(analysis: RunAnalysis) -> Array:
    """Return the commanded velocities (T, n) in each period."""
    periods = max(analysis.history.length - 1, 1)
    commands: Array = analysis.run["qd"].values[:periods, analysis.controller.columns]
    return commands


def _velocity_limits(analysis: RunAnalysis, safety: Safety, which: str) -> Array:
    """Return a velocity or acceleration limit of the commanded joints."""
    return safety.limits(which, analysis.case.scene.nv)[analysis.controller.columns]


def _state_speed_limit(analysis: RunAnalysis, safety: Safety) -> Statement:
    """Return the statement on the speed limit."""
    fast = np.abs(_commanded_velocities(analysis)) >= AT_LIMIT * _velocity_limits(
        analysis, safety, "speed"
    )
    share = float(fast.any(axis=1).mean())
    sentence = (
        f"The speed limit of the safety slows {format_number(100 * share)} percent of the commands."
    )
    return sentence, {"share": share}


def _state_acceleration_limit(analysis: RunAnalysis, safety: Safety) -> Statement:
    """Return the statement on the acceleration limit."""
    commands = _commanded_velocities(analysis)
    changes = np.abs(np.diff(commands, axis=0, prepend=np.zeros((1, commands.shape[1]))))
    most = _velocity_limits(analysis, safety, "acceleration") * analysis.case.dt
    share = float((changes >= AT_LIMIT * most).any(axis=1).mean())
    sentence = (
        "The acceleration limit of the safety cuts the change of "
        f"{format_number(100 * share)} percent of the commands."
    )
    return sentence, {"share": share}


def _state_joint_margin(analysis: RunAnalysis, safety: Safety) -> Statement:
    """Return the statement on the margin of the joint limits."""
    scene, columns = analysis.case.scene, analysis.controller.columns
    rows, limits = find_coordinates(scene, columns)
    q, margins = analysis.run["q_end"].values[rows], safety.limits("margin", scene.nq)[rows]
    room = np.where(rows >= 0, np.minimum(q - limits[:, 0], limits[:, 1] - q) - margins, np.inf)
    least = int(np.argmin(room))
    name, distance = scene.velocity_names[columns[least]], float(room[least])
    if distance > NEAR:
        return "The safety keeps the joints from their limits, but no joint is near one.", {
            "room": distance
        }
    margin, unit = float(margins[least]), scene.coordinate_units[rows[least]]
    before = format_angle(margin) if unit == "rad" else format_length(margin)
    return f"The safety stops joint {name} {before} before its limit.", {"margin": margin}


def _state_fence(analysis: RunAnalysis, safety: Safety) -> Statement:
    """Return the statement on the fence."""
    fence = safety.fence
    assert fence is not None
    at = analysis.case.scene.pose(fence.frame, analysis.run["q_end"].values).position
    room = np.minimum(at - np.array(fence.low), np.array(fence.high) - at)
    least = int(np.argmin(room))
    side = "low" if at[least] - fence.low[least] < fence.high[least] - at[least] else "high"
    distance = float(room[least])
    sentence = (
        f"The fence of the safety is {format_number(max(distance, 0.0))} m from '{fence.frame}' at "
        f"the end of the run, on its {side} side along {'xyz'[least]}."
    )
    return sentence, {"room_m": distance}


def _state_watchdog(analysis: RunAnalysis, safety: Safety) -> Statement:
    """Return the statement on the watchdog."""
    watchdog = safety.watchdog
    assert watchdog is not None
    still = float((_commanded_velocities(analysis) == 0.0).all(axis=1).mean())
    action = "holds" if watchdog.then == "hold" else "stops"
    sentence = (
        f"The watchdog of the safety {action} the robot when the last image is older than "
        f"{format_number(watchdog.after)} s; it stands still in {format_number(100 * still)} "
        "percent of the periods."
    )
    return sentence, {"after_s": watchdog.after, "share": still}


def _state_ramp(analysis: RunAnalysis, safety: Safety) -> Statement:
    """Return the statement on the slow start."""
    assert safety.ramp is not None
    sentence = f"The safety ramps the commands up over {format_number(safety.ramp)} s."
    return sentence, {"ramp_s": safety.ramp}


SAFETY_LIMITS: dict[str, tuple[str, Callable[[RunAnalysis, Safety], Statement]]] = {
    "speed": ("the speed limit of the safety", _state_speed_limit),
    "acceleration": ("the acceleration limit of the safety", _state_acceleration_limit),
    "margin": ("the margin of the joint limits", _state_joint_margin),
    "fence": ("the fence", _state_fence),
    "watchdog": ("the watchdog", _state_watchdog),
    "ramp": ("the slow start of the safety", _state_ramp),
}
