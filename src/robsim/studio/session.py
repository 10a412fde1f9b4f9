"""The session of a studio: a running experiment that all pages show and can change."""

from __future__ import annotations

import json
import queue
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from robsim.base.errors import InputError, RobSimError, format_value
from robsim.page.html_document import build_live_html
from robsim.page.recording_builder import Recording
from robsim.page.study_map import build_study_map
from robsim.run.experiment import Experiment
from robsim.studies.study_result import StudyResult
from robsim.studio import downloads
from robsim.studio.control_values import is_json_integer
from robsim.studio.interaction_message import InteractionMessages
from robsim.studio.live_explanation import add_search_note, explain_live_run
from robsim.studio.live_pictures import LivePictures
from robsim.studio.outbound_messages import OutboundMessages
from robsim.studio.refusal_reasons import format_refusal
from robsim.studio.request_queue import RequestQueue
from robsim.studio.rounded_values import list_control_units
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.web.app import UnavailableDownload
from robsim.studio.workbench import Workbench

TICK = 1 / 30  # seconds between simulation steps and their messages
BUSY = 0.025  # seconds for simulation steps in a tick
LAST_STEP = 0.5  # seconds until a step that has begun is abandoned at the end
LAST_CHANGES = 60.0  # seconds that a file waits for requested changes
CALM = 0.3  # seconds without requests until a run that does not play is explained
PACE = 1.0  # interval for measuring the speed, seconds
SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 0.0)  # times real time; 0 is the maximum speed


