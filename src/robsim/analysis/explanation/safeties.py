"""The limits of a run's safety, as what may have kept it from its goal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from robsim.analysis.explanation.inquiry import Inquiry
from robsim.analysis.explanation.removal import Change, Removal
from robsim.analysis.explanation.wording import degrees, length, number
from robsim.base.arrays import Array
from robsim.servo.safety.safety import Safety
from robsim.servo.shaping.shaping import coordinates_of
from robsim.world.imperfections.imperfection import Statement

AT_LIMIT = 1.0 - 1e-9  # of a limit, from which on it acts
NEAR = 1e-3  # rad or metres


def safeties(inquiry: Inquiry) -> list[Removal]:
    """Return the limits of a run's safety that acted, each with the change that lifts it."""
    safety = inquiry.case.safety
    if safety is None:
        return []
    found = []
    for field, (name, finding) in SAFETY.items():
        if getattr(safety, field) is not None:
            sentence, evidence = finding(inquiry, safety)
            if evidence.get("share") != 0.0:
                found.append(Removal(f"safety.{field}", name, sentence, _lifted(field), evidence))
    return found


def _lifted(field: str) -> Change:
    """Return the change of an experiment whose safety does not have a limit."""
    without: dict[str, Any] = {field: None}
    return lambda case: case.with_(safety=replace(case.safety or Safety(), **without))


def _commands(inquiry: Inquiry) -> Array:
    """Return what was commanded in each period (T, n)."""
    periods = max(len(inquiry.snapshots) - 1, 1)
    found: Array = inquiry.run["qd"].values[:periods, inquiry.controller.columns]
    return found


def _limit(inquiry: Inquiry, safety: Safety, which: str) -> Array:
    return safety.limits(which, inquiry.case.scene.nv)[inquiry.controller.columns]


def _speed(inquiry: Inquiry, safety: Safety) -> Statement:
    fast = np.abs(_commands(inquiry)) >= AT_LIMIT * _limit(inquiry, safety, "speed")
    share = float(fast.any(axis=1).mean())
    sentence = f"The speed limit of the safety slows {number(100 * share)} percent of the commands."
    return sentence, {"share": share}


def _acceleration(inquiry: Inquiry, safety: Safety) -> Statement:
    commands = _commands(inquiry)
    changes = np.abs(np.diff(commands, axis=0, prepend=np.zeros((1, commands.shape[1]))))
    most = _limit(inquiry, safety, "acceleration") * inquiry.case.dt
    share = float((changes >= AT_LIMIT * most).any(axis=1).mean())
    sentence = (
        "The acceleration limit of the safety cuts the change of "
        f"{number(100 * share)} percent of the commands."
    )
    return sentence, {"share": share}


def _margin(inquiry: Inquiry, safety: Safety) -> Statement:
    scene, columns = inquiry.case.scene, inquiry.controller.columns
    where, limits = coordinates_of(scene, columns)
    q, margins = inquiry.run["q_end"].values[where], safety.limits("margin", scene.nq)[where]
    room = np.where(where >= 0, np.minimum(q - limits[:, 0], limits[:, 1] - q) - margins, np.inf)
    least = int(np.argmin(room))
    name, left = scene.velocity_names[columns[least]], float(room[least])
    if left > NEAR:
        return "The safety keeps the joints from their limits, and none is there.", {"room": left}
    margin, unit = float(margins[least]), scene.coordinate_units[where[least]]
    before = degrees(margin) if unit == "rad" else length(margin)
    return f"The safety stops joint {name} {before} before its limit.", {"margin": margin}


def _fence(inquiry: Inquiry, safety: Safety) -> Statement:
    fence = safety.fence
    assert fence is not None
    at = inquiry.case.scene.pose(fence.frame, inquiry.run["q_end"].values).position
    room = np.minimum(at - np.array(fence.low), np.array(fence.high) - at)
    least = int(np.argmin(room))
    side = "low" if at[least] - fence.low[least] < fence.high[least] - at[least] else "high"
    left = float(room[least])
    sentence = (
        f"The fence of the safety ends {number(max(left, 0.0))} m from where '{fence.frame}' is "
        f"at the end of the run, on its {side} side along {'xyz'[least]}."
    )
    return sentence, {"room_m": left}


def _watchdog(inquiry: Inquiry, safety: Safety) -> Statement:
    dog = safety.watchdog
    assert dog is not None
    still = float((_commands(inquiry) == 0.0).all(axis=1).mean())
    what = "holds" if dog.then == "hold" else "stops"
    sentence = (
        f"The watchdog of the safety {what} the robot when the last image is older than "
        f"{number(dog.after)} s; it stands still in {number(100 * still)} percent of the periods."
    )
    return sentence, {"after_s": dog.after, "share": still}


def _ramp(inquiry: Inquiry, safety: Safety) -> Statement:
    assert safety.ramp is not None
    sentence = f"The safety lets a command grow for {number(safety.ramp)} s to its full size."
    return sentence, {"ramp_s": safety.ramp}


SAFETY: dict[str, tuple[str, Callable[[Inquiry, Safety], Statement]]] = {
    "speed": ("the speed limit of the safety", _speed),
    "acceleration": ("the acceleration limit of the safety", _acceleration),
    "margin": ("the margin of the joint limits", _margin),
    "fence": ("the fence", _fence),
    "watchdog": ("the watchdog", _watchdog),
    "ramp": ("the slow start of the safety", _ramp),
}
