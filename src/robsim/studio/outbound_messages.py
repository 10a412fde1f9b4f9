"""Messages of a studio to its pages, as JSON texts.

The messages, by type:

* study: {"recording"}, the map of a study. It is sent first and does not change.
* shapes: {"recording"}, arrays of triangles, edges and points by name, without instants. A shape is
  sent once, and kept while an entry of the header names it; "starts" in the header of the message
  has the number of the first point of each array, because a large shape is divided.
* recording: {"recording", "live"}, header and first instants, as in a file, but without shapes and
  texts.
* entries: {"header"}, the changes of the header: {"value"}, or the length of a list and its changed
  entries [index, entry].
* rows: {"from", "recording"}, the instants from number "from" on; 0 starts the run anew. Frames
  that are not in the arrays of earlier instants have no pose there.
* controls: {"controls", "from", "count"}, the values that a page can change, with their
  declarations, in parts.
* values: {"controls"}, the controls that have changed.
* gallery: {"entries"}, experiments to choose from.
* texts: {"texts", "why"}, texts by heading, and the explanation with its actions.
* picture: {"camera", "index", "mode", "image"}, an answer to a page; see
  `robsim.studio.live_pictures`.
* state: playing, speed, factor, outcome, ending, note, second, changes, handles, and run (the
  number of the open run of the study).
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any

from robsim.page.html_document import encode_recording_text
from robsim.studio.message_text import LARGEST, encode_message
from robsim.studio.scene_messages import SceneMessages, split_shapes
from robsim.studio.session_state import SessionView, build_session_state

if TYPE_CHECKING:
    from robsim.declare.controls import Control
    from robsim.page.recording_builder import Recording
    from robsim.studio.run_pair import RunPair
    from robsim.studio.scenario_shelf import ScenarioShelf
    from robsim.studio.workbench import Workbench

DescribedControl = tuple["Control", dict[str, Any]]  # a control, and its fields; Any: JSON

AFTER = ("texts", "state")  # types that are sent after the recording
FAST = 1  # compression level of a map; its numbers hardly repeat


class OutboundMessages:
    """The new messages of a studio, and the messages that a new page needs."""

    def __init__(self, study: Recording | None = None) -> None:
        self._study: list[str] = []
        if study:
            recording = encode_recording_text(study.header, study.arrays, set(), FAST)
            self._study.append(encode_message("study", recording=recording))
        self._latest: dict[str, str] = {}  # by type
        self._scene = SceneMessages()
        self._controls: dict[str, DescribedControl] = {}  # by path
        self._count = 0  # number of sent instants
        self._revision = -1  # revision of the bench when the last instants were sent

    def present(self) -> list[str | bytes]:
        """Return the messages that bring a page up to date."""
        latest, log = self._latest, self._scene.log
        late = [latest[kind] for kind in AFTER if kind in latest]
        early = [latest[kind] for kind in latest if kind not in AFTER]
        controls = _encode_controls(self._controls)
        return [*self._study, *controls, *early, *log.list_messages(), *late]

    def news(
        self, session: SessionView, bench: Workbench | None, shelf: ScenarioShelf
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
            yield from self._encode_changed_controls(bench.controls.values())
        if bench.pair is not None:
            yield from self._encode_instants(bench, bench.pair, "recording" in news)
        elif "recording" in news:
            yield from self._encode_mission(bench)
        if "texts" in news:
            yield from self._encode_if_new("texts", texts=bench.texts, why=bench.why)

    def _encode_changed_controls(self, controls: Iterable[Control]) -> Iterator[str]:
        """Yield the messages of the controls with other values, or of all if others exist."""
        before = self._controls
        now: dict[str, DescribedControl] = {}
        for each in controls:
            known = before.get(each.path)
            is_known = known is not None and known[0] == each
            now[each.path] = known if known and is_known else (each, _describe_control(each))
        self._controls = now
        if list(before) != list(now):
            yield from _encode_controls(now)
        elif changed := [each for path, each in now.items() if each is not before[path]]:
            yield encode_message("values", controls=[entry for _, entry in changed])

    def _encode_mission(self, bench: Workbench) -> Iterator[str]:
        """Yield the messages of a mission as a whole."""
        recording = bench.recording()
        header = {**recording.header, "texts": {}}
        shapes, arrays = split_shapes(header, recording.arrays)
        self._latest.pop("texts", None)  # pages delete the texts with the old recording
        yield from self._scene.open(header, shapes, arrays, live=False)

    def _encode_instants(self, bench: Workbench, pair: RunPair, fresh: bool) -> Iterator[str]:
        """Yield the messages of new instants; after a change, repeat the last sent instant.

        A `fresh` run starts anew. A page that cannot show it gets a new recording.
        """
        count, changed = len(pair.live.instants), bench.revision != self._revision
        start = 0 if fresh else min(self._count, count) - (1 if changed else 0)
        if count == start:
            return
        assert bench.builder is not None
        builder, instants = bench.builder, pair.instants(start)
        arrays = builder.collect_arrays(instants)
        self._count, self._revision = count, bench.revision
        if changed or fresh:
            header = builder.build_header(bench.experiment.title or "experiment", instants)
            shapes = builder.shapes.arrays
            if not self._scene.can_change_to(header, arrays):
                self._latest.pop("texts", None)
                whole = builder.collect_arrays(pair.instants()) if start else arrays
                yield from self._scene.open(header, shapes, whole, live=True)
                return
            yield from self._scene.change(header, shapes)
        yield from self._scene.extend(start, arrays)

    def _encode_if_new(self, kind: str, **content: Any) -> Iterator[str]:
        """Yield a message, unless it equals the last one of its type."""
        message = encode_message(kind, **content)
        if self._latest.get(kind) != message:
            self._latest = {**self._latest, kind: message}
            yield message


def _describe_control(control: Control) -> dict[str, Any]:
    """Return the fields of a control, with null in place of numbers that are not finite."""
    fields = {name: x for name, x in vars(control).items() if name not in ("items", "starters")}
    return {name: _replace_non_finite(value) for name, value in fields.items()}


def _encode_controls(controls: dict[str, DescribedControl]) -> list[str]:
    """Return the messages of all controls, in parts that are small enough."""
    entries, room = [entry for _, entry in controls.values()], 0
    parts: list[list[dict[str, Any]]] = []
    for entry in entries:
        size = len(json.dumps(entry, ensure_ascii=False)) + 2
        if size > room:
            parts.append([])
            room = LARGEST - 200
        parts[-1].append(entry)
        room -= size
    starts = [sum(len(part) for part in parts[:i]) for i in range(len(parts))]
    return [
        encode_message("controls", controls=part, **{"from": start}, count=len(entries))
        for part, start in zip(parts, starts, strict=True)
    ]


def _replace_non_finite(value: Any) -> Any:
    """Return a JSON value with null in place of numbers that are not finite."""
    if isinstance(value, dict):
        return {key: _replace_non_finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_replace_non_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