class Session:
    """A simulation in its own thread, and its communication with pages.

    A session is the `App` of a server; `broadcast` must be set to the method of this server. The
    thread of the simulation handles the requests of pages between two steps, and sends the results
    to all pages.

    Attributes
    ----------
    open_bench : Workbench or None
        The experiment; None until a run of the study is opened.
    study : StudyResult or None
        Study with runs that pages can open.
    run : int or None
        Number of the open run of the study.
    """

    def __init__(
        self, bench: Workbench | None, shelf: ScenarioShelf, study: StudyResult | None = None
    ) -> None:
        self.open_bench, self.shelf, self.study = bench, shelf, study
        self.run: int | None = None
        self.broadcast: Callable[[str], None] = lambda message: None
        self.outgoing = OutboundMessages(build_study_map(study) if study else None)
        self.playing, self.speed, self.note = False, 1.0, ""
        self.handled = 0  # number of requests that were handled
        self.refusals: dict[str, str] = {}  # reason by the path of a control, or by handle
        self._played_to_end = False
        self._last_request = 0.0
        self._explained = -1  # revision of the bench whose run was explained
        self.matrices = InteractionMessages()
        self.pictures = LivePictures(self._send_picture)
        self.factor: float | None = None  # times real time
        self._since: tuple[float, float] | None = None  # wall clock and simulated time
        self._requests = RequestQueue(_build_request_key)
        self._explanations: queue.Queue[tuple[int, dict[str, Any]]] = queue.Queue()
        self._using_bench = threading.Lock()  # the simulation and the files read the same bench
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._simulate, name="robsim-session", daemon=True)

    @property
    def bench(self) -> Workbench:
        """The experiment; raises InputError if no run of the study is open."""
        if self.open_bench is None:
            raise InputError("no run is open yet: choose one on the map")
        return self.open_bench

    def start(self) -> None:
        """Start the simulation."""
        self.send_news()
        self._thread.start()

    def close(self) -> None:
        """End the simulation within half a second; a longer step ends with the process."""
        self._over.set()
        self._thread.join(LAST_STEP)
        self.pictures.close()

    # methods that the server calls in its threads

    def page(self) -> str:
        """Return the HTML text of the page."""
        return build_live_html()

    def download(self, name: str) -> tuple[str, bytes] | None:
        """Return media type and content of a file of the experiment; None for an unknown name.

        The file has all changes that pages have requested before. The file pictures.json has the
        pictures of the gallery. Raise UnavailableDownload if this
        experiment does not have the file.
        """
        if name == "pictures.json":
            return "application/json", json.dumps(self.shelf.pictures()).encode()
        if self._thread.is_alive():
            self._requests.wait(LAST_CHANGES)
        try:
            return downloads.build_download(self._get_saved_experiment(), self._record, name)
        except RobSimError as error:
            raise UnavailableDownload(str(error)) from None

    def file_name(self, name: str) -> str:
        """Return the name under which a browser stores a file."""
        bench = self.open_bench
        return downloads.format_file_name(bench.experiment if bench else None, name)

    def _get_saved_experiment(self) -> Experiment:
        """Return the experiment of the files; raise InputError if no run of the study is open."""
        with self._using_bench:
            return self.bench.saved_experiment()

    def _record(self) -> Recording:
        """Return the recording of all that is on the screen."""
        with self._using_bench:
            return self.bench.recording()

    def hello(self) -> list[str | bytes]:
        """Return the messages that bring a page up to date."""
        return self.outgoing.present()

    def receive(self, message: dict[str, Any]) -> str | None:
        """Store a request of a page for the simulation thread."""
        self._requests.put(message)
        return None

    # methods of the simulation thread

    def _simulate(self) -> None:
        """Answer requests as they arrive, and advance the simulation at each `TICK`."""
        due = time.monotonic()  # of the next simulation steps
        while not self._over.is_set():
            requests = self._requests.take(max(due - time.monotonic(), 0.0))
            with self._using_bench:
                self._handle_requests(requests)
            self._requests.finish()
            now = time.monotonic()
            is_due, due = now >= due, max(due + TICK, now) if now >= due else due
            try:
                with self._using_bench:
                    if self.playing and is_due:
                        self._advance()
                    elif not self.playing:
                        self._explain_end(requests)
                self._store_explanation()
                self.send_news()
            except Exception as error:  # noqa: BLE001  such as an error in a user's law
                self.playing = False
                self.note = f"the simulation stopped: {type(error).__name__}: {error}"

    def _handle_requests(self, requests: list[dict[str, Any]]) -> None:
        """Handle the requests of pages, and store their error messages for all pages."""
        for look in [each for each in requests if each.keys() in _LOOKS]:
            requests.remove(look)  # it changes nothing, so notes and speed remain
            if "picture" in look:
                self.pictures.request(self.open_bench, look["picture"])
                continue
            message = self.matrices.build(self.open_bench, look["interaction"])
            self.broadcast(json.dumps(message, allow_nan=False))
        notes = [self.do(request) for request in requests if not self._over.is_set()]
        self.handled += len(notes)
        if requests:
            self.note = "\n".join(dict.fromkeys(filter(None, notes)))

    def do(self, request: dict[str, Any]) -> str:
        """Handle a request of a page; return the error message, or ""."""
        paths = _list_changed_paths(request)
        for path in paths:
            self.refusals.pop(path, None)
        try:
            for name, value in request.items():
                action = _REQUESTS.get(name)
                if action is None:
                    raise InputError(
                        f"unknown request {format_value(name)}; requests: {', '.join(_REQUESTS)}"
                    )
                self._since = None
                action(self, value)
        except RobSimError as error:
            reason = self._describe_refusal(error, paths)
            self.refusals |= {path: _strip_path(reason, path) for path in paths}
            return reason
        except Exception as error:  # noqa: BLE001  an internal error must not end the simulation
            return f"internal error, please report it: {type(error).__name__}: {error}"
        if request.keys() & _EDITS:
            self._resume_after_edit()
        return ""

    def _describe_refusal(self, error: RobSimError, paths: list[str]) -> str:
        """Return the message of an error as pages show it, without file names."""
        bench = self.open_bench
        source = bench.experiment.source if bench else ""
        text = str(error).replace(f"{source}: ", "") if source else str(error)
        controls = bench.controls if bench else {}
        known = [controls[path] for path in paths if path in controls]
        units = {unit for each in known for unit in list_control_units(each)}
        return format_refusal(text, *(units if len(units) == 1 else ()))

    def _resume_after_edit(self) -> None:
        """Play again if the edit started a run over that had been played to its end."""
        self.refusals.clear()
        if self._played_to_end and not self.bench.ended:
            self.playing, self._played_to_end = True, False

    def _play(self, value: Any) -> None:
        """Play or pause; start again after the end."""
        self.playing, self._played_to_end = value is True, False
        if self.playing and self.bench.ended:
            self.bench.reset()

    def _step(self, value: Any) -> None:
        """Pause, and take one or more steps."""
        self.playing = False
        count = value if is_json_integer(value) else 1
        for _ in range(min(max(count, 1), 100)):
            self.bench.step()

    def _set_speed(self, value: Any) -> None:
        """Set the speed; raise InputError unless it is one of `SPEEDS`."""
        if value not in SPEEDS or isinstance(value, bool):
            raise InputError(f"no speed {format_value(value)}; speeds: {SPEEDS}")
        self.speed = float(value)

    def _open_study_run(self, value: Any) -> None:
        """Open a run of the study."""
        if self.study is None or not is_json_integer(value):
            raise InputError(f"no run {format_value(value)} in this study")
        self._open_experiment(f"run {value}", self.study.of_run(value), value)

    def _open_experiment(self, name: str, experiment: Experiment, run: int | None) -> None:
        """Open an experiment and play it; `run` is its number in the study."""
        self.note = f"opening {name} …"
        self.send_news()
        if self.open_bench is None:
            self.open_bench = Workbench(experiment)
        else:
            self.open_bench.open(experiment)
        self.run, self.playing, self._played_to_end = run, True, False
        self.refusals.clear()

    def _advance(self) -> None:
        """Simulate the steps that are due, as far as time permits, and measure the speed."""
        if not self.bench.idle:
            self._simulate_due_steps()
        if self.bench.idle:
            self._since = self.factor = None
            if self.bench.ended:
                self.playing, self._played_to_end = False, True
            self._explain()

    def _simulate_due_steps(self) -> None:
        """Simulate until the time that is due, at most for `BUSY` seconds of wall clock."""
        began = time.monotonic()
        wall, start = self._since or (began, self.bench.time)
        until = start + (began - wall + TICK) * self.speed if self.speed else float("inf")
        while self.bench.time < until and not self.bench.idle:
            self.bench.step()
            if time.monotonic() - began > BUSY:
                break
        now = time.monotonic()
        self.factor = (self.bench.time - start) / (now - wall) if now - wall > PACE / 4 else None
        late = self.bench.time < until
        renew = self._since is None or late or now - wall > PACE
        self._since = (now, self.bench.time) if renew and self.factor else (wall, start)

    def _explain_end(self, requests: list[dict[str, Any]]) -> None:
        """Explain why a run ended that does not play, once no request arrives for a while."""
        now = time.monotonic()
        self._last_request = now if requests else self._last_request
        if self.open_bench and self.open_bench.idle and now - self._last_request > CALM:
            self._explain()

    def _explain(self) -> None:
        """Explain why the run ended: immediately from its data, later with trials in a thread."""
        bench = self.bench
        if bench.pair is None or self._explained == bench.revision:
            return
        self._explained = bench.revision
        live, experiment, revision = bench.pair.live, bench.experiment, bench.revision
        first = explain_live_run(experiment, live, trials=False)
        bench.explain(add_search_note(first))

        def add_trials() -> None:
            explanation = first
            with suppress(Exception):  # the first explanation remains
                explanation = explain_live_run(experiment, live, trials=True)
            self._explanations.put((revision, explanation))

        threading.Thread(target=add_trials, name="robsim-explaining", daemon=True).start()

    def _store_explanation(self) -> None:
        """Store an explanation with trials, if its run is still open."""
        with suppress(queue.Empty):
            revision, explanation = self._explanations.get_nowait()
            if revision == self.bench.revision:
                self.bench.explain(explanation)

    def _send_picture(self, message: str) -> None:
        """Send a picture to all pages, from the thread of the pictures."""
        self.broadcast(message)

    def send_news(self) -> None:
        """Send new messages to all pages, and store them for new pages."""
        for message in self.outgoing.news(self, self.open_bench, self.shelf):
            self.broadcast(message)


