"""What all pages of a studio see together: an experiment that runs, and may be changed."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from robsim.base.errors import InputError, RobSimError, format_value
from robsim.page.html_document import build_live_html
from robsim.page.study_map import build_study_map
from robsim.run.experiment import Experiment
from robsim.studies.study_result import StudyResult
from robsim.studio import downloads
from robsim.studio.control_values import is_json_integer
from robsim.studio.outbound_messages import OutboundMessages
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.web.app import UnavailableDownload
from robsim.studio.workbench import Workbench, explain_live_run

TICK = 1 / 30  # seconds between what is sent
BUSY = 0.025  # seconds of a tick that are spent on steps
PACE = 1.0  # seconds over which the pace is measured
SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 0.0)  # times real time; 0: as fast as it goes


class Session:
    """A simulation in a thread of its own, and the conversation of pages with it.

    It is the `App` of a server: `broadcast` is to be that server's. Whatever a page sends is looked
    at in the thread of the simulation, between two steps, and is told to all pages.

    placed  the bench; None while no run of the study is open
    study   whose runs pages may open, if there is one; `run` is the number of the one that is open
    """

    def __init__(
        self, bench: Workbench | None, shelf: ScenarioShelf, study: StudyResult | None = None
    ) -> None:
        self.placed, self.shelf, self.study = bench, shelf, study
        self.run: int | None = None
        self.broadcast: Callable[[str], None] = lambda message: None
        self.outgoing = OutboundMessages(build_study_map(study) if study else None)
        self.playing, self.speed, self.note = False, 1.0, ""
        self.factor: float | None = None  # times real time
        self._since: tuple[float, float] | None = None  # wall clock and time, to keep pace with
        self._asked: queue.Queue[dict[str, Any]] = queue.Queue(1000)
        self._found: queue.Queue[tuple[int, dict[str, str]]] = queue.Queue()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="robsim-session", daemon=True)

    @property
    def bench(self) -> Workbench:
        """The bench. InputError: no run of the study is open."""
        if self.placed is None:
            raise InputError("no run is open yet: choose one on the map")
        return self.placed

    def start(self) -> None:
        """Begin with the simulation."""
        self.tell_news()
        self._thread.start()

    def close(self) -> None:
        """End the simulation, within two seconds: a step that takes longer ends by itself."""
        self._over.set()
        self._thread.join(2.0)

    # what a server asks for, in its threads

    def page(self) -> str:
        """Return the HTML text of the page."""
        return build_live_html()

    def download(self, name: str) -> tuple[str, bytes] | None:
        """Return media type and content of what can be saved of the experiment; else None.

        Unavailable: there is such a file, but not of this experiment.
        """
        try:
            return downloads.build_download(*self.bench.current, name)
        except InputError as error:
            raise UnavailableDownload(str(error)) from None

    def hello(self) -> list[str | bytes]:
        """Return what brings a page to the present."""
        return self.outgoing.present()

    def receive(self, message: dict[str, Any]) -> str | None:
        """Take what a page asks for."""
        with suppress(queue.Full):  # of a page that asks for more than can be done
            self._asked.put_nowait(message)
        return None

    # the thread of the simulation

    def _run(self) -> None:
        due = time.monotonic()
        while not self._over.is_set():
            due = max(due + TICK, time.monotonic())
            self._do_all(self._wishes(due))
            try:
                if self.playing:
                    self._advance()
                self._hear_further()
                self.tell_news()
            except Exception as error:  # noqa: BLE001  of a user's law, say: the studio goes on
                self.playing = False
                self.note = f"it stops here: {type(error).__name__}: {error}"

    def _wishes(self, due: float) -> list[dict[str, Any]]:
        """Return what is asked for until then, of equal wishes the last."""
        wishes: dict[Any, dict[str, Any]] = {}
        with suppress(queue.Empty):
            while not self._over.is_set():
                left = due - time.monotonic()
                wish = self._asked.get(timeout=left) if left > 0 else self._asked.get_nowait()
                key = _build_request_key(wish)
                wishes.pop(key, None)
                wishes[key] = wish
        return list(wishes.values())

    def _do_all(self, wishes: list[dict[str, Any]]) -> None:
        """Do what pages ask for; what is wrong with any of it is told to all."""
        notes = [self.do(wish) for wish in wishes if not self._over.is_set()]
        if wishes:
            self.note = "\n".join(dict.fromkeys(filter(None, notes)))

    def do(self, wish: dict[str, Any]) -> str:
        """Do what a page asks for; return what is wrong with it, in words."""
        try:
            for name, value in wish.items():
                done = _REQUESTS.get(name)
                if done is None:
                    raise InputError(
                        f"a page asked for {format_value(name)}; known: {', '.join(_REQUESTS)}"
                    )
                self._since = None
                done(self, value)
        except RobSimError as error:
            source = self.placed.experiment.source if self.placed else ""
            return str(error).removeprefix(f"{source}: ")
        except Exception as error:  # noqa: BLE001  a mistake of ours must not end the simulation
            return f"internal error, please report it: {type(error).__name__}: {error}"
        return ""

    def _play(self, value: Any) -> None:
        if value is True and self.bench.full:
            raise InputError("no more instants are kept: go back to the start")
        self.playing = value is True
        if self.playing and self.bench.ended:
            self.bench.reset()

    def _step(self, value: Any) -> None:
        self.playing = False
        count = value if is_json_integer(value) else 1
        for _ in range(min(max(count, 1), 100)):
            self.bench.step()

    def _quicker(self, value: Any) -> None:
        if value not in SPEEDS or isinstance(value, bool):
            raise InputError(f"no speed {format_value(value)}; speeds: {SPEEDS}")
        self.speed = float(value)

    def _run_of_study(self, value: Any) -> None:
        if self.study is None or not is_json_integer(value):
            raise InputError(
                f"a page asked for run {format_value(value)}, and there is no such run"
            )
        self._place(f"run {value}", self.study.of_run(value), value)

    def _place(self, name: str, experiment: Experiment, run: int | None) -> None:
        """Put an experiment on the bench and let it run; `run` is its number in the study."""
        self.note = f"opening {name} …"
        self.tell_news()
        if self.placed is None:
            self.placed = Workbench(experiment)
        else:
            self.placed.open(experiment)
        self.run, self.playing = run, True

    def _advance(self) -> None:
        """Take the steps that are due, or as many as there is time for, and note the factor."""
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
        """Say why the run ended: at once what can be said, and later what would have helped."""
        bench = self.bench
        if bench.pair is None:
            return
        live, experiment, made = bench.pair.live, bench.experiment, bench.made
        bench.explain(explain_live_run(experiment, live, trials=False))

        def further() -> None:
            with suppress(Exception):  # what was said at once stands
                self._found.put((made, explain_live_run(experiment, live, trials=True)))

        threading.Thread(target=further, name="robsim-explaining", daemon=True).start()

    def _hear_further(self) -> None:
        """Take what was found of a run, if that is still the one on the bench."""
        with suppress(queue.Empty):
            made, found = self._found.get_nowait()
            if made == self.bench.made:
                self.bench.explain(found)

    def tell_news(self) -> None:
        """Send what is new to all pages, and keep it for those to come."""
        for message in self.outgoing.news(self, self.placed, self.shelf):
            self.broadcast(message)


def _parse_name_value_pair(value: Any, what: str) -> list[Any]:
    if not isinstance(value, list) or len(value) != 2:
        raise InputError(f"a page {what} a pair: a name, and what it is to be")
    return value


def _build_request_key(wish: dict[str, Any]) -> Any:
    """Return what tells whether a later wish takes the place of this one."""
    name = next(iter(wish), "")
    value = wish.get(name)
    if name in ("set", "drag") and isinstance(value, list) and value:
        return name, str(value[0])
    return (name, id(wish)) if name == "step" else name


_REQUESTS: dict[str, Callable[[Session, Any], None]] = {
    "play": Session._play,
    "step": Session._step,
    "reset": lambda session, _: session.bench.reset(),
    "set": lambda session, value: session.bench.set(*_parse_name_value_pair(value, "sets")),
    "drag": lambda session, value: session.bench.drag(*_parse_name_value_pair(value, "drags")),
    "second": lambda session, value: session.bench.compare(value),
    "speed": Session._quicker,
    "open": lambda session, name: session._place(str(name), session.shelf.experiment(name), None),
    "run": Session._run_of_study,
}
