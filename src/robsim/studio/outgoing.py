"""What a studio tells its pages, as JSON texts, and what brings a new page to the present.

recording  {"header", "numbers"}: all so far, as in a file
rows       {"from", "header", "numbers"}: further instants, from that number on
controls   {"controls"}: the values that may be changed, as declared
gallery    {"entries"}: experiments to choose from
texts      {"texts"}
state      what goes on: playing, speed, factor, outcome, note, handles, second, changes
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from robsim.page.document import told
from robsim.run.outcome import Outcome

if TYPE_CHECKING:
    from robsim.studio.bench import Bench
    from robsim.studio.gallery import Shelf
    from robsim.studio.session import Session

AFTER = ("texts", "state")  # what is about the recording
LONGEST = 300  # messages that a new page gets, before they are made one


class Outgoing:
    """The messages that are new, and those that a page needs that connects now."""

    def __init__(self) -> None:
        self._kept: dict[str, str] = {}
        self._log: list[str] = []  # the recording and its further rows
        self._count = 0  # of instants that are told
        self._gone = 0  # of these, no longer kept where the experiment was changed

    def present(self) -> list[str | bytes]:
        """Return what brings a page to the present."""
        kept = self._kept
        late = [kept[kind] for kind in AFTER if kind in kept]
        return [*(kept[kind] for kind in kept if kind not in AFTER), *self._log, *late]

    def news(self, session: Session, bench: Bench, shelf: Shelf) -> Iterator[str]:
        """Yield what pages do not know yet."""
        news, bench.news = bench.news, ()
        if "controls" in news:
            yield from self._new(
                "controls", controls=[_plain(asdict(each)) for each in bench.controls.values()]
            )
        if "recording" in news:
            yield self._whole(bench)
        elif bench.live is not None:
            yield from self._further(bench)
        if "texts" in news:
            yield from self._new("texts", texts=bench.texts)
        yield from self._new("gallery", entries=shelf.entries)
        yield from self._new("state", **_state(session, bench))

    def _whole(self, bench: Bench) -> str:
        recording = bench.recording()
        header, numbers = told(recording.header, recording.arrays, {"poses"})
        live = bench.live is not None
        message = _text("recording", header=header, numbers=numbers, live=live)
        self._count = len(bench.live.instants) if bench.live else 0
        self._log = [message]
        self._made = bench.made
        return message

    def _further(self, bench: Bench) -> Iterator[str]:
        """Yield a message of the instants since the last one, which is told again if changed."""
        assert bench.live is not None and bench.film is not None
        count, changed = len(bench.live.instants), bench.made != self._made
        start = min(self._count, count) - (1 if changed else 0)
        if count == start:
            return
        arrays = bench.film.arrays(bench.instants(start))
        header, numbers = told({}, arrays, set())
        message = _text("rows", header=header, numbers=numbers, **{"from": start})
        self._count, self._made = count, bench.made
        if len(self._log) >= LONGEST:
            self._whole(bench)
        else:
            self._log = [*self._log, message]
        yield message

    def _new(self, kind: str, **content: Any) -> Iterator[str]:
        """Yield a message, unless it is as the last one of its kind."""
        message = _text(kind, **content)
        if self._kept.get(kind) != message:
            self._kept = {**self._kept, kind: message}
            yield message


def _state(session: Session, bench: Bench) -> dict[str, Any]:
    ended = bench.ended and bench.live is not None
    words = bench.outcome.words if ended and bench.outcome != Outcome.RUNNING else ""
    return {
        "playing": session.playing,
        "speed": session.speed,
        "factor": round(session.factor, 2) if session.playing else None,
        "outcome": bench.outcome.name if words else "",
        "ending": f"{words} after {bench.time:.3g} s" if words else "",
        "note": session.note,
        "title": bench.title,
        "second": bench.second,
        "changes": list(bench.changes),
        "handles": [asdict(each) for each in bench.handles],
        "events": bench.events if bench.live else [],
    }


def _text(kind: str, **content: Any) -> str:
    return json.dumps({"type": kind, **content}, ensure_ascii=False, allow_nan=False)


def _plain(value: Any) -> Any:
    """Return a value of JSON, in which what is not finite is null."""
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
