"""Messages of a studio to its pages, as JSON texts.

The messages, by type:

* study: {"recording"}, the map of a study. It is sent first and does not change.
* recording: {"recording", "live"}, all instants so far, as in a file.
* rows: {"from", "recording"}, the instants from number "from" on.
* controls: {"controls"}, the values that a page can change, with their declarations.
* gallery: {"entries"}, experiments to choose from.
* texts: {"texts", "why"}, texts by heading, and the explanation with its actions.
* state: playing, speed, factor, outcome, ending, note, second, changes, handles, and run (the
  number of the open run of the study).
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
from robsim.studio.session_state import build_session_state

if TYPE_CHECKING:
    from robsim.page.recording_builder import Recording
    from robsim.studio.run_pair import RunPair
    from robsim.studio.scenario_shelf import ScenarioShelf
    from robsim.studio.session import Session
    from robsim.studio.workbench import Workbench

AFTER = ("texts", "state")  # types that are sent after the recording
GOAL = ".goal"  # suffix of the names of goal arrays, which do not have a row for each instant
FAST = 1  # compression level of a map; its numbers hardly repeat
LONGEST = 300  # largest number of messages for a new page; more are joined into one


class OutboundMessages:
    """The new messages of a studio, and the messages that a new page needs."""

    def __init__(self, study: Recording | None = None) -> None:
        self._study: list[str] = []
        if study:
            recording = encode_recording_text(study.header, study.arrays, set(), FAST)
            self._study.append(_encode_message("study", recording=recording))
        self._latest: dict[str, str] = {}  # by type
        self._log: list[str] = []  # the message of the recording and of its further rows
        self._rows: list[tuple[int, dict[str, NDArray[Any]]]] = []  # first number, and arrays
        self._count = 0  # number of sent instants
        self._revision = -1  # revision of the bench when the last instants were sent

    def present(self) -> list[str | bytes]:
        """Return the messages that bring a page up to date."""
        latest, log = self._latest, self._log
        late = [latest[kind] for kind in AFTER if kind in latest]
        early = [latest[kind] for kind in latest if kind not in AFTER]
        return [*self._study, *early, *log, *late]

    def news(
        self, session: Session, bench: Workbench | None, shelf: ScenarioShelf
    ) -> Iterator[str]:
        """Yield the messages that have not been sent yet."""
        if bench is not None:
            yield from self._list_bench_news(bench)
        yield from self._encode_if_new("gallery", entries=shelf.entries)
        yield from self._encode_if_new("state", **build_session_state(session, bench))

    def _list_bench_news(self, bench: Workbench) -> Iterator[str]:
        """Yield the messages about the experiment that have not been sent yet."""
        news, bench.news = bench.news, set()
        if "controls" in news:
            controls = [_replace_non_finite(asdict(each)) for each in bench.controls.values()]
            yield from self._encode_if_new("controls", controls=controls)
        if "recording" in news:
            yield self._encode_whole(bench)
        elif bench.pair is not None:
            yield from self._encode_further_rows(bench, bench.pair)
        if "texts" in news:
            yield from self._encode_if_new("texts", texts=bench.texts, why=bench.why)

    def _encode_whole(self, bench: Workbench) -> str:
        """Return the message of a new recording."""
        recording = bench.recording()
        self._header, self._live = recording.header, bench.pair is not None
        self._rows = [(0, recording.arrays)]
        self._count = len(bench.pair.live.instants) if bench.pair else 0
        self._revision = bench.revision
        self._latest.pop("texts", None)  # pages delete the texts with the old recording
        return self._join_log()

    def _join_log(self) -> str:
        """Return one message with all instants since the recording began."""
        arrays = _join_recording_rows(self._rows)
        recording = encode_recording_text(self._header, arrays, {"poses"})
        message = _encode_message("recording", recording=recording, live=self._live)
        self._log, self._rows = [message], [(0, arrays)]
        return message

    def _encode_further_rows(self, bench: Workbench, pair: RunPair) -> Iterator[str]:
        """Yield a message of the new instants; after a change, repeat the last sent instant."""
        assert bench.builder is not None
        count, changed = len(pair.live.instants), bench.revision != self._revision
        start = min(self._count, count) - (1 if changed else 0)
        if count == start:
            return
        arrays = bench.builder.collect_arrays(pair.instants(start))
        recording = encode_recording_text({}, arrays, set())
        message = _encode_message("rows", recording=recording, **{"from": start})
        self._count, self._revision = count, bench.revision
        self._rows.append((start, arrays))
        if len(self._log) >= LONGEST:
            self._join_log()
        else:
            self._log = [*self._log, message]
        yield message

    def _encode_if_new(self, kind: str, **content: Any) -> Iterator[str]:
        """Yield a message, unless it equals the last one of its type."""
        message = _encode_message(kind, **content)
        if self._latest.get(kind) != message:
            self._latest = {**self._latest, kind: message}
            yield message


def _join_recording_rows(
    rows: list[tuple[int, dict[str, NDArray[Any]]]],
) -> dict[str, NDArray[Any]]:
    """Return the arrays of a recording with all further rows, and the last arrays without rows."""
    (_, whole), (end, last) = rows[0], rows[-1]
    parts = [last]  # from the last message back; each ends at the first row of the later ones
    for start, arrays in reversed(rows[:-1]):
        count, end = max(end - start, 0), min(start, end)
        parts.append({name: arrays[name][:count] for name in last})
    timed = [name for name in last if not name.endswith(GOAL)]
    arrays_with_rows = {
        name: np.concatenate([part[name] for part in reversed(parts)]) for name in timed
    }
    return whole | last | arrays_with_rows


def _encode_message(kind: str, **content: Any) -> str:
    """Return a message of a type as JSON."""
    return json.dumps({"type": kind, **content}, ensure_ascii=False, allow_nan=False)


def _replace_non_finite(value: Any) -> Any:
    """Return a JSON value with null in place of numbers that are not finite."""
    if isinstance(value, dict):
        return {key: _replace_non_finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_replace_non_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
