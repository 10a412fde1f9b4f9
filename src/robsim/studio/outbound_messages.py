"""What a studio tells its pages, as JSON texts, and what brings a new page to the present.

study      {"recording"}: the map of a study, which is told first and never changes
recording  {"recording", "live"}: all so far, as in a file
rows       {"from", "recording"}: further instants, from that number on
controls   {"controls"}: the values that may be changed, as declared
gallery    {"entries"}: experiments to choose from
texts      {"texts"}
state      what goes on: playing, speed, factor, outcome, ending, note, second, changes, handles,
           and the number of the run of the study that is open
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robsim.page.html_document import encode_recording_text
from robsim.plot.run_data import describe_outcome

if TYPE_CHECKING:
    from robsim.page.recording_builder import Recording
    from robsim.studio.run_pair import RunPair
    from robsim.studio.scenario_shelf import ScenarioShelf
    from robsim.studio.session import Session
    from robsim.studio.workbench import Workbench

AFTER = ("texts", "state")  # what is about the recording
GOAL = ".goal"  # end of the names of arrays of goals, which have no rows
FAST = 1  # level of compression of a map, whose numbers hardly repeat
LONGEST = 300  # messages that a new page gets, before they are made one


class OutboundMessages:
    """The messages that are new, and those that a page needs that connects now."""

    def __init__(self, study: Recording | None = None) -> None:
        self._study: list[str] = []
        if study:
            shown = encode_recording_text(study.header, study.arrays, set(), FAST)
            self._study.append(_encode_message("study", recording=shown))
        self._kept: dict[str, str] = {}
        self._log: list[str] = []  # the recording, and its further rows
        self._rows: list[tuple[int, dict[str, NDArray[Any]]]] = []  # likewise, as they were told
        self._count = 0  # of instants that are told
        self._made = -1  # of the bench, when they were told

    def present(self) -> list[str | bytes]:
        """Return what brings a page to the present."""
        kept, log = self._kept, self._log
        late = [kept[kind] for kind in AFTER if kind in kept]
        early = [kept[kind] for kind in kept if kind not in AFTER]
        return [*self._study, *early, *log, *late]

    def news(
        self, session: Session, bench: Workbench | None, shelf: ScenarioShelf
    ) -> Iterator[str]:
        """Yield what pages do not know yet."""
        if bench is not None:
            yield from self._of_bench(bench)
        yield from self._new("gallery", entries=shelf.entries)
        yield from self._new("state", **_build_session_state(session, bench))

    def _of_bench(self, bench: Workbench) -> Iterator[str]:
        news, bench.news = bench.news, set()
        if "controls" in news:
            listed = [_replace_non_finite(asdict(each)) for each in bench.controls.values()]
            yield from self._new("controls", controls=listed)
        if "recording" in news:
            yield self._whole(bench)
        elif bench.pair is not None:
            yield from self._further(bench, bench.pair)
        if "texts" in news:
            yield from self._new("texts", texts=bench.texts)

    def _whole(self, bench: Workbench) -> str:
        """Return the message of a recording that begins."""
        recording = bench.recording()
        self._header, self._live = recording.header, bench.pair is not None
        self._rows = [(0, recording.arrays)]
        self._count = len(bench.pair.live.instants) if bench.pair else 0
        self._made = bench.made
        self._kept.pop("texts", None)  # which a page forgets with what it showed
        return self._logged_anew()

    def _logged_anew(self) -> str:
        """Return one message of all that was told since the recording began."""
        arrays = _join_recording_rows(self._rows)
        recording = encode_recording_text(self._header, arrays, {"poses"})
        message = _encode_message("recording", recording=recording, live=self._live)
        self._log, self._rows = [message], [(0, arrays)]
        return message

    def _further(self, bench: Workbench, pair: RunPair) -> Iterator[str]:
        """Yield a message of the instants since the last one, which is told again if changed."""
        assert bench.film is not None
        count, changed = len(pair.live.instants), bench.made != self._made
        start = min(self._count, count) - (1 if changed else 0)
        if count == start:
            return
        arrays = bench.film.arrays(pair.instants(start))
        recording = encode_recording_text({}, arrays, set())
        message = _encode_message("rows", recording=recording, **{"from": start})
        self._count, self._made = count, bench.made
        self._rows.append((start, arrays))
        if len(self._log) >= LONGEST:
            self._logged_anew()
        else:
            self._log = [*self._log, message]
        yield message

    def _new(self, kind: str, **content: Any) -> Iterator[str]:
        """Yield a message, unless it is as the last one of its kind."""
        message = _encode_message(kind, **content)
        if self._kept.get(kind) != message:
            self._kept = {**self._kept, kind: message}
            yield message


def _join_recording_rows(
    rows: list[tuple[int, dict[str, NDArray[Any]]]],
) -> dict[str, NDArray[Any]]:
    """Return the arrays of a recording with all further rows; what has no rows is the last."""
    (_, whole), (end, last) = rows[0], rows[-1]
    parts = [last]  # from the last on, each up to where a later one begins
    for start, arrays in reversed(rows[:-1]):
        count, end = max(end - start, 0), min(start, end)
        parts.append({name: arrays[name][:count] for name in last})
    timed = [name for name in last if not name.endswith(GOAL)]
    joined = {name: np.concatenate([part[name] for part in reversed(parts)]) for name in timed}
    return whole | last | joined


def _build_session_state(session: Session, bench: Workbench | None) -> dict[str, Any]:
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


def _encode_message(kind: str, **content: Any) -> str:
    return json.dumps({"type": kind, **content}, ensure_ascii=False, allow_nan=False)


def _replace_non_finite(value: Any) -> Any:
    """Return a value of JSON, in which what is not finite is null."""
    if isinstance(value, dict):
        return {key: _replace_non_finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_replace_non_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
