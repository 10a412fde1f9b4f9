"""An experiment on the bench: what was changed of it, how it runs, and what it stands beside."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from robsim.base.errors import InputError, format_value
from robsim.declare.controls import Control
from robsim.declare.name_lookup import suggest_dotted_names
from robsim.page.curves_and_texts import collect_run_texts
from robsim.page.recording_builder import Recording, RecordingBuilder
from robsim.page.recordings import build_recording
from robsim.plot.missing_meshes import warn_missing_meshes
from robsim.run.experiment import Experiment
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.studio.control_values import check_control_value
from robsim.studio.handles import Handle, compute_drag_changes, list_handles
from robsim.studio.live_run import LiveRun
from robsim.studio.run_pair import RunPair
from robsim.studio.scenario_shelf import read_experiment_remark

ANEW = ("start", "run")  # what is changed of these is seen from the start alone


class Workbench:
    """An experiment, its changes, and its run so far; beside it a second scheme, if any.

    current  the experiment, and {dotted name: value} of what was changed since it was opened
    second   the one value in which the second scheme differs: {name: value}, or empty
    made     how often it was changed
    news     what pages do not know yet: "recording", "controls", "texts"

    A mission is not changed on its way: it runs as a whole, and pages play that. Whatever is
    refused by an error has changed nothing.
    """

    def __init__(self, experiment: Experiment) -> None:
        self.news: set[str] = set()
        self.made = 0
        self.film: RecordingBuilder | None = None
        self.open(experiment)

    def open(self, experiment: Experiment) -> None:
        """Take another experiment. InputError: it cannot run."""
        self._take(experiment, {}, {}, None, read_experiment_remark(experiment))
        warn_missing_meshes(experiment.scene)

    @property
    def experiment(self) -> Experiment:
        """The experiment as it is now."""
        return self.current[0]

    @property
    def changes(self) -> Mapping[str, Any]:
        """What was changed of it since it was opened."""
        return self.current[1]

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self.pair.live.now.time if self.pair else 0.0

    @property
    def ended(self) -> bool:
        """Whether there is nothing more to come."""
        return self.pair is None or self.pair.ended

    @property
    def full(self) -> bool:
        """Whether it goes no further because no more instants are kept."""
        return self.pair is not None and self.pair.ended and self.pair.end is None

    def step(self) -> None:
        """Take one more instant of both schemes, unless both have ended."""
        if self.pair is not None and not self.pair.ended:
            self.pair.step()

    def reset(self) -> None:
        """Go back to the start."""
        self._take(*self.current, self.second, None, self._about)

    def set(self, name: Any, value: Any) -> None:
        """Give a value of the experiment another one. InputError: it is not possible."""
        control = self._control(name)
        self._change(control.changes(check_control_value(control, value)))

    def drag(self, name: Any, pose: Any) -> None:
        """Place what a handle of that name holds. InputError: it is not possible."""
        handle = next((each for each in self.handles if each.name == name), None)
        if handle is None:
            names = ", ".join(each.name for each in self.handles)
            raise InputError(f"no handle {format_value(name)}; handles: {names or 'none'}")
        self._change(compute_drag_changes(self.experiment, self.controls, handle, pose))

    def compare(self, second: Any) -> None:
        """Run a second scheme beside, with one other value: [name, value]; None: no more."""
        chosen: dict[str, Any] = {}
        if second is not None:
            if not isinstance(second, list) or len(second) != 2:
                raise InputError("a second scheme is a pair: name and value")
            control = self._control(second[0])
            if self.pair is None or control.path.partition(".")[0] == "run":
                raise InputError("a second scheme goes along with the first, step by step")
            chosen = {control.path: check_control_value(control, second[1])}
        self._take(*self.current, chosen, None, self._about)

    def explain(self, found: Mapping[str, str]) -> None:
        """Put into the texts why the run ended, as `explain_live_run` has it."""
        self.texts = {**self._heard(), **found}
        self.news.add("texts")

    def recording(self) -> Recording:
        """Return the instants that are there as a recording."""
        if self.pair is None:
            assert self._played is not None
            return self._played
        assert self.film is not None
        title = self.experiment.title or "experiment"
        return self.film.recording(title, self.pair.instants(), texts=self.texts)

    def _control(self, name: Any) -> Control:
        if not isinstance(name, str) or name not in self.controls:
            guess = (
                suggest_dotted_names(name, self.controls)
                if isinstance(name, str)
                else "expected a name"
            )
            raise InputError(f"no control {format_value(name)}; {guess}")
        return self.controls[name]

    def _change(self, changes: Mapping[str, Any]) -> None:
        """Take an experiment with these changes, and go on from here; anew with another start."""
        experiment = self.experiment.at(changes)
        anew = any(name.partition(".")[0] in ANEW for name in changes)
        pair = None if anew or not self.pair else self.pair.changed(experiment, self.second)
        self._take(experiment, {**self.changes, **changes}, self.second, pair, self._about)

    def _take(
        self,
        experiment: Experiment,
        changes: Mapping[str, Any],
        second: Mapping[str, Any],
        pair: RunPair | None,
        remark: str,
    ) -> None:
        """Make all that follows from an experiment, and then take it: from its start, or a pair."""
        controls = {each.path: each for each in experiment.controls()}
        before = self.film if pair else None
        handles: list[Handle] = []
        film = played = None
        if isinstance(experiment.task, SelfSimulatingTask):
            played = build_recording(experiment.run())
        else:
            pair = pair or RunPair.of(experiment, second)
            handles = list_handles(experiment, controls, pair.live.forms)
            film = pair.filmed(before.depth if before else None)
            if before is None or not film.like(before):
                pair.forget()
                before = None
        self.current, self.second, self._about = (experiment, changes), second, remark
        self.controls, self.handles, self.made = controls, handles, self.made + 1
        self.news |= {"controls", "texts"}
        if before is None or pair is None or pair.live.fresh:
            self.news.add("recording")
        self.pair, self.film, self._played = pair, film, played
        self.texts = {**self._heard(), **(played.header["texts"] if played else {})}

    def _heard(self) -> dict[str, str]:
        """Return what there is to watch for, where the experiment says it."""
        return {"watch for": self._about} if self._about else {}


def explain_live_run(experiment: Experiment, live: LiveRun, trials: bool) -> dict[str, str]:
    """Return why a run ended, with what would have helped if `trials` are wanted, and its text."""
    found = collect_run_texts(live.piece.run(), live.piece, trials)
    if live.since:
        changed = f"After the last change, at {live.since:.2f} s, from which its times count:\n"
        found["explanation"] = changed + found["explanation"]
    with suppress(InputError):
        found["experiment"] = experiment.text
    return found
