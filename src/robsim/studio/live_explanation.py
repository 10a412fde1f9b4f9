"""The explanation of a run in progress, with the changes that its page offers."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from robsim.analysis.explanation.findings import Finding
from robsim.base.errors import InputError
from robsim.engine.outcome import Outcome
from robsim.files.scenario_remark import (
    RemarkEntry,
    list_remark_entries,
    parse_compare_command,
    parse_run_command,
)
from robsim.page.explanation_card import (
    ActionBuilder,
    collect_run_entries,
    list_findings,
    read_experiment_remark,
)
from robsim.page.recording_frames import Entry
from robsim.run.experiment import Experiment
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.studio.change_labels import describe_changes
from robsim.studio.live_run import LiveRun

# values in which the second scheme may differ
_COMPARABLE = re.compile(r"(task|sensing|actuation|belief\.cameras)\.")


def explain_live_run(experiment: Experiment, live: LiveRun, trials: bool) -> dict[str, Any]:
    """Return the entries "texts" and "why" of a run in progress.

    If `trials`, the explanation includes changes that improve the run, found by simulation.
    """

    def build_actions(finding: Finding) -> list[Entry]:
        return build_change_actions(experiment, finding.changes) if finding.changes else []

    run, start = live.segment.run(), live.start_time
    collected = collect_run_entries(run, live.segment, trials, build_actions, start)
    if live.failed_at_once and start:
        collected["why"]["findings"] = _describe_failed_change(collected["why"]["findings"], start)
    elif start:
        note = f"The last change was at {start:.2f} s; the times below count from there."
        collected["texts"]["explanation"] = f"{note}\n{collected['texts']['explanation']}"
        findings = collected["why"]["findings"]
        if trials:
            findings = _renew_offers(findings, experiment, build_actions)
        findings = [_name_last_change(each) for each in findings]
        collected["why"]["findings"] = [{"head": "", "text": note, "actions": []}, *findings]
    with suppress(InputError):  # the segment has the same reason to have no text
        collected["texts"]["experiment"] = experiment.text
    return collected


def add_search_note(explained: Mapping[str, Any]) -> dict[str, Any]:
    """Return an explanation of a failure with the note that trials are being simulated."""
    why = explained["why"]
    if not why["missed"]:
        return dict(explained)
    note = {"head": "", "text": "Searching for changes that help …", "actions": []}
    return {**explained, "why": {**why, "findings": [*why["findings"], note]}}


def _name_last_change(finding: Entry) -> Entry:
    """Return a finding on the start of a continued run, with the last change as its time."""
    text = finding["text"]
    if text.startswith("At the start "):
        text = f"At the last change {text.removeprefix('At the start ')}"
    return {**finding, "text": text}


def _describe_failed_change(findings: list[Entry], time: float) -> list[Entry]:
    """Return findings on a run that failed at the instant of a change, and an offer to undo it."""
    words = {"At the start": f"At the last change, at {time:.2f} s,", ": take another start": ""}
    texts = [each["text"] for each in findings]
    for old, new in words.items():
        texts = [text.replace(old, new) for text in texts]
    undo = {"label": "Undo the last change", "undo": True}
    advice = {
        "head": "Try",
        "text": "Without the last change the run can go on.",
        "actions": [undo],
    }
    return [*({**each, "text": text} for each, text in zip(findings, texts, strict=True)), advice]


def _renew_offers(
    findings: list[Entry], experiment: Experiment, build_actions: ActionBuilder
) -> list[Entry]:
    """Return findings with offers that succeed from the start of the experiment.

    A button starts the run over. If an offer for a later start fails from the first start, the
    offers for the first start replace it.
    """
    from robsim.analysis.explanation.explanation import explain

    kept = [each for each in findings if _succeeds_from_start(each, experiment)]
    if len(kept) == len(findings):
        return findings
    explanation = explain(experiment.run(), experiment)
    offers = [each for each in list_findings(explanation, build_actions) if each["actions"]]
    note = {"head": "", "text": "From the start of the experiment:", "actions": []}
    return [*kept, note, *offers] if offers else kept


def _succeeds_from_start(finding: Entry, experiment: Experiment) -> bool:
    """Return whether the experiment converges with each change that a finding offers."""
    changes = [each["change"] for each in finding["actions"] if "change" in each]
    runs = (experiment.at(each).run(record="summary") for each in changes)
    return all(int(run["outcome"]) == Outcome.CONVERGED for run in runs)


def list_watch_entries(experiment: Experiment) -> list[Entry]:
    """Return the remark in the file of an experiment, with its commands as actions.

    Commands that this experiment does not accept, and commands of other files, remain text.
    """
    name = Path(experiment.source).stem
    return [
        _build_watch_entry(experiment, name, each)
        for each in list_remark_entries(read_experiment_remark(experiment))
    ]


def _build_watch_entry(experiment: Experiment, name: str, said: RemarkEntry) -> Entry:
    """Return a sentence of a remark with the actions of its commands."""
    lines, actions = [said.sentence], list[Entry]()
    for command in said.commands:
        offered = _build_command_actions(experiment, name, command)
        actions += offered
        lines += [] if offered else [command]
    return {"head": "", "text": "\n".join(lines), "actions": actions}


def _build_command_actions(experiment: Experiment, name: str, command: str) -> list[Entry]:
    """Return the actions of a command; none if it is no single run of this experiment."""
    path, values = parse_compare_command(command, name)
    if values:
        return [
            {"label": f"{describe_changes({path: value})} beside it", "second": second}
            for value in values
            if (second := find_second_scheme(experiment, {path: value}))
        ]
    changes = parse_run_command(command, name)
    return build_change_actions(experiment, changes) if changes else []


def build_change_actions(experiment: Experiment, changes: Mapping[str, Any]) -> list[Entry]:
    """Return the actions that make changes: for the run, and for the second scheme beside it.

    The list is empty if the experiment does not accept the changes.
    """
    try:
        experiment.at(changes)
    except InputError:
        return []
    actions: list[Entry] = [{"label": f"Try {describe_changes(changes)}", "change": dict(changes)}]
    second = find_second_scheme(experiment, changes)
    return [*actions, {"label": "beside it", "second": second}] if second else actions


def find_second_scheme(experiment: Experiment, changes: Mapping[str, Any]) -> Entry:
    """Return the changes as {name: value of a control} of a second scheme; {} if there is none.

    A second scheme differs in one value, which a control of the page can show, and an experiment
    with a mission has none.
    """
    path, *others = changes
    if others or not _COMPARABLE.match(path) or isinstance(experiment.task, SelfSimulatingTask):
        return {}
    try:
        before, after = (
            next((each for each in one.controls() if each.path == path), None)
            for one in (experiment, experiment.at(changes))
        )
    except InputError:
        return {}
    if before is None or after is None or before.value == after.value:
        return {}
    return {path: after.value} if after.form in ("number", "choice") else {}
