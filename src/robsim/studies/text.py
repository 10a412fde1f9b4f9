"""The text of a study: the table `[study]` beside those of its experiment."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.errors import FileError, InputError
from robsim.declare import Choice as ChoiceSpec
from robsim.declare import Flag, Whole
from robsim.declare.arrays import Matrix
from robsim.declare.problems import Problems
from robsim.declare.spec import MISSING, Context, NoText, Raw, Spec, expected
from robsim.declare.tables import read_table, write_table
from robsim.files.changes import Changes
from robsim.files.toml import parse, write
from robsim.run.experiment import Experiment, load_scenario
from robsim.run.present import raw_at
from robsim.studies import in_turn as _in_turn  # noqa: F401  a sampler that files may name
from robsim.studies import starts as _starts  # noqa: F401  likewise
from robsim.studies.axes import Axis
from robsim.studies.plan import MOST_RUNS, Plan, planned
from robsim.studies.samplers import SAMPLER
from robsim.studies.starts import START

STUDY = "study"  # the key of the table
SAMPLED = ChoiceSpec(SAMPLER, short=False)


@dataclass(frozen=True)
class VarySpec(Spec):
    """The dotted names that differ from run to run: a sampler, a list, or values by label."""

    form: ClassVar[str] = "table"

    def read(self, raw: Raw, c: Context) -> dict[str, Any]:
        if not isinstance(raw, Mapping):
            raise expected(self.words(), raw)
        found = {}
        for name, each in _flat(raw).items():
            drawn = isinstance(each, Mapping) and each.get("kind") in SAMPLER.kinds
            value = c.at(name).tried(SAMPLED, each) if drawn else each
            if value is not MISSING:
                found[name] = value
        return found

    def write(self, value: Any, c: Context) -> dict[str, Raw]:
        drawn = {name: x for name, x in value.items() if not isinstance(x, list | dict)}
        return {**value, **{name: SAMPLED.write(x, c.at(name)) for name, x in drawn.items()}}

    def words(self) -> str:
        return 'a table such as { "task.gain" = { kind = "uniform", low = 1, high = 2 } }'

    def schema(self, define: Any) -> dict[str, Any]:
        listed: list[Any] = [{"type": "array"}, {"type": "object"}]
        return {"type": "object", "additionalProperties": {"anyOf": listed}}

    def wrong(self) -> Sequence[Raw]:
        return [3, ["x"]]


def _flat(raw: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return names that were written without quotes, and hence as nested tables, in one piece."""
    found: dict[str, Any] = {}
    for key, value in raw.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping) and "kind" not in value and _holds_sampler(value):
            found |= _flat(value, f"{name}.")
        else:
            found[name] = value
    return found


def _holds_sampler(raw: Any) -> bool:
    if not isinstance(raw, Mapping):
        return False
    return raw.get("kind") in SAMPLER.kinds or any(map(_holds_sampler, raw.values()))


@dataclass(frozen=True)
class StudyTable:
    """The table of a study in the text of its experiment."""

    runs: Annotated[
        int | None, Whole(1, MOST_RUNS), "How many draws; each is run with all that is in turn."
    ] = None
    seed: Annotated[int | None, Whole(0, 2**64 - 1), "Seed of all that is drawn."] = None
    start: Annotated[Any, ChoiceSpec(START, short=False), "Where starts are drawn."] = None
    starts: Annotated[Any, Matrix(), "Coordinates of all starts, one row for each run."] = None
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
    raw = experiment.tables.get(STUDY)
    source = experiment.source
    if raw is None:
        raise FileError(
            f"{source}: there is no table [study], as in\n[study]\nruns = 1000\n"
            'vary = { "task.gain" = { kind = "uniform", low = 0.5, high = 2 } }'
        )
    problems = Problems(source)
    with problems.at(STUDY):
        said: StudyTable = read_table(StudyTable, raw, Context(problems, (STUDY,)))
    problems.stop()
    if said.start is not None and said.starts is not None:
        raise FileError(f"{source}: study: start and starts: give one of the two only")
    start = said.start if said.starts is None else np.array(said.starts)
    try:
        return planned(
            experiment,
            said.runs,
            said.seed,
            start,
            said.vary,
            said.trajectories,
            said.measures,
        )
    except InputError as error:
        text = str(error).removeprefix(f"{source}: ")
        raise FileError(f"{source}: study: {text}" if source else f"study: {text}") from None


def text_of(plan: Plan) -> str:
    """Return the exact TOML text of a study.

    InputError: it is made of Python code that no text can hold.
    """
    tables = parse(plan.experiment.to_toml(), "text")
    vary = {axis.name: _said(plan, axis) for axis in plan.axes}
    kept = plan.trajectories, plan.measures
    own = StudyTable(plan.draws, plan.seed, plan.start, plan.q0, vary or None, *kept)
    try:
        return write({**tables, STUDY: write_table(own, Context(Problems("<text>")))})
    except NoText as reason:
        raise InputError(f"this study has no text: {reason}") from None


def _said(plan: Plan, axis: Axis) -> Any:
    """Return an axis as a text says it: objects by their tables."""
    if axis.values is None:
        return axis.sampler
    raw = {label: _raw(plan.experiment, axis.name, value) for label, value in axis.values.items()}
    if axis.in_turn:
        return raw
    return {"kind": "choice", "values": list(raw.values())}


def _raw(experiment: Experiment, name: str, value: Any) -> Raw:
    """Return how the text says a value at a name."""
    if isinstance(value, bool | int | float | str | list | dict):
        return value
    if value is None:
        raise InputError(f"vary: {name}: a text cannot say None")
    return raw_at(parse(experiment.at(name, value).to_toml(), "text"), name)
