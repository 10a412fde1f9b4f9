"""The edited experiment of a session, its run, and the second scheme beside it."""

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

RESTARTING = ("start", "run")  # a change of these tables restarts the run


class Workbench:
    """An experiment with its changes, its run so far, and a second scheme beside it, if any.

    A mission cannot be changed while it runs: it is simulated as a whole, and pages play the
    result. A change that raises an error has no effect.

    Attributes
    ----------
    current : (Experiment, dict)
        The experiment, and {dotted name: value} of its changes since it was opened.
    second : dict
        {dotted name: value}, the one value that differs in the second scheme; empty without it.
    revision : int
        Number of changes.
    news : set of {"recording", "controls", "texts"}
        Data that has changed since it was last sent to the pages.
    """

    def __init__(self, experiment: Experiment) -> None:
        self.news: set[str] = set()
        self.revision = 0
        self.film: RecordingBuilder | None = None
        self.open(experiment)

    def open(self, experiment: Experiment) -> None:
        """Open another experiment; raise InputError if it cannot run."""
        self._adopt(experiment, {}, {}, None, read_experiment_remark(experiment))
        warn_missing_meshes(experiment.scene)

    @property
    def experiment(self) -> Experiment:
        """The experiment with all changes."""
        return self.current[0]

    @property
    def changes(self) -> Mapping[str, Any]:
        """The changes since the experiment was opened."""
        return self.current[1]

    @property
    def time(self) -> float:
        """Time since the start of the run, in seconds."""
        return self.pair.live.now.time if self.pair else 0.0

    @property
    def ended(self) -> bool:
        """Whether the run has no more instants."""
        return self.pair is None or self.pair.ended

    @property
    def full(self) -> bool:
        """Whether the run stopped because the number of stored instants is limited."""
        return self.pair is not None and self.pair.ended and self.pair.end is None

    def step(self) -> None:
        """Advance both schemes by one instant, unless both have ended."""
        if self.pair is not None and not self.pair.ended:
            self.pair.step()

    def reset(self) -> None:
        """Restart the run."""
        self._adopt(*self.current, self.second, None, self._remark)

    def set(self, name: Any, value: Any) -> None:
        """Change a value of the experiment; raise InputError if this is impossible."""
        control = self._control(name)
        self._change(control.changes(check_control_value(control, value)))

    def drag(self, name: Any, pose: Any) -> None:
        """Place the body of a handle at a pose; raise InputError if this is impossible."""
        handle = next((each for each in self.handles if each.name == name), None)
        if handle is None:
            names = ", ".join(each.name for each in self.handles)
            raise InputError(f"no handle {format_value(name)}; handles: {names or 'none'}")
        self._change(compute_drag_changes(self.experiment, self.controls, handle, pose))

    def compare(self, second: Any) -> None:
        """Run a second scheme beside the first, which differs in `second` = [name, value].

        None ends the second scheme. Raise InputError if the value is impossible.
        """
        difference: dict[str, Any] = {}
        if second is not None:
            if not isinstance(second, list) or len(second) != 2:
                raise InputError("second: expected [name, value]")
            control = self._control(second[0])
            if self.pair is None or control.path.partition(".")[0] == "run":
                raise InputError(
                    "a second scheme runs step by step beside the first: "
                    "it needs the same values of run, and no mission"
                )
            difference = {control.path: check_control_value(control, second[1])}
        self._adopt(*self.current, difference, None, self._remark)

    def explain(self, explanation: Mapping[str, str]) -> None:
        """Store the explanation of the run, as `explain_live_run` returns it."""
        self.texts = {**self._initial_texts(), **explanation}
        self.news.add("texts")

    def recording(self) -> Recording:
        """Return the recording of all instants so far."""
        if self.pair is None:
            assert self._mission_recording is not None
            return self._mission_recording
        assert self.film is not None
        title = self.experiment.title or "experiment"
        return self.film.recording(title, self.pair.instants(), texts=self.texts)

    def _control(self, name: Any) -> Control:
        """Return the control of a dotted name; raise InputError if there is none."""
        if not isinstance(name, str) or name not in self.controls:
            guess = (
                suggest_dotted_names(name, self.controls)
                if isinstance(name, str)
                else "expected a name"
            )
            raise InputError(f"no control {format_value(name)}; {guess}")
        return self.controls[name]

    def _change(self, changes: Mapping[str, Any]) -> None:
        """Apply changes and continue the run from here, or restart it if the start has changed."""
        experiment = self.experiment.at(changes)
        restarts = any(name.partition(".")[0] in RESTARTING for name in changes)
        pair = (
            None if restarts or not self.pair else self.pair.continue_with(experiment, self.second)
        )
        self._adopt(experiment, {**self.changes, **changes}, self.second, pair, self._remark)

    def _adopt(
        self,
        experiment: Experiment,
        changes: Mapping[str, Any],
        second: Mapping[str, Any],
        pair: RunPair | None,
        remark: str,
    ) -> None:
        """Build the run, handles and film of an experiment, and adopt them if no error was raised.

        `pair` continues a run; None starts it.
        """
        controls = {each.path: each for each in experiment.controls()}
        before = self.film if pair else None
        handles: list[Handle] = []
        film = mission_recording = None
        if isinstance(experiment.task, SelfSimulatingTask):
            mission_recording = build_recording(experiment.run())
        else:
            pair = pair or RunPair.of(experiment, second)
            handles = list_handles(experiment, controls, pair.live.template)
            film = pair.build_film(before.depth if before else None)
            if before is None or not film.like(before):
                pair.forget()
                before = None
        self.current, self.second, self._remark = (experiment, changes), second, remark
        self.controls, self.handles, self.revision = controls, handles, self.revision + 1
        self.news |= {"controls", "texts"}
        if before is None or pair is None or pair.live.restarted:
            self.news.add("recording")
        self.pair, self.film, self._mission_recording = pair, film, mission_recording
        self.texts = {
            **self._initial_texts(),
            **(mission_recording.header["texts"] if mission_recording else {}),
        }

    def _initial_texts(self) -> dict[str, str]:
        """Return the texts at the start: the remark of the experiment, if any."""
        return {"watch for": self._remark} if self._remark else {}


def explain_live_run(experiment: Experiment, live: LiveRun, trials: bool) -> dict[str, str]:
    """Return the explanation of a run and the text of its experiment.

    With `trials` the explanation includes changes that would have helped, found by simulation.
    """
    collected = collect_run_texts(live.segment.run(), live.segment, trials)
    if live.start_time:
        heading = f"After the last change at {live.start_time:.2f} s (times count from there):\n"
        collected["explanation"] = heading + collected["explanation"]
    with suppress(InputError):
        collected["experiment"] = experiment.text
    return collected
