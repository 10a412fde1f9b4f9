"""The session of a studio: a running experiment that all pages show and can change."""

from __future__ import annotations

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
from robsim.studio.live_explanation import explain_live_run
from robsim.studio.outbound_messages import OutboundMessages
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.web.app import UnavailableDownload
from robsim.studio.workbench import Workbench

TICK = 1 / 30  # seconds between messages
BUSY = 0.025  # seconds for simulation steps in a tick
LAST_STEP = 0.5  # seconds until a step that has begun is abandoned at the end
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
        self.factor: float | None = None  # times real time
        self._since: tuple[float, float] | None = None  # wall clock and simulated time
        self._requests: queue.Queue[dict[str, Any]] = queue.Queue(1000)
        self._explanations: queue.Queue[tuple[int, dict[str, str]]] = queue.Queue()
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

    # methods that the server calls in its threads

    def page(self) -> str:
        """Return the HTML text of the page."""
        return build_live_html()

    def download(self, name: str) -> tuple[str, bytes] | None:
        """Return media type and content of a file of the experiment; None for an unknown name.

        Raise UnavailableDownload if this experiment does not have the file.
        """
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
        with suppress(queue.Full):  # a page that sends too many requests loses some
            self._requests.put_nowait(message)
        return None

    # methods of the simulation thread

    def _simulate(self) -> None:
        """Advance the simulation, handle requests and send news until the session is closed."""
        due = time.monotonic()
        while not self._over.is_set():
            due = max(due + TICK, time.monotonic())
            requests = self._collect_requests(due)
            with self._using_bench:
                self._handle_requests(requests)
            try:
                if self.playing:
                    with self._using_bench:
                        self._advance()
                self._store_explanation()
                self.send_news()
            except Exception as error:  # noqa: BLE001  such as an error in a user's law
                self.playing = False
                self.note = f"the simulation stopped: {type(error).__name__}: {error}"

    def _collect_requests(self, due: float) -> list[dict[str, Any]]:
        """Return the requests that arrive until a time, only the last one of each key."""
        requests: dict[Any, dict[str, Any]] = {}
        with suppress(queue.Empty):
            while not self._over.is_set():
                left = due - time.monotonic()
                item = self._requests.get(timeout=left) if left > 0 else self._requests.get_nowait()
                key = _build_request_key(item)
                requests.pop(key, None)
                requests[key] = item
        return list(requests.values())

    def _handle_requests(self, requests: list[dict[str, Any]]) -> None:
        """Handle the requests of pages, and store their error messages for all pages."""
        notes = [self.do(request) for request in requests if not self._over.is_set()]
        if requests:
            self.note = "\n".join(dict.fromkeys(filter(None, notes)))

    def do(self, request: dict[str, Any]) -> str:
        """Handle a request of a page; return the error message, or ""."""
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
            source = self.open_bench.experiment.source if self.open_bench else ""
            return str(error).removeprefix(f"{source}: ")
        except Exception as error:  # noqa: BLE001  an internal error must not end the simulation
            return f"internal error, please report it: {type(error).__name__}: {error}"
        return ""

    def _play(self, value: Any) -> None:
        """Play or pause; start again after the end."""
        if value is True and self.bench.full:
            raise InputError("no more instants can be stored: reset the run")
        self.playing = value is True
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
        self.run, self.playing = run, True

    def _advance(self) -> None:
        """Simulate the steps that are due, as far as time permits, and measure the speed."""
        began = time.monotonic()
        wall, start = self._since or (began, self.bench.time)
        until = start + (began - wall + TICK) * self.speed if self.speed else float("inf")
        while self.bench.time < until and not self.bench.ended:
            self.bench.step()
            if time.monotonic() - began > BUSY:
                break
        now = time.monotonic()
        self.factor = (self.bench.time - start) / (now - wall) if now - wall > PACE / 4 else None
        late = self.bench.time < until
        renew = self._since is None or late or now - wall > PACE
        self._since = (now, self.bench.time) if renew and self.factor else (wall, start)
        if self.bench.ended:
            self.playing = False
            self._explain()

    def _explain(self) -> None:
        """Explain why the run ended: immediately from its data, later with trials in a thread."""
        bench = self.bench
        if bench.pair is None:
            return
        live, experiment, revision = bench.pair.live, bench.experiment, bench.revision
        bench.explain(explain_live_run(experiment, live, trials=False))

        def add_trials() -> None:
            with suppress(Exception):  # the first explanation remains
                self._explanations.put((revision, explain_live_run(experiment, live, trials=True)))

        threading.Thread(target=add_trials, name="robsim-explaining", daemon=True).start()

    def _store_explanation(self) -> None:
        """Store an explanation with trials, if its run is still open."""
        with suppress(queue.Empty):
            revision, explanation = self._explanations.get_nowait()
            if revision == self.bench.revision:
                self.bench.explain(explanation)

    def send_news(self) -> None:
        """Send new messages to all pages, and store them for new pages."""
        for message in self.outgoing.news(self, self.open_bench, self.shelf):
            self.broadcast(message)


def _parse_name_value_pair(value: Any, request: str) -> list[Any]:
    """Return [name, value] of a request; raise InputError unless it is such a list."""
    if not isinstance(value, list) or len(value) != 2:
        raise InputError(f"{request}: expected [name, value], got {format_value(value)}")
    return value


def _build_request_key(request: dict[str, Any]) -> Any:
    """Return the key of a request; a later request with the same key replaces it."""
    name = next(iter(request), "")
    value = request.get(name)
    if name in ("set", "drag") and isinstance(value, list) and value:
        return name, str(value[0])
    return (name, id(request)) if name == "step" else name


_REQUESTS: dict[str, Callable[[Session, Any], None]] = {
    "play": Session._play,
    "step": Session._step,
    "reset": lambda session, _: session.bench.reset(),
    "set": lambda session, value: session.bench.set(*_parse_name_value_pair(value, "set")),
    "drag": lambda session, value: session.bench.drag(*_parse_name_value_pair(value, "drag")),
    "second": lambda session, value: session.bench.compare(value),
    "speed": Session._set_speed,
    "open": lambda session, name: session._open_experiment(
        str(name), session.shelf.experiment(name), None
    ),
    "run": Session._open_study_run,
}
