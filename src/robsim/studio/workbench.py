"""The edited experiment of a session, its run, and a second scheme for comparison."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError, check_known, format_value
from robsim.declare.controls import Control
from robsim.declare.name_lookup import suggest_dotted_names
from robsim.page.camera_pictures import PictureSource, add_pictures
from robsim.page.explanation_card import build_card
from robsim.page.recording_builder import Recording, RecordingBuilder
from robsim.page.recording_frames import Entry
from robsim.page.recordings import build_recording
from robsim.plot.missing_meshes import warn_missing_meshes
from robsim.plot.run_data import describe_outcome
from robsim.run.experiment import Experiment
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.servo.goals.kept_goal import (
    keep_shown_goals,
    list_shown_goals,
    show_goals_anew,
    show_goals_at,
)
from robsim.studio.control_values import build_changes, check_control_value, describe_differences
from robsim.studio.edit_history import Edit, EditHistory
from robsim.studio.handles import (
    Handle,
    compute_drag_changes,
    list_carried_handles,
    list_handles,
    solve_drag,
)
from robsim.studio.live_explanation import list_watch_entries
from robsim.studio.live_run import LiveRun
from robsim.studio.run_pair import RunPair

RESTARTING = ("dt", "duration", "hold", "record", "seed", "first_run")  # settings that restart
MOST, KEPT = 100_000, 1000  # largest number of stored instants, and number that then remains
PROMPT = 5.0  # seconds; a longer return to the goal is explained by the gain
CHANGEABLE = "task", "run", "start", "sensing", "actuation", "safety", "endings"  # tables


class Workbench:
    """An experiment with its changes, its run so far, and a second scheme if there is one.

    A change during a run continues the run from the present configuration. It starts the run over
    if the run had ended by a failure or the time limit, if the run cannot continue, or if it
    changes the start or the settings of the run. After a local minimum or the time limit, a dragged
    body continues the run too: the robot stands at a valid place. Shown goals remain the images
    that were shown when a body is moved.

    A mission cannot be changed during its run: it is simulated as a whole, and pages show the
    recording. A change that raises an error has no effect.

    Attributes
    ----------
    edit : Edit
        The experiment with all changes, and the second scheme.
    revision : int
        Number of changes.
    restarts : int
        Number of changes that started the run over because it had ended or could not continue.
    restarted_because : str
        The reason if the last change started the run over; else "".
    return_remark : str
        Why the return to the goal takes long, or does not end at the goal pose, if the last change
        moved a body; else "".
    news : set of {"recording", "controls", "texts"}
        Kinds of data that have changed since they were sent to the pages.
    """

    def __init__(self, experiment: Experiment) -> None:
        self.news: set[str] = set()
        self.revision = self.restarts = 0
        self.restarted_because = self.return_remark = ""
        self.builder: RecordingBuilder | None = None
        self.pair: RunPair | None = None
        self.open(experiment)

    def open(self, experiment: Experiment) -> None:
        """Open another experiment; raise InputError if it cannot run."""
        edit = Edit(experiment)
        self._adopt(edit, _start_pair(edit), list_watch_entries(experiment), opens=True)
        self.history = EditHistory(edit)
        self._original_controls = self.controls
        self.restarts, self.restarted_because = 0, ""
        warn_missing_meshes(experiment.scene)

    @property
    def experiment(self) -> Experiment:
        """The experiment with all changes."""
        return self.edit.experiment

    @property
    def changes(self) -> Mapping[str, Any]:
        """The changes since the experiment was opened."""
        return self.edit.changes

    @property
    def second(self) -> Mapping[str, Any]:
        """The values {dotted name: value} that differ in the second scheme; empty without it."""
        return self.edit.second

    @property
    def time(self) -> float:
        """Time since the start of the run, in seconds."""
        return self.pair.live.now.time if self.pair else 0.0

    @property
    def since(self) -> float:
        """Time of the last change during the run, in seconds; 0 without such a change."""
        return self.pair.live.start_time if self.pair else 0.0

    @property
    def idle(self) -> bool:
        """Whether the run has no more instants until it is changed or reset."""
        return self.pair is None or self.pair.idle

    @property
    def ended(self) -> bool:
        """Whether a failure or the time limit has ended the run."""
        return self.pair is None or self.pair.live.failed

    @property
    def rests(self) -> bool:
        """Whether the run has converged and rests until a change."""
        return self.pair is not None and self.pair.idle and not self.ended

    @property
    def handles(self) -> list[Handle]:
        """The poses that a user can drag; robots are pushed only after the start of the run."""
        at_start = self.pair is None or self.pair.live.is_at_start
        return self._handles if at_start else self._handles + self._carried_handles

    @property
    def has_shown_goals(self) -> bool:
        """Whether the task has goals that can be shown anew."""
        return bool(list_shown_goals(self.experiment.task))

    @property
    def keeps_goals(self) -> bool:
        """Whether a shown goal is kept although bodies have moved since."""
        return any(goal.places for goal in list_shown_goals(self.experiment.task))

    @property
    def edited(self) -> bool:
        """Whether the experiment or the second scheme differs from the original."""
        original = self.history.original
        same = self.edit is original or self.experiment == original.experiment
        return not same or self.second != original.second

    @cached_property
    def differences(self) -> list[dict[str, Any]]:
        """Path, original value, and texts before and after of each value that has changed."""
        return describe_differences(self._original_controls, self.controls, self.changes)

    def step(self) -> None:
        """Advance both schemes by one instant, unless both have ended or rest.

        If `MOST` instants are stored, all but the last `KEPT` are deleted.
        """
        if self.pair is None or self.pair.idle:
            return
        self.pair.step()
        if len(self.pair.live.instants) >= MOST:
            self.pair.forget(KEPT)
            self.news.add("recording")

    def reset(self) -> None:
        """Restart the run."""
        self._adopt(self.edit, _start_pair(self.edit), self._watch)

    def set(self, name: object, value: object, stroke: object = None) -> None:
        """Change a value of the experiment; raise InputError if the name or value is invalid.

        Consecutive changes of a value with the same `stroke` are one edit.
        """
        control = self._get_control(name)
        checked = check_control_value(control, value)
        original = self._original_controls.get(control.path)
        if original is not None and value == original.value:
            checked = value  # not rounded
        self._change(control.changes(checked), control.path, stroke=stroke)

    def change(self, values: object) -> None:
        """Change values {dotted name: value as `Experiment.at` accepts it}, all or none."""
        if not isinstance(values, dict) or not values:
            raise InputError(f"change: expected {{name: value}}, got {format_value(values)}")
        for name in values:
            if name not in self.controls:
                check_known(name.partition(".")[0], CHANGEABLE, "change: no table {}", "tables")
        self._change(build_changes(self.controls, values))

    def drag(self, name: object, pose: object, stroke: object = None) -> None:
        """Place the body of a handle at a pose; raise InputError if the pose is not reachable.

        A body on a robot is pushed together with the robot: the run continues from there, and the
        experiment remains as it is. Consecutive drags with the same `stroke` are one edit.
        """
        handle = next((each for each in self.handles if each.name == name), None)
        if handle is None:
            names = ", ".join(each.name for each in self.handles)
            raise InputError(f"no handle {format_value(name)}; handles: {names or 'none'}")
        if handle.carried:
            self._push(handle, pose)
            return
        experiment = self.experiment
        if name == "goal" and self.keeps_goals:  # a dragged goal is shown where the bodies are now
            experiment = experiment.with_(task=show_goals_anew(experiment.task))
        changes = compute_drag_changes(experiment, self.controls, handle, pose)
        pulls = name not in ("start", "goal")
        self._change(changes, name, experiment, pulls=pulls, stroke=stroke)

    def show_goal(self, how: object) -> None:
        """Show the goals in the scene as it is: "anew" at their own q, "here" at the present q."""
        check_known(how, ("anew", "here"), "show_goal: unknown {}", "ways")
        if not self.has_shown_goals or self.pair is None:
            raise InputError("show_goal: this task has no goal that is shown at a configuration")
        task, q = self.experiment.task, self.pair.live.now.q
        task = show_goals_anew(task) if how == "anew" else show_goals_at(task, q)
        self._run_edit(edit := Edit(self.experiment.with_(task=task), self.changes, self.second))
        self.history.add(edit)

    def compare(self, second: object) -> None:
        """Run a second scheme beside the first; it differs in [name, value] or {name: value}.

        None ends the second scheme. Raise InputError if a value is invalid.
        """
        edit = Edit(self.experiment, self.changes, self._parse_second(second))
        self._adopt(edit, _start_pair(edit), self._watch)
        self.history.add(edit, "second")
        self.restarted_because = ""

    def undo(self) -> None:
        """Return to the experiment and the second scheme before the last change."""
        self._return_to(self.history.before, "undo: nothing has been changed")

    def redo(self) -> None:
        """Repeat the change that was undone last."""
        self._return_to(self.history.after, "redo: nothing has been undone")

    def restore_original(self) -> None:
        """Return to the experiment as it was opened, and start the run over."""
        original = self.history.original
        if self.edit is original:
            return
        self._adopt(original, _start_pair(original), self._watch)
        self.history.add(original)
        self.restarts, self.restarted_because = self.restarts + 1, "back to the original"

    def explain(self, explained: Mapping[str, Any]) -> None:
        """Store the explanation of the run, as `explain_live_run` returns it."""
        self.texts, self.why = explained["texts"], self._complete_card(explained["why"])
        self.news.add("texts")

    def saved_experiment(self) -> Experiment:
        """Return the experiment of the run since the last change during the run.

        Its start is the configuration and its seed the seed of that run. Its instants are those of
        the page from the time `since` on, bit by bit.
        """
        if self.pair is None:
            return self.experiment
        segment = self.pair.live.segment
        continues = {"hold": True} if segment.hold and not self.experiment.hold else {}
        if not self.since:
            return self.experiment.with_(**continues) if continues else self.experiment
        return self.experiment.with_(start=segment.start, seed=segment.seed, **continues)

    def recording(self) -> Recording:
        """Return the recording of all instants so far."""
        if self.pair is None:
            assert self._mission_recording is not None
            return self._mission_recording
        assert self.builder is not None
        title = self.experiment.title or "experiment"
        changes = self.differences if self.changes else []
        entries = {"texts": self.texts, "why": {**self.why, "changes": changes}}
        recording = self.builder.build_recording(title, self.pair.instants(), **entries)
        source = self._build_picture_source(self.pair.live)
        cameras = add_pictures(recording.header["cameras"], source)
        return replace(recording, header={**recording.header, "cameras": cameras})

    @staticmethod
    def _build_picture_source(live: LiveRun) -> PictureSource:
        """Return the instants since the last change of a run, at which cameras take pictures."""
        times = [each.time for each in live.instants]
        first = int(np.searchsorted(times, live.start_time))
        scene, instants = live.experiment.scene, live.camera_instants()
        return PictureSource(scene, instants, live.variables(), live.find_goal_poses(), first)

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

    def _parse_second(self, second: object) -> dict[str, Any]:
        """Return the values that differ in a second scheme; raise InputError if it cannot run."""
        if second is None:
            return {}
        if isinstance(second, list) and len(second) == 2:
            control = self._get_control(second[0])
            second = {control.path: check_control_value(control, second[1])}
        if not isinstance(second, dict) or not second:
            raise InputError("second: expected [name, value] or {name: value}")
        if self.pair is None or any(name.partition(".")[0] in ("run", "start") for name in second):
            raise InputError(
                "a second scheme runs step by step beside the first: "
                "it must have the same values of run and start, and must not be a mission"
            )
        return second

    def _change(
        self,
        changes: Mapping[str, Any],
        values: object = None,
        experiment: Experiment | None = None,
        pulls: bool = False,
        stroke: object = None,
    ) -> None:
        """Apply changes to the experiment; shown goals remain the images that were shown.

        Consecutive changes with equal `values` and `stroke` are one edit. If `pulls`, a body is
        dragged.
        """
        before = experiment or self.experiment
        after = before.at(changes)
        if after.scene is not before.scene:
            task = keep_shown_goals(after.task, before.scene, after.scene)
            after = after if task is after.task else after.with_(task=task)
        self._run_edit(edit := Edit(after, {**self.changes, **changes}, self.second), pulls)
        self.history.add(edit, values, stroke)
        if after.scene is not before.scene:
            self._remark_return()

    def _push(self, handle: Handle, pose: object) -> None:
        """Continue the run with the carried body of a handle at a pose."""
        assert self.pair is not None
        q = solve_drag(self.experiment.scene, handle, pose, self.pair.live.now.q)
        self._adopt(
            self.edit, self.pair.continue_with(self.experiment, self.second, q), self._watch
        )
        self.restarted_because = ""
        self._remark_return()

    def _remark_return(self) -> None:
        """Store why the return to the goal takes long, or does not end at the goal pose."""
        if self.pair is None or self.idle:
            return
        live, remarks = self.pair.live, self.pair.live.list_return_obstacles()
        seconds = live.predict_return()
        if seconds > PROMPT:
            remarks.append(
                f"the gain of {live.gain:.3g} 1/s is low: the return to 1 mm and 0.1 deg from the "
                f"goal takes about {seconds:.2g} s"
            )
        self.return_remark = "; ".join(remarks)

    def _return_to(self, edit: Edit | None, reason: str) -> None:
        """Run a stored edit; raise InputError if there is none."""
        if edit is None:
            raise InputError(reason)
        self._run_edit(edit)
        self.history.go_to(edit)

    def _run_edit(self, edit: Edit, pulls: bool = False) -> None:
        """Continue the run with an edit, or start the run over; after an error nothing changes."""
        pair, reason = self._continue_pair(edit, pulls)
        self._adopt(edit, pair or _start_pair(edit), self._watch)
        self.restarts += bool(reason)
        self.restarted_because = reason

    def _continue_pair(self, edit: Edit, pulls: bool) -> tuple[RunPair | None, str]:
        """Return the run continued with an edit; else None, and the reason for starting over.

        The reason is empty if the edit itself demands a new start, or the run is at its start. If
        the edit `pulls` a body, a robot that only stands still follows it.
        """
        pair, same_second = self.pair, self.second == edit.second
        if pair is None or isinstance(edit.experiment.task, SelfSimulatingTask):
            return None, ""
        if same_second and pair.live.is_at_start:
            return pair.start_again(edit.experiment, edit.second), ""
        if not same_second or self._demands_start(edit.experiment):
            return None, ""
        reason = "" if pulls and pair.live.stands_still else _explain_end(pair.live)
        if not reason:
            try:
                return pair.continue_with(edit.experiment, edit.second), ""
            except InputError as error:
                reason = f"the run could not continue with this change: {error}"
        return None, reason

    def _demands_start(self, experiment: Experiment) -> bool:
        """Return whether another experiment differs in the start or in settings of the run."""
        old = self.experiment
        same = all(getattr(old, name) == getattr(experiment, name) for name in RESTARTING)
        return not same or not np.array_equal(_get_start(old), _get_start(experiment))

    def _adopt(
        self, edit: Edit, pair: RunPair | None, watch: list[Entry], opens: bool = False
    ) -> None:
        """Build handles and recording builder of an edit; then store them all.

        `pair` are the runs; None simulates a mission. If `opens`, the edit is another experiment
        with shapes of its own. If an error is raised, nothing changes.
        """
        experiment = edit.experiment
        controls = {each.path: each for each in experiment.controls()}
        handles: list[Handle] = []
        carried: list[Handle] = []
        builder = mission_recording = None
        if pair is None:
            mission_recording = build_recording(experiment.run())
        else:
            live = pair.live
            handles = list_handles(experiment, controls, live.moving_frame, live.find_goal_pose())
            carried = list_carried_handles(experiment.scene, live.now.q)
            builder = pair.create_recording_builder(None if opens else self.builder)
        self.edit, self._watch, self.return_remark = edit, watch, ""
        self.controls, self.revision = controls, self.revision + 1
        vars(self).pop("differences", None)
        self._handles, self._carried_handles = handles, carried
        self.news |= {"controls", "texts"}
        if pair is None or pair.live.restarted:
            self.news.add("recording")
        self.pair, self.builder, self._mission_recording = pair, builder, mission_recording
        header = mission_recording.header if mission_recording else {}
        self.texts = header.get("texts", {})
        self.why = self._complete_card(header.get("why", build_card("", False, [])))

    def _complete_card(self, card: Entry) -> Entry:
        """Return the reason of an outcome, and the remark of the file, which may be outdated."""
        return {**card, "watch": self._watch, "changed": bool(self.changes)}


def _start_pair(edit: Edit) -> RunPair | None:
    """Return the runs of an edit at their start; None for a mission."""
    if isinstance(edit.experiment.task, SelfSimulatingTask):
        return None
    return RunPair.of(edit.experiment, edit.second)


def _explain_end(live: LiveRun) -> str:
    """Return the reason why a run cannot continue; "" if it can.

    A run that ended at the instant of the last change can continue without that change.
    """
    if live.decision is None or not live.failed or live.failed_at_once:
        return ""
    return (
        f"the run had ended: {describe_outcome(live.decision.outcome, live.decision.time, False)}"
    )


def _get_start(experiment: Experiment) -> Array:
    """Return the start configuration of an experiment."""
    return np.asarray(experiment.scene.home if experiment.start is None else experiment.start)
