"""The difference of two experiments as values at dotted names, for buttons and commands."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

from robsim.analysis.explanation.ablation import AblationTrial
from robsim.base.errors import InputError
from robsim.declare.context import NoTextError, Raw
from robsim.declare.lists import get_item_label
from robsim.run.experiment import Experiment
from robsim.run.experiment_text import write_experiment

PathChanges = dict[str, Raw]
_EMPTY: Mapping[str, Raw] = {"sensing": {}, "actuation": {}}  # tables that texts omit if empty


def find_trial_changes(case: Experiment, tried: Experiment, trial: AblationTrial) -> PathChanges:
    """Return the changes that turn a case into a trial with the same end; {} if none are found.

    A trial may have a longer duration than its case. If it ends earlier than the case, the duration
    makes no difference, and is not among the changes.
    """
    if trial.converged and trial.end_time <= case.duration and not case.hold:
        tried = tried.with_(duration=case.duration)
    return find_path_changes(case, tried)


def find_path_changes(before: Experiment, after: Experiment) -> PathChanges:
    """Return {dotted name: value} with which `before.at` returns `after`; {} if none are found.

    The changes are the differences of the exact texts, and None restores a default. The fewest that
    suffice are returned: a scheme of another kind keeps the values that both kinds have.

    >>> from robsim import examples, load_scenario
    >>> experiment = load_scenario(examples.path("visp_tutorial"))
    >>> find_path_changes(experiment, experiment.at({"task.kind": "pbvs", "run.dt": "20 ms"}))
    {'task.kind': 'pbvs', 'run.dt': '0.02 s'}
    """
    try:
        texts = {**_EMPTY, **write_experiment(before)}, {**_EMPTY, **write_experiment(after)}
    except NoTextError:  # such as a task in Python
        return {}
    changes = dict(_list_differences("", *texts))
    rest = {path: value for path, value in changes.items() if path.startswith("run.")}
    kinds = {path: value for path, value in changes.items() if path.endswith(".kind")} | rest
    kept = {path: value for path, value in changes.items() if value is not None}
    for candidate in (kinds, kept, changes):
        with suppress(InputError):
            if candidate and before.at(candidate) == after:
                return candidate
    return {}


def _list_differences(path: str, before: Any, after: Any) -> Iterator[tuple[str, Any]]:
    """Yield the dotted names and new values of the differences of two raw values."""
    inner = _label_items(before), _label_items(after)
    if inner[0] is None or inner[1] is None:
        if before != after:
            yield path, after
        return
    for key in dict.fromkeys((*inner[0], *inner[1])):
        place = f"{path}.{key}" if path else str(key)
        yield from _list_differences(place, inner[0].get(key), inner[1].get(key))


def _label_items(raw: Any) -> Mapping[str | int, Any] | None:
    """Return the items of a table or of a list of tables by name; None for other values."""
    if isinstance(raw, Mapping):
        return raw
    if isinstance(raw, Sequence) and raw and all(isinstance(each, Mapping) for each in raw):
        return {get_item_label(each, i): each for i, each in enumerate(raw)}
    return None
