"""The state of a session, as pages show it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Protocol

from robsim.plot.run_data import describe_outcome
from robsim.studio.refusal_reasons import convert_radians

if TYPE_CHECKING:
    from robsim.studio.live_run import LiveRun
    from robsim.studio.workbench import Workbench


class SessionView(Protocol):
    """The part of a session that pages show."""

    playing: bool
    speed: float
    factor: float | None
    note: str
    handled: int
    run: int | None
    refusals: dict[str, str]


def build_session_state(session: SessionView, bench: Workbench | None) -> dict[str, Any]:
    """Return the state of a session."""
    factor = session.factor if session.playing else None
    return {
        "playing": session.playing,
        "speed": session.speed,
        "factor": None if factor is None else round(factor, 2),
        "note": session.note or (bench.return_remark if bench else ""),
        "requests": session.handled,
        "run": session.run,
        "refusals": [{"path": path, "reason": why} for path, why in session.refusals.items()],
        **(_build_workbench_state(bench) if bench else _NO_BENCH),
    }


def _build_workbench_state(bench: Workbench) -> dict[str, Any]:
    """Return the part of the state that belongs to the experiment."""
    end = bench.pair.end if bench.pair else None
    other = bench.pair.end_of_second if bench.pair else None
    hold = bench.experiment.hold
    ends = [describe_outcome(end.outcome, end.time, hold)] if end else []
    ends += [f"second scheme {describe_outcome(other.outcome, other.time, hold)}"] if other else []
    return {
        "outcome": end.outcome.name if end else "",
        "ending": "; ".join(ends),
        "second": bench.second,
        "handles": [vars(each) for each in bench.handles],
        "changes": bench.differences,
        "undo": bench.history.before is not None,
        "redo": bench.history.after is not None,
        "edited": bench.edited,
        "restarts": bench.restarts,
        "restarted_because": convert_radians(bench.restarted_because),
        "resting": bench.rests,
        "since": bench.since,
        "distance": _build_distance(bench.pair.live) if bench.pair else None,
        "missed": bench.why["missed"],
        "goal": {"kept": bench.keeps_goals, "shown": bench.has_shown_goals},
    }


def _build_distance(live: LiveRun) -> dict[str, Any] | None:
    """Return the distance of the moving frame to its goal; None if no goal pose is known."""
    length, angle = live.measure_distance()
    if not math.isfinite(length):
        return None
    turn = float(f"{angle:.4g}") if math.isfinite(angle) else None
    return {"length": float(f"{length:.4g}"), "angle": turn, "frame": live.moving_frame}


_NO_BENCH: dict[str, Any] = {
    "outcome": "",
    "ending": "",
    "second": {},
    "changes": [],
    "handles": [],
    "undo": False,
    "redo": False,
    "edited": False,
    "restarts": 0,
    "restarted_because": "",
    "resting": False,
    "since": 0.0,
    "distance": None,
    "missed": False,
    "goal": {"kept": False, "shown": False},
}
