"""The limits of a run's safety, as what may have kept it from its goal."""

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

AT_LIMIT = 1.0 - 1e-9  # of a limit, from which on it acts
NEAR = 1e-3  # rad or metres


def list_safety_limits(inquiry: RunAnalysis) -> list[Ablation]:
    """Return the limits of a run's safety that acted, each with the change that lifts it."""
    safety = inquiry.case.safety
    if safety is None:
        return []
    found = []
    for field, (name, finding) in SAFETY_LIMITS.items():
        if getattr(safety, field) is not None:
            sentence, evidence = finding(inquiry, safety)
            if evidence.get("share") != 0.0:
                found.append(
                    Ablation(
                        f"safety.{field}", name, sentence, _make_limit_removal(field), evidence
                    )
                )
    return found


def _make_limit_removal(field: str) -> ExperimentChange:
    """Return the change of an experiment whose safety does not have a limit."""
    without: dict[str, Any] = {field: None}
    return lambda case: case.with_(safety=replace(case.safety or Safety(), **without))


def _commanded_velocities(inquiry: RunAnalysis) -> Array:
    """Return what was commanded in each period (T, n)."""
    periods = max(len(inquiry.snapshots) - 1, 1)
    found: Array = inquiry.run["qd"].values[:periods, inquiry.controller.columns]
    return found


def _velocity_limits(inquiry: RunAnalysis, safety: Safety, which: str) -> Array:
    return safety.limits(which, inquiry.case.scene.nv)[inquiry.controller.columns]


def _state_speed_limit(inquiry: RunAnalysis, safety: Safety) -> Statement:
    fast = np.abs(_commanded_velocities(inquiry)) >= AT_LIMIT * _velocity_limits(
        inquiry, safety, "speed"
    )
    share = float(fast.any(axis=1).mean())
    sentence = (
        f"The speed limit of the safety slows {format_number(100 * share)} percent of the commands."
    )
    return sentence, {"share": share}


def _state_acceleration_limit(inquiry: RunAnalysis, safety: Safety) -> Statement:
    commands = _commanded_velocities(inquiry)
    changes = np.abs(np.diff(commands, axis=0, prepend=np.zeros((1, commands.shape[1]))))
    most = _velocity_limits(inquiry, safety, "acceleration") * inquiry.case.dt
    share = float((changes >= AT_LIMIT * most).any(axis=1).mean())
    sentence = (
        "The acceleration limit of the safety cuts the change of "
        f"{format_number(100 * share)} percent of the commands."
    )
    return sentence, {"share": share}


def _state_joint_margin(inquiry: RunAnalysis, safety: Safety) -> Statement:
    scene, columns = inquiry.case.scene, inquiry.controller.columns
    where, limits = find_coordinates(scene, columns)
    q, margins = inquiry.run["q_end"].values[where], safety.limits("margin", scene.nq)[where]
    room = np.where(where >= 0, np.minimum(q - limits[:, 0], limits[:, 1] - q) - margins, np.inf)
    least = int(np.argmin(room))
    name, left = scene.velocity_names[columns[least]], float(room[least])
    if left > NEAR:
        return "The safety keeps the joints from their limits, and none is there.", {"room": left}
    margin, unit = float(margins[least]), scene.coordinate_units[where[least]]
    before = format_angle(margin) if unit == "rad" else format_length(margin)
    return f"The safety stops joint {name} {before} before its limit.", {"margin": margin}


def _state_fence(inquiry: RunAnalysis, safety: Safety) -> Statement:
    fence = safety.fence
    assert fence is not None
    at = inquiry.case.scene.pose(fence.frame, inquiry.run["q_end"].values).position
    room = np.minimum(at - np.array(fence.low), np.array(fence.high) - at)
    least = int(np.argmin(room))
    side = "low" if at[least] - fence.low[least] < fence.high[least] - at[least] else "high"
    left = float(room[least])
    sentence = (
        f"The fence of the safety ends {format_number(max(left, 0.0))} m from where '{fence.frame}' is "
        f"at the end of the run, on its {side} side along {'xyz'[least]}."
    )
    return sentence, {"room_m": left}


def _state_watchdog(inquiry: RunAnalysis, safety: Safety) -> Statement:
    dog = safety.watchdog
    assert dog is not None
    still = float((_commanded_velocities(inquiry) == 0.0).all(axis=1).mean())
    what = "holds" if dog.then == "hold" else "stops"
    sentence = (
        f"The watchdog of the safety {what} the robot when the last image is older than "
        f"{format_number(dog.after)} s; it stands still in {format_number(100 * still)} percent of the periods."
    )
    return sentence, {"after_s": dog.after, "share": still}


def _state_ramp(inquiry: RunAnalysis, safety: Safety) -> Statement:
    assert safety.ramp is not None
    sentence = (
        f"The safety lets a command grow for {format_number(safety.ramp)} s to its full size."
    )
    return sentence, {"ramp_s": safety.ramp}


SAFETY_LIMITS: dict[str, tuple[str, Callable[[RunAnalysis, Safety], Statement]]] = {
    "speed": ("the speed limit of the safety", _state_speed_limit),
    "acceleration": ("the acceleration limit of the safety", _state_acceleration_limit),
    "margin": ("the margin of the joint limits", _state_joint_margin),
    "fence": ("the fence", _state_fence),
    "watchdog": ("the watchdog", _state_watchdog),
    "ramp": ("the slow start of the safety", _state_ramp),
}
