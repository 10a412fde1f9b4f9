"""An experiment on the bench: what was changed of it, how it runs, and what it stands beside."""

from __future__ import annotations

from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, said, suggest
from robsim.declare.controls import Control
from robsim.page.film import Film, Instants, Recording, belief_of
from robsim.page.recording import recording_of
from robsim.page.told import texts
from robsim.plot.lacks import tell_lacks
from robsim.plot.moving import Moving
from robsim.run.experiment import Experiment
from robsim.run.outcome import Outcome
from robsim.run.staged import Staged
from robsim.studio.gallery import about
from robsim.studio.handles import Handle, dragged, handles_of
from robsim.studio.live import Live
from robsim.studio.values import checked

AHEAD = 2000  # steps that are looked ahead, to see what will move


class Bench:
    """An experiment, its changes, and its run so far; beside it a second scheme, if any.

    changes  {dotted name: value} since it was opened
    second   the one value in which the second scheme differs: {name: value}, or empty
    made     how often it was changed
    news     what pages do not know yet: "recording", "controls", "texts"

    A mission is not changed on its way: it runs as a whole, and pages play that.
    """

    def __init__(self, experiment: Experiment) -> None:
        self.news: tuple[str, ...] = ()
        self.made = 0
        self.film: Film | None = None
        self.changes: dict[str, Any] = {}
        self.texts: dict[str, str] = {}
        self.open(experiment)

    def open(self, experiment: Experiment) -> None:
        """Take another experiment. InputError: it cannot run, and nothing is changed."""
        self._begin(experiment, {})
        tell_lacks(experiment.scene)
        self.opened, self.changes = experiment, {}
        self._settle(anew=True)

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self.live.now.time if self.live else 0.0

    @property
    def ended(self) -> bool:
        """Whether there is nothing more to come."""
        return self.live is None or (self.live.ended and (self.other is None or self.other.ended))

    @property
    def outcome(self) -> Outcome:
        """Why the run ended, or that it goes on."""
        return self.live.now.outcome if self.live else Outcome.RUNNING

    def step(self) -> None:
        """Take one more instant of both schemes, unless both have ended."""
        if self.live is not None and not self.ended:
            self.live.step()
            if self.other is not None:
                self.other.step()

    def reset(self) -> None:
        """Go back to the start."""
        self._begin(self.experiment, self.second)
        self._settle(anew=True)

    def set(self, name: Any, value: Any) -> None:
        """Give a value of the experiment another one. InputError: it is not possible."""
        control = self._control(name)
        self._change({**control.changes(checked(control, value))}, f"{name} = {_shown(value)}")

    def drag(self, name: Any, pose: Any) -> None:
        """Place what a handle of that name holds. InputError: it is not possible."""
        handle = next((each for each in self.handles if each.name == name), None)
        if handle is None:
            names = [each.name for each in self.handles]
            raise InputError(f"no handle {said(name)}; {suggest(str(name)[:64], names, 'handles')}")
        self._change(dragged(self.experiment, self.controls, handle, pose), f"{name} moved")

    def compare(self, second: Any) -> None:
        """Run a second scheme beside, with one other value: [name, value]; None: no more."""
        chosen: dict[str, Any] = {}
        if second is not None:
            if not isinstance(second, list) or len(second) != 2:
                raise InputError("a second scheme is a pair: name and value")
            control = self._control(second[0])
            chosen = {control.path: checked(control, second[1])}
        self._begin(self.experiment, chosen)
        self._settle(anew=True)

    def explain(self) -> None:
        """Say why the run ended, in the texts."""
        if self.live is not None:
            piece = self.live.piece
            self.texts = {**self._about(), **texts(piece.run(), piece, trials=False)}
            self.news = (*self.news, "texts")

    def recording(self) -> Recording:
        """Return all instants so far as a recording."""
        if self.live is None:
            return self._played
        assert self.film is not None
        told = {"texts": self.texts, "events": self.events}
        return self.film.recording(self.title, self.instants(), **told)

    def instants(self, start: int = 0) -> Instants:
        """Return the instants from a number on."""
        assert self.live is not None
        other = None if self.other is None else self.other
        second = None if other is None else (other.table(start), other.experiment.scene)
        return Instants.of(self.live.table(start), self.experiment.scene, second)

    @property
    def title(self) -> str:
        """What is shown, in a line."""
        return self.experiment.title or "experiment"

    def _control(self, name: Any) -> Control:
        if not isinstance(name, str) or name not in self.controls:
            raise InputError(f"no control {said(name)}; {suggest(name, self.controls, 'controls')}")
        return self.controls[name]

    def _change(self, changes: dict[str, Any], event: str) -> None:
        """Take an experiment with these changes, and go on from here; anew with another start."""
        experiment = self.experiment.at(changes)
        anew = any(name.partition(".")[0] in ("start", "run") for name in changes)
        if anew or self.live is None:
            self._begin(experiment, self.second)
        else:
            anew = self._go_on(experiment)
            self.events.append({"time": self.time, "text": event})
        self.changes |= changes
        self._settle(anew)

    def _begin(self, experiment: Experiment, second: dict[str, Any]) -> None:
        """Start an experiment from its start; InputError leaves all as it was."""
        if isinstance(experiment.task, Staged):
            played = recording_of(experiment.run())
            self.live, self.other, self._played = None, None, played
        else:
            live = Live(experiment)
            self.other = Live(self._beside(experiment, second)) if second else None
            self.live = live
        self.experiment, self.second = experiment, second
        self.events: list[dict[str, Any]] = []
        self.texts = self._about()

    def _go_on(self, experiment: Experiment) -> bool:
        """Go on with another experiment; return whether past instants are of use no more."""
        assert self.live is not None
        anew = self.live.change(experiment)
        if self.other is not None:
            anew = self.other.change(self._beside(experiment, self.second)) or anew
            count = min(len(self.live.instants), len(self.other.instants))
            for each in (self.live, self.other):
                del each.instants[:-count]
        self.experiment, self.texts = experiment, self._about()
        return anew

    def _about(self) -> dict[str, str]:
        """Return what there is to watch for, where the experiment says it."""
        said = about(self.experiment)
        return {"watch for": said} if said else {}

    def _beside(self, experiment: Experiment, second: dict[str, Any]) -> Experiment:
        controls = {each.path: each for each in experiment.controls()}
        (name, value), *_ = second.items()
        if name not in controls:
            raise InputError(f"the second scheme needs {name}, which is gone")
        return experiment.at(controls[name].changes(value))

    def _settle(self, anew: bool) -> None:
        """Note what follows from another experiment: controls, handles, what is shown."""
        self.made += 1
        controls = {each.path: each for each in self.experiment.controls()}
        self.news = (*self.news, "controls", *(("recording",) if anew else ()))
        self.controls: dict[str, Control] = controls
        self.handles: list[Handle] = []
        if self.live is None:
            return
        self.handles = handles_of(self.experiment, controls, self.live.forms)
        film = self._filmed(None if anew else self.film)
        if anew or self.film is None or not film.like(self.film):
            self.news = (*self.news, "recording")
        self.film = film

    def _filmed(self, before: Film | None) -> Film:
        """Return what is shown, in the sizes of before; what moves is found by a look ahead."""
        assert self.live is not None
        q, second = _ahead(self.live.experiment), None
        if self.other is not None:
            q, q_other = _as_long(q, _ahead(self.other.experiment))
            second = Moving.of(self.other.experiment.scene, q_other)
        moving = Moving.of(self.experiment.scene, q, second)
        depth = before.depth if before else None
        return Film(moving, self.live.forms, belief_of(self.experiment), depth)


def _ahead(experiment: Experiment) -> Array:
    """Return the coordinates (T, nq) to which an experiment comes."""
    seconds = min(experiment.duration, AHEAD * experiment.dt)
    q = experiment.run(duration=seconds, record="all")["q"].values
    alive: Array = q[np.isfinite(q).all(axis=1)]
    return alive


def _as_long(*each: Array) -> list[Array]:
    """Return arrays (T, n) of the same T: the shorter ones stay at their last row."""
    most = max(map(len, each))
    return [np.concatenate([q, np.repeat(q[-1:], most - len(q), axis=0)]) for q in each]


def _shown(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else said(value)
