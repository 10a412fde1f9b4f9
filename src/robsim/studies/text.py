"""The text of a study: the table `[study]` beside those of its experiment."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.errors import FileError, InputError, said
from robsim.declare import Choice as ChoiceSpec
from robsim.declare import Flag, Whole
from robsim.declare.arrays import Numbers
from robsim.declare.problems import Broken, Problems
from robsim.declare.quantities import DIMENSIONS
from robsim.declare.spec import MISSING, Context, NoText, Raw, Spec, expected
from robsim.declare.tables import read_table, write_table
from robsim.files.changes import Changes
from robsim.files.toml import parse, write
from robsim.run.experiment import Experiment, load_scenario
from robsim.run.paths import path_of, unit_at
from robsim.starts.starts import START
from robsim.studies.axes import Axis
from robsim.studies.in_turn import labelled
from robsim.studies.plan import MOST_RUNS, Plan, planned
from robsim.studies.samplers import SAMPLER, Choice
from robsim.studies.values import is_raw

STUDY = "study"  # the key of the table
COMPARED = 50  # values of an axis that are compared with what their text says
SAMPLED = ChoiceSpec(SAMPLER, short=False)


@dataclass(frozen=True)
class VarySpec(Spec):
    """The dotted names that differ from run to run: a sampler, a list, or values by label."""

    form: ClassVar[str] = "table"
    phrase: ClassVar[str] = (
        'a table such as { "task.gain" = { kind = "uniform", low = 1, high = 2 } }'
    )

    def read(self, raw: Raw, c: Context) -> dict[str, Any]:
        found = {}
        for name, each in _by_name(raw, c).items():
            unit = unit_at(c.facts["experiment"], name)
            inner = c.at(name).knowing(of=[unit if unit in DIMENSIONS else "1"])
            value = inner.tried(SAMPLED, each) if is_drawn(each) else each
            if value is not MISSING:
                found[name] = value
        return found

    def write(self, value: Any, c: Context) -> list[Raw]:
        return [{"name": name, **_table(x, c.at(name))} for name, x in value.items()]

    def schema(self, define: Any) -> dict[str, Any]:
        listed: list[Any] = [{"type": "array"}, {"type": "object"}]
        return {"type": "object", "additionalProperties": {"anyOf": listed}}


def _table(axis: Any, c: Context) -> dict[str, Raw]:
    """Return the table of an axis, without its name."""
    if isinstance(axis, list):
        return {"values": axis}
    table: dict[str, Raw] = SAMPLED.write(axis, c)
    return table


def is_drawn(raw: Raw) -> bool:
    """Return whether a raw value is the table of a sampler."""
    kind = raw.get("kind") if isinstance(raw, Mapping) else None
    return isinstance(kind, str) and kind in SAMPLER.names


def _by_name(raw: Raw, c: Context) -> dict[str, Raw]:
    """Return what varies by its names: of a table, or of a list of tables that say their names."""
    if isinstance(raw, Mapping):
        return _flat(raw)
    if not isinstance(raw, list):
        raise expected(VarySpec().words(), raw)
    found: dict[str, Raw] = {}
    for i, each in enumerate(raw):
        if not isinstance(each, Mapping) or not isinstance(each.get("name"), str):
            c.at(i).report(f"expected a table with a name, got {said(each)}")
            raise Broken
        rest = {key: x for key, x in each.items() if key != "name"}
        found[each["name"]] = rest["values"] if rest.keys() == {"values"} else rest
    return found


def _flat(raw: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return names that were written without quotes, and hence as nested tables, in one piece."""
    found: dict[str, Any] = {}
    for key, value in raw.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping) and not is_drawn(value) and _holds_sampler(value):
            found |= _flat(value, f"{name}.")
        else:
            found[name] = value
    return found


def _holds_sampler(raw: Any) -> bool:
    return isinstance(raw, Mapping) and (is_drawn(raw) or any(map(_holds_sampler, raw.values())))


@dataclass(frozen=True)
class StudyTable:
    """The table of a study in the text of its experiment."""

    runs: Annotated[
        int | None, Whole(1, MOST_RUNS), "How many draws; each is run with all that is in turn."
    ] = None
    seed: Annotated[int | None, Whole(0, 2**64 - 1), "Seed of all that is drawn."] = None
    start: Annotated[Any, ChoiceSpec(START, short=False), "Where starts are drawn."] = None
    starts: Annotated[
        Any, Numbers(shape=("k", "n")), "Coordinates of all starts, one row for each run."
    ] = None
    vary: Annotated[Any, VarySpec(), "What differs from run to run, by dotted names."] = None
    trajectories: Annotated[
        int | None, Whole(1, 10**7), "Every n-th instant that is kept, in a store."
    ] = None
    measures: Annotated[
        bool, Flag(), "Whether the standard measures are taken, of every instant."
    ] = False


