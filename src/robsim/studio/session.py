"""What all pages of a studio see together: an experiment that runs, and may be changed."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from robsim.base.errors import InputError, RobSimError, said
from robsim.page.document import live_document
from robsim.studio import downloads
from robsim.studio.bench import Bench
from robsim.studio.gallery import Shelf
from robsim.studio.outgoing import Outgoing

TICK = 1 / 30  # seconds between what is sent
BUSY = 0.025  # seconds of a tick that are spent on steps
SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 0.0)  # times real time; 0: as fast as it goes


class Session:
    """A simulation in a thread of its own, and the conversation of pages with it.

    It is the `App` of a server: `broadcast` is to be that server's. Whatever a page sends is looked
    at in the thread of the simulation, between two steps, and is told to all pages.
    """

    def __init__(self, bench: Bench, shelf: Shelf) -> None:
        self.bench, self.shelf = bench, shelf
        self.broadcast: Callable[[str], None] = lambda message: None
        self.outgoing = Outgoing()
        self.playing, self.speed, self.factor, self.note = False, 1.0, 1.0, ""
        self._asked: queue.Queue[dict[str, Any] | None] = queue.Queue(1000)
        self._thread = threading.Thread(target=self._run, name="robsim-session", daemon=True)

    def start(self) -> None:
        """Begin with the simulation."""
        self._tell_all()
        self._thread.start()

    def close(self) -> None:
        """End the simulation."""
        self._asked.put(None)
        self._thread.join()

    # what a server asks for, in its threads

    def page(self) -> str:
        """Return the HTML text of the page."""
        return live_document()

    def download(self, name: str) -> tuple[str, bytes] | None:
        """Return media type and content of what can be saved of the experiment; else None."""
        return downloads.made(self.bench.experiment, self.bench.changes, name)

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
        while True:
            due = max(due + TICK, time.monotonic())
            if not self._heard(due):
                return
            if self.playing:
                self._advance()
            self._tell_news()

    def _heard(self, due: float) -> bool:
        """Do what was asked until then, of equal wishes the last; return False to end."""
        wishes: dict[Any, dict[str, Any]] = {}
        with suppress(queue.Empty):
            while True:
                left = due - time.monotonic()
                wish = self._asked.get(timeout=left) if left > 0 else self._asked.get_nowait()
                if wish is None:
                    return False
                key = _key(wish)
                wishes.pop(key, None)
                wishes[key] = wish
        for wish in wishes.values():
            self._do(wish)
        return True

    def _do(self, wish: dict[str, Any]) -> None:
        """Do what a page asks for; what is wrong with it is told to all."""
        self.note = ""
        try:
            for name, value in wish.items():
                done = _WISHES.get(name)
                if done is None:
                    raise InputError(f"a page asked for {said(name)}; known: {', '.join(_WISHES)}")
                done(self, value)
        except RobSimError as error:
            self.note = str(error).removeprefix(f"{self.bench.experiment.source}: ")
        except Exception as error:  # noqa: BLE001  a mistake of ours must not end the simulation
            self.note = f"internal error, please report it: {type(error).__name__}: {error}"

    def _play(self, value: Any) -> None:
        self.playing = value is True
        if self.playing and self.bench.ended:
            self.bench.reset()
        self._since = None

    def _step(self, value: Any) -> None:
        self.playing = False
        self.bench.step()

    def _reset(self, value: Any) -> None:
        self.bench.reset()
        self._since = None

    def _set(self, value: Any) -> None:
        if not isinstance(value, list) or len(value) != 2:
            raise InputError("a page sets a pair: name and value")
        self.bench.set(*value)
        self._since = None

    def _drag(self, value: Any) -> None:
        if not isinstance(value, list) or len(value) != 2:
            raise InputError("a page drags a pair: name and pose")
        self.bench.drag(*value)
        self._since = None

    def _second(self, value: Any) -> None:
        self.bench.compare(value)
        self._since = None

    def _quicker(self, value: Any) -> None:
        if value not in SPEEDS:
            raise InputError(f"no speed {said(value)}; speeds: {SPEEDS}")
        self.speed, self._since = float(value), None

    def _open(self, value: Any) -> None:
        self.bench.open(self.shelf.experiment(value))
        self.playing, self._since = True, None

    _since: tuple[float, float] | None = None  # wall clock and time from which it is paced

    def _advance(self) -> None:
        """Take the steps that are due, or as many as there is time for, and note the factor."""
        began = time.monotonic()
        if self._since is None:
            self._since = began, self.bench.time
        wall, start = self._since
        until = start + (began - wall) * self.speed if self.speed else float("inf")
        while self.bench.time < until and not self.bench.ended:
            self.bench.step()
            if time.monotonic() - began > BUSY:
                break
        behind = self.speed and self.bench.time < until
        if began > wall:
            self.factor = (self.bench.time - start) / (began - wall)
        if behind or (began - wall) > 1.0:
            self._since = began, self.bench.time
        if self.bench.ended:
            self.playing = False
            self.bench.explain()

    # what is told

    def _tell_all(self) -> None:
        self.bench.news = "recording", "controls"
        self._tell_news()

    def _tell_news(self) -> None:
        """Send what is new to all pages, and keep it for those to come."""
        for message in self.outgoing.news(self, self.bench, self.shelf):
            self.broadcast(message)


def _key(wish: dict[str, Any]) -> Any:
    """Return what tells whether a later wish takes the place of this one."""
    name = next(iter(wish), "")
    value = wish.get(name)
    if name in ("set", "drag") and isinstance(value, list) and value:
        return name, str(value[0])
    return (name, id(wish)) if name == "step" else name


_WISHES: dict[str, Callable[[Session, Any], None]] = {
    "play": Session._play,
    "step": Session._step,
    "reset": Session._reset,
    "set": Session._set,
    "drag": Session._drag,
    "second": Session._second,
    "speed": Session._quicker,
    "open": Session._open,
}
Wishes: Sequence[str] = tuple(_WISHES)
