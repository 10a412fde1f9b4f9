"""The text of a study: the table `[study]` beside those of its experiment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.errors import FileError, InputError, format_value
from robsim.declare import Flag, Integer
from robsim.declare import KindOf as ChoiceSpec
from robsim.declare.array_types import Numbers
from robsim.declare.problems import Problems
from robsim.declare.quantities import DIMENSIONS
from robsim.declare.spec import MISSING, Context, NoTextError, Raw, Spec, make_expected_error
from robsim.declare.tables import read_table, write_table
from robsim.files.toml import parse_toml, write_toml
from robsim.run.experiment import Experiment
from robsim.run.experiment_paths import find_path, get_unit_at
from robsim.starts.start_samplers import START
from robsim.studies.samplers import SAMPLER, Choice
from robsim.studies.study_axes import StudyAxis
from robsim.studies.study_plan import MOST_RUNS, Plan, make_plan
from robsim.studies.value_grid import generate_labels
from robsim.studies.value_lists import is_toml_value

STUDY = "study"  # the key of the table
SAMPLER_SPEC = ChoiceSpec(SAMPLER, short=False)


@dataclass(frozen=True)
class VarySpec(Spec):
    """The dotted names that differ from run to run: a sampler, a list, or values by label."""

    form: ClassVar[str] = "table"
    phrase: ClassVar[str] = (
        'a table such as { "task.gain" = { kind = "uniform", low = 1, high = 2 } }'
    )

    def read(self, raw: Raw, c: Context) -> dict[str, Any]:
        if not isinstance(raw, Mapping):
            raise make_expected_error(self.words(), raw)
        found = _flatten_names(raw)
        for name, each in found.items():
            if is_sampler_table(each):
                unit = get_unit_at(c.facts["experiment"], name)
                inner = c.at(name).knowing(of=[unit if unit in DIMENSIONS else "1"])
                found[name] = inner.tried(SAMPLER_SPEC, each)
        return {name: each for name, each in found.items() if each is not MISSING}

    def write(self, value: Any, c: Context) -> dict[str, Raw]:
        each = value.items()
        return {k: x if isinstance(x, list) else SAMPLER_SPEC.write(x, c.at(k)) for k, x in each}

    def schema(self, define: Any) -> dict[str, Any]:
        listed: list[Any] = [{"type": "array"}, {"type": "object"}]
        return {"type": "object", "additionalProperties": {"anyOf": listed}}


def is_sampler_table(raw: Raw) -> bool:
    """Return whether a raw value is the table of a sampler."""
    kind = raw.get("kind") if isinstance(raw, Mapping) else None
    return isinstance(kind, str) and kind in SAMPLER.names


def _flatten_names(raw: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return names that were written without quotes, and hence as nested tables, in one piece."""
    found: dict[str, Any] = {}
    for key, value in raw.items():
        name = f"{prefix}{key}"
        is_table = isinstance(value, Mapping) and not is_sampler_table(value)
        inner = _flatten_names(value, f"{name}.") if is_table else {}
        found |= inner if any(map(is_sampler_table, inner.values())) else {name: value}
    return found


@dataclass(frozen=True)
class StudyTable:
    """The table of a study in the text of its experiment."""

    rivals: ClassVar[Any] = ((("start",), ("starts",)),)

    runs: Annotated[
        int | None, Integer(1, MOST_RUNS), "How many draws; each is run with all that is in turn."
    ] = None
    seed: Annotated[int | None, Integer(0, 2**64 - 1), "Seed of all that is drawn."] = None
    start: Annotated[Any, ChoiceSpec(START, short=False), "Where starts are drawn."] = None
    starts: Annotated[
        Any, Numbers(shape=("k", "n")), "Coordinates of all starts, one row for each run."
    ] = None
    vary: Annotated[Any, VarySpec(), "What differs from run to run, by dotted names."] = None
    trajectories: Annotated[
        int | None, Integer(1, 10**7), "Every n-th instant that is kept, in a store."
    ] = None
    measures: Annotated[
        bool, Flag(), "Whether the standard measures are taken, of every instant."
    ] = False


def read_plan(experiment: Experiment) -> Plan:
    """Return the plan that the table `[study]` of an experiment's text says; or FileError."""
    source, told = experiment.source, _read_study_table(experiment)
    start = told.start if told.starts is None else np.array(told.starts)
    given = told.runs, told.seed, start, told.vary, told.trajectories, told.measures
    try:
        return make_plan(experiment, *given)
    except InputError as error:
        text = str(error).removeprefix(f"{source}: ")
        raise FileError(": ".join(filter(None, [source, STUDY, text]))) from None


def _read_study_table(experiment: Experiment) -> StudyTable:
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


def format_plan(plan: Plan) -> str:
    """Return the exact TOML text of a study.

    InputError: it is made of Python code that no text can hold.
    """
    one, kept = plan.experiment, (plan.trajectories, plan.measures)
    c = Context(Problems("<text>"), facts={"scene": one.scene, "apart": True})
    tables = parse_toml(one.to_toml(complete=True), "text")
    try:
        vary = {axis.name: _write_axis(one, axis, c) for axis in plan.axes}
        own = StudyTable(plan.draws, plan.seed, plan.start, plan.q0, vary or None, *kept)
        return write_toml({**tables, STUDY: write_table(own, c)})
    except NoTextError as reason:
        raise InputError(f"this study has no text: {reason}") from None


def _write_axis(experiment: Experiment, axis: StudyAxis, c: Context) -> Any:
    """Return an axis as a text says it: objects by their tables, with their labels."""
    if axis.values is None:
        return axis.sampler
    raw = [_write_axis_value(experiment, axis.name, value, c) for value in axis.values.values()]
    if axis.named or list(generate_labels(tuple(raw))) != axis.labels:
        raw = [{"label": k, "value": x} for k, x in zip(axis.labels, raw, strict=True)]
    return raw if axis.in_turn else Choice(raw)


def _write_axis_value(experiment: Experiment, name: str, value: Any, c: Context) -> Raw:
    """Return how a text says a value at a name."""
    if is_toml_value(value):
        return value
    if isinstance(value, np.ndarray | tuple | list):
        return np.asarray(value).tolist()
    path = find_path(experiment, name)
    if value is None or path is None:
        raise InputError(f"vary: {name}: a text cannot say {format_value(value)}")
    return path.leaf.spec.write(value, c)