def load_plan(path: str | os.PathLike[str], set: Changes = ()) -> Plan:
    """Return the plan of a scenario file with a table `[study]`; FileError if it has none."""
    return plan_of(load_scenario(path, set))


def plan_of(experiment: Experiment) -> Plan:
    """Return the plan that the table `[study]` of an experiment's text says."""
    source, told = experiment.source, _table_of(experiment)
    if told.start is not None and told.starts is not None:
        raise FileError(f"{source}: study: start and starts: give one of the two only")
    start = told.start if told.starts is None else np.array(told.starts)
    given = told.runs, told.seed, start, told.vary, told.trajectories, told.measures
    try:
        return planned(experiment, *given)
    except InputError as error:
        text = str(error).removeprefix(f"{source}: ")
        raise FileError(f"{source}: study: {text}" if source else f"study: {text}") from None


def _table_of(experiment: Experiment) -> StudyTable:
    """Return the table of a study in the text of an experiment; FileError if it is not valid."""
    raw, problems = experiment.study, Problems(experiment.source)
    if raw is None:
        raise FileError(
            f"{experiment.source}: there is no table [study], as in\n[study]\nruns = 1000\n"
            'vary = { "task.gain" = { kind = "uniform", low = 0.5, high = 2 } }'
        )
    with problems.at(STUDY):
        c = Context(problems, (STUDY,), {"experiment": experiment})
        told: StudyTable = read_table(StudyTable, raw, c)
    problems.stop()
    return told


def text_of(plan: Plan) -> str:
    """Return the exact TOML text of a study.

    InputError: it is made of Python code that no text can hold.
    """
    tables = parse(plan.experiment.to_toml(complete=True), "text")
    vary = {axis.name: _said(plan, axis) for axis in plan.axes}
    kept = plan.trajectories, plan.measures
    own = StudyTable(plan.draws, plan.seed, plan.start, plan.q0, vary or None, *kept)
    try:
        return write({**tables, STUDY: write_table(own, Context(Problems("<text>")))})
    except NoText as reason:
        raise InputError(f"this study has no text: {reason}") from None


def checked_text(plan: Plan) -> str:
    """Return the text of a study, once it is known to say the same study; InputError if not."""
    text = text_of(plan)
    again = plan_of(Experiment.from_text(text))
    if again.experiment != plan.experiment or text_of(again) != text:
        raise InputError("no text says this study exactly, as a store needs: run it without one")
    for axis, other in zip(plan.axes, again.axes, strict=True):
        same = axis.labels == other.labels
        pairs = zip((axis.values or {}).values(), (other.values or {}).values(), strict=False)
        for one, two in islice((pair for pair in pairs if not axis.is_number), COMPARED):
            same &= plan.experiment.at(axis.name, one) == again.experiment.at(axis.name, two)
        if not same:
            raise InputError(
                f"vary: {axis.name}: no text says these values exactly, as a store needs: give "
                "them as texts or tables of a file, or run without a store"
            )
    return text


def _said(plan: Plan, axis: Axis) -> Any:
    """Return an axis as a text says it: objects by their tables, with their labels."""
    if axis.values is None:
        return axis.sampler
    raw = [_raw(plan.experiment, axis.name, value) for value in axis.values.values()]
    if axis.named or list(labelled(tuple(raw))) != axis.labels:
        raw = [{"label": k, "value": x} for k, x in zip(axis.labels, raw, strict=True)]
    return raw if axis.in_turn else Choice(raw)


def _raw(experiment: Experiment, name: str, value: Any) -> Raw:
    """Return how a text says a value at a name."""
    if is_raw(value):
        return value
    if isinstance(value, np.ndarray | tuple | list):
        return np.asarray(value).tolist()
    path = path_of(experiment, name)
    if value is None or path is None:
        raise InputError(f"vary: {name}: a text cannot say {said(value)}")
    c = Context(Problems("<text>"), facts={"scene": experiment.scene, "apart": True})
    try:
        return path.leaf.spec.write(value, c)
    except NoText as reason:
        raise InputError(f"this study has no text: {reason}") from None
