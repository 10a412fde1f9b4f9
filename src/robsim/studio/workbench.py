"""The edited experiment of a session, its run, and a second scheme for comparison."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from robsim.base.errors import InputError, format_value
from robsim.declare.controls import Control
from robsim.declare.name_lookup import suggest_dotted_names
from robsim.page.recording_builder import Recording, RecordingBuilder
from robsim.page.recordings import build_recording
from robsim.plot.missing_meshes import warn_missing_meshes
from robsim.run.experiment import Experiment
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.studio.control_values import check_control_value
from robsim.studio.handles import Handle, compute_drag_changes, list_handles
from robsim.studio.run_pair import RunPair
from robsim.studio.scenario_shelf import read_experiment_remark

RESTARTING = ("start", "run")  # changes in these tables restart the run


class Workbench:
    """An experiment with its changes, its run so far, and a second scheme if there is one.

    A mission cannot be changed during its run: it is simulated as a whole, and pages show the
    recording. A change that raises an error has no effect.

    Attributes
    ----------
    current : (Experiment, dict)
        The experiment, and {dotted name: value} of its changes since it was opened.
    second : dict
        {dotted name: value} of the value that differs in the second scheme; empty without it.
    revision : int
        Number of changes.
    news : set of {"recording", "controls", "texts"}
        Kinds of data that have changed since they were sent to the pages.
    """

    def __init__(self, experiment: Experiment) -> None:
        self.news: set[str] = set()
        self.revision = 0
        self.builder: RecordingBuilder | None = None
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

    def set(self, name: object, value: object) -> None:
        """Change a value of the experiment; raise InputError if the name or value is invalid."""
        control = self._get_control(name)
        self._apply_changes(control.changes(check_control_value(control, value)))

    def drag(self, name: object, pose: object) -> None:
        """Place the body of a handle at a pose; raise InputError if the pose is not reachable."""
        handle = next((each for each in self.handles if each.name == name), None)
        if handle is None:
            names = ", ".join(each.name for each in self.handles)
            raise InputError(f"no handle {format_value(name)}; handles: {names or 'none'}")
        self._apply_changes(compute_drag_changes(self.experiment, self.controls, handle, pose))

    def compare(self, second: object) -> None:
        """Run a second scheme beside the first; it differs in `second` = [name, value].

        None ends the second scheme. Raise InputError if the value is invalid.
        """
        difference: dict[str, Any] = {}
        if second is not None:
            if not isinstance(second, list) or len(second) != 2:
                raise InputError("second: expected [name, value]")
            control = self._get_control(second[0])
            if self.pair is None or control.path.partition(".")[0] == "run":
                raise InputError(
                    "a second scheme runs step by step beside the first: "
                    "it must have the same values of run, and must not be a mission"
                )
            difference = {control.path: check_control_value(control, second[1])}
        self._adopt(*self.current, difference, None, self._remark)

    def explain(self, explanation: Mapping[str, str]) -> None:
        """Store the explanation of the run, as `explain_live_run` returns it."""
        self.texts = {**self._initial_texts(), **explanation}
        self.news.add("texts")

    def saved_experiment(self) -> Experiment:
        """Return the experiment of the files."""
        return self.experiment

    def recording(self) -> Recording:
        """Return the recording of all instants so far."""
        if self.pair is None:
            assert self._mission_recording is not None
            return self._mission_recording
        assert self.builder is not None
        title = self.experiment.title or "experiment"
        return self.builder.build_recording(title, self.pair.instants(), texts=self.texts)

    def _get_control(self, name: object) -> Control:
        """Return the control of a dotted name; raise InputError if there is none."""
        if not isinstance(name, str) or name not in self.controls:
            guess = (
                suggest_dotted_names(name, self.controls)
                if isinstance(name, str)
                else "expected a name"
            )
            raise InputError(f"no control {format_value(name)}; {guess}")
        return self.controls[name]

    def _apply_changes(self, changes: Mapping[str, Any]) -> None:
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
        """Build run, handles and recording builder of an experiment; then store them all.

        `pair` continues a run; None starts a run. If an error is raised, nothing changes.
        """
        controls = {each.path: each for each in experiment.controls()}
        before = self.builder if pair else None
        handles: list[Handle] = []
        builder = mission_recording = None
        if isinstance(experiment.task, SelfSimulatingTask):
            mission_recording = build_recording(experiment.run())
        else:
            pair = pair or RunPair.of(experiment, second)
            handles = list_handles(experiment, controls, pair.live.template)
            builder = pair.create_recording_builder(before.depth if before else None)
            if before is None or not builder.has_same_entries(before):
                pair.forget()
                before = None
        self.current, self.second, self._remark = (experiment, changes), second, remark
        self.controls, self.handles, self.revision = controls, handles, self.revision + 1
        self.news |= {"controls", "texts"}
        if before is None or pair is None or pair.live.restarted:
            self.news.add("recording")
        self.pair, self.builder, self._mission_recording = pair, builder, mission_recording
        self.texts = {
            **self._initial_texts(),
            **(mission_recording.header["texts"] if mission_recording else {}),
        }

    def _initial_texts(self) -> dict[str, str]:
        """Return the texts before the run has ended: the remark of the experiment, if any."""
        return {"watch for": self._remark} if self._remark else {}
