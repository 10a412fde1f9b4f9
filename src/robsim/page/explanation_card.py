"""The reason of an outcome, as pages show it: distance from the goal, causes and changes to try."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.errors import FileError, InputError
from robsim.engine.outcome import Outcome
from robsim.files.scenario_remark import extract_remark, list_remark_entries
from robsim.files.toml import read_toml_text
from robsim.page.recording_frames import Entry
from robsim.plot import run_data
from robsim.run.end_variables import find_converged_elsewhere
from robsim.run.experiment import Experiment

if TYPE_CHECKING:
    import xarray as xr

    from robsim.analysis.explanation.explanation import Explanation
    from robsim.analysis.explanation.findings import Finding

# returns the actions of a finding: entries with a label and a change
ActionBuilder = Callable[["Finding"], list[Entry]]
LEAST_METRES, LEAST_DEGREES = 1e-4, 0.01  # smaller distances from the goal are not distinguished


def collect_run_entries(
    run: xr.Dataset,
    experiment: Experiment,
    trials: bool,
    build_actions: ActionBuilder = lambda _: [],
    start_time: float = 0.0,
) -> dict[str, Any]:
    """Return the entries "texts" and "why" of the header of a recording.

    `start_time` is the time of the last change in seconds, from which the explanation counts times.
    """
    from robsim.analysis.explanation.explanation import explain

    explanation, reason = None, ""
    try:
        explanation = explain(run, experiment, trials=trials)
    except InputError as error:
        reason = f"not explained: {error}"
    one = run_data.extract_single_run(run)
    texts = {"explanation": str(explanation or reason), "experiment": _write_text(experiment)}
    findings = list_findings(explanation, build_actions) if explanation else [_entry("", reason)]
    missed = is_goal_missed(one)
    return {"texts": texts, "why": build_card(describe_result(one, start_time), missed, findings)}


def build_card(
    headline: str, missed: bool, findings: list[Entry], watch: Iterable[Entry] = ()
) -> Entry:
    """Return the entry "why" of a recording: what happened, the reason, and what to watch for."""
    return {"headline": headline, "missed": missed, "findings": findings, "watch": list(watch)}


def list_findings(explanation: Explanation, build_actions: ActionBuilder) -> list[Entry]:
    """Return the sentences of an explanation, each with its head and its actions."""
    why = "Note" if explanation.outcome in _NO_FAILURE else "Why"
    return [
        _entry("", explanation.what),
        *(_entry(why, each.sentence, build_actions(each)) for each in explanation.causes),
        *(_entry("Note", remark) for remark in explanation.remarks),
        *(_entry("Try", each.sentence, build_actions(each)) for each in explanation.advice),
    ]


def list_remark_texts(experiment: Experiment) -> list[Entry]:
    """Return the remark in the file of an experiment, with its commands as text."""
    return [
        _entry("", "\n".join((each.sentence, *each.commands)))
        for each in list_remark_entries(read_experiment_remark(experiment))
    ]


def read_experiment_remark(experiment: Experiment) -> str:
    """Return the remark at the head of the file of an experiment; "" without a readable file."""
    if not experiment.source.endswith(".toml"):
        return ""
    try:
        return extract_remark(read_toml_text(experiment.source))
    except FileError:  # the file has been moved since the experiment was loaded
        return ""


def is_goal_missed(run: xr.Dataset) -> bool:
    """Return whether a run failed, or converged at another pose than its goal."""
    outcome = Outcome(int(run["outcome"]))
    elsewhere = "distance_to_goal" in run and bool(find_converged_elsewhere(run))
    return outcome not in _NO_FAILURE or elsewhere


def describe_result(run: xr.Dataset, start_time: float = 0.0) -> str:
    """Return the outcome of a run, and the distance from its goal to its true final pose.

    >>> from robsim import examples, load_scenario
    >>> describe_result(load_scenario(examples.path("local_minimum")).run())
    'missed the goal by 55 cm and 32 deg: local minimum after 14.5 s'
    """
    outcome, distance = Outcome(int(run["outcome"])), describe_goal_distance(run)
    end = float(run["end_time"]) + start_time
    ending = run_data.describe_ending(run.assign(end_time=end))
    if outcome in _NO_FAILURE:
        return f"{ending}, {distance} from the goal" if distance else ending
    distance = distance or _describe_remaining_error(run)
    return f"missed the goal by {distance}: {ending}" if distance else f"not converged: {ending}"


def describe_goal_distance(run: xr.Dataset) -> str:
    """Return the true distance and angle from the goal pose at the end; "" without a goal pose."""
    metres = float(run["distance_to_goal"]) if "distance_to_goal" in run else np.nan
    angle = float(run["angle_to_goal"]) if "angle_to_goal" in run else np.nan
    parts = [format_goal_length(metres)] if np.isfinite(metres) else []
    parts += [format_goal_angle(angle)] if np.isfinite(angle) else []
    return " and ".join(parts)


def format_goal_length(metres: float) -> str:
    """Return a distance with two digits, in the unit that suits it.

    >>> format_goal_length(1.024), format_goal_length(0.549), format_goal_length(0.00345)
    ('1.02 m', '55 cm', '3.4 mm')
    >>> format_goal_length(2e-6)
    'less than 0.1 mm'
    """
    if metres < LEAST_METRES:
        return "less than 0.1 mm"
    if metres >= 0.995:
        return f"{metres:.3g} m"
    return f"{100 * metres:.2g} cm" if metres >= 0.00995 else f"{1000 * metres:.2g} mm"


def format_goal_angle(radians: float) -> str:
    """Return an angle in degrees with two digits.

    >>> format_goal_angle(0.5528), format_goal_angle(1.8746), format_goal_angle(1e-5)
    ('32 deg', '107 deg', '0.01 deg')
    """
    degrees = max(float(np.degrees(radians)), LEAST_DEGREES)
    return f"{degrees:.3g} deg" if degrees >= 99.5 else f"{degrees:.2g} deg"


def _describe_remaining_error(run: xr.Dataset) -> str:
    """Return the largest error at the end, with its unit; "" if it is not finite."""
    if "time" not in run["error"].dims:
        return ""
    sizes = np.abs(run["error"].values[-1])
    if not sizes.size or not np.isfinite(sizes).all():
        return ""
    unit = str(run["feature_unit"].values[sizes.argmax()])
    return f"an error of {sizes.max():.2g}{'' if unit == '1' else f' {unit}'}"


def _entry(head: str, text: str, actions: list[Entry] | None = None) -> Entry:
    """Return a sentence of a card."""
    return {"head": head, "text": text, "actions": actions or []}


def _write_text(experiment: Experiment) -> str:
    """Return the text of an experiment, or why it is missing."""
    try:
        return experiment.text
    except InputError as reason:
        return f"not available as text: {reason}"


_NO_FAILURE = (Outcome.CONVERGED, Outcome.RUNNING, Outcome.ENDED)