def _parse_change(value: Any, request: str) -> list[Any]:
    """Return [name, value] or [name, value, stroke] of a request; raise InputError otherwise."""
    if not isinstance(value, list) or len(value) not in (2, 3):
        raise InputError(f"{request}: expected [name, value], got {format_value(value)}")
    return value


def _build_request_key(request: dict[str, Any]) -> Any:
    """Return the key of a request; a later request with the same key replaces it."""
    name = next(iter(request), "")
    value = request.get(name)
    if name in ("set", "drag") and isinstance(value, list) and value:
        return name, str(value[0])
    if name == "picture":  # of another camera, or for another page
        return name, str(value)
    return (name, id(request)) if name in ("step", "undo", "redo", "change") else name


def _list_changed_paths(request: dict[str, Any]) -> list[str]:
    """Return the paths of controls and the names of handles that a request changes."""
    paths: list[str] = []
    for name in ("set", "drag", "second", "change"):
        value = request.get(name)
        if isinstance(value, list) and value and isinstance(value[0], str):
            paths.append(value[0])
        elif isinstance(value, dict):
            paths += [path for path in value if isinstance(path, str)]
    return paths


def _strip_path(reason: str, path: str) -> str:
    """Return a reason without the path at its start, beside which it is shown."""
    return reason.removeprefix(f"{path}: ")


_LOOKS = ({"interaction"}, {"picture"})
_EDITS = {"set", "drag", "change", "show_goal", "undo", "redo", "original", "second"}
_REQUESTS: dict[str, Callable[[Session, Any], None]] = {
    "play": Session._play,
    "step": Session._step,
    "reset": lambda session, _: session.bench.reset(),
    "set": lambda session, value: session.bench.set(*_parse_change(value, "set")),
    "drag": lambda session, value: session.bench.drag(*_parse_change(value, "drag")),
    "change": lambda session, value: session.bench.change(value),
    "show_goal": lambda session, value: session.bench.show_goal(value),
    "undo": lambda session, _: session.bench.undo(),
    "redo": lambda session, _: session.bench.redo(),
    "original": lambda session, _: session.bench.restore_original(),
    "second": lambda session, value: session.bench.compare(value),
    "speed": Session._set_speed,
    "open": lambda session, name: session._open_experiment(
        str(name), session.shelf.experiment(name), None
    ),
    "run": Session._open_study_run,
}
