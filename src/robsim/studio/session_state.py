"""The state of a session, as pages show it."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from robsim.plot.run_data import describe_outcome

if TYPE_CHECKING:
    from robsim.studio.session import Session
    from robsim.studio.workbench import Workbench


def build_session_state(session: Session, bench: Workbench | None) -> dict[str, Any]:
    """Return the state of a session."""
    factor = session.factor if session.playing else None
    return {
        "playing": session.playing,
        "speed": session.speed,
        "factor": None if factor is None else round(factor, 2),
        "note": session.note,
        "run": session.run,
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
        "changes": list(bench.changes),
        "handles": [asdict(each) for each in bench.handles],
    }


_NO_BENCH = {"outcome": "", "ending": "", "second": {}, "changes": [], "handles": []}
