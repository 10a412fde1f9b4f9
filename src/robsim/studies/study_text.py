"""The text of a study: the table `[study]` beside the tables of its experiment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from robsim.base.errors import FileError, InputError, format_value
from robsim.declare import Flag, Integer, KindOf
from robsim.declare.array_types import Numbers
from robsim.declare.context import MISSING, Context, NoTextError, Raw
from robsim.declare.problems import Problems
from robsim.declare.quantities import DIMENSIONS
from robsim.declare.spec import Spec, make_expected_error
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
SAMPLER_SPEC = KindOf(SAMPLER, short=False)


@dataclass(frozen=True)
class VarySpec(Spec):
    """The varied names, each with a sampler, a list, or values by label."""

    forms: ClassVar[tuple[str, ...]] = ("table",)
    phrase: ClassVar[str] = (
        'a table such as { "task.gain" = { kind = "uniform", low = 1, high = 2 } }'
    )

    def read(self, raw: Raw, c: Context) -> dict[str, Any]:
        if not isinstance(raw, Mapping):
            raise make_expected_error(self.words(), raw)
        values = _flatten_names(raw)
        for name, each in values.items():
            if is_sampler_table(each):
                unit = get_unit_at(c.facts["experiment"], name)
                inner = c.at(name).with_facts(of=[unit if unit in DIMENSIONS else "1"])
                values[name] = SAMPLER_SPEC.read_or_report(each, inner)
        return {name: each for name, each in values.items() if each is not MISSING}

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
    """Return dotted names as single keys; names without quotes are nested tables in TOML."""
    names: dict[str, Any] = {}
    for key, value in raw.items():
        name = f"{prefix}{key}"
        is_table = isinstance(value, Mapping) and not is_sampler_table(value)
        inner = _flatten_names(value, f"{name}.") if is_table else {}
        names |= inner if any(map(is_sampler_table, inner.values())) else {name: value}
    return names


@dataclass(frozen=True)
class StudyTable:
    """The table [study] in the text of an experiment."""

    rivals: ClassVar[Any] = ((("start",), ("starts",)),)

    runs: Annotated[
        int | None,
        Integer(1, MOST_RUNS),
        "Number of draws; each is simulated with every combination of enumerated values.",
    ] = None
    seed: Annotated[int | None, Integer(0, 2**64 - 1), "Seed of all samples."] = None
    start: Annotated[Any, KindOf(START, short=False), "Sampler of starts."] = None
    starts: Annotated[
        Any, Numbers(shape=("k", "n")), "Coordinates of all starts, one row for each draw."
    ] = None
    vary: Annotated[Any, VarySpec(), "Varied values by dotted names."] = None
    trajectories: Annotated[
        int | None, Integer(1, 10**7), "Interval of the instants that a store keeps."
    ] = None
    measures: Annotated[
        bool, Flag(), "Whether the standard measures are computed from every instant."
    ] = False


def read_plan(experiment: Experiment) -> Plan:
    """Return the plan in the table `[study]` of an experiment; FileError if it is invalid."""
    source, table = experiment.source, _read_study_table(experiment)
    start = table.start if table.starts is None else np.array(table.starts)
    arguments = table.runs, table.seed, start, table.vary, table.trajectories, table.measures
    try:
        return make_plan(experiment, *arguments)
    except InputError as error:
        text = str(error).removeprefix(f"{source}: ")
        raise FileError(": ".join(filter(None, [source, STUDY, text]))) from None


def _read_study_table(experiment: Experiment) -> StudyTable:
    """Return the table [study] of an experiment; raise FileError if it is missing or invalid."""
    raw, problems = experiment.study, Problems(experiment.source)
    if raw is None:
        raise FileError(
            f"{experiment.source}: there is no table [study], as in\n[study]\nruns = 1000\n"
            'vary = { "task.gain" = { kind = "uniform", low = 0.5, high = 2 } }'
        )
    with problems.at(STUDY):
        c = Context(problems, (STUDY,), {"experiment": experiment})
        table: StudyTable = read_table(StudyTable, raw, c)
    problems.stop()
    return table


def format_plan(plan: Plan) -> str:
    """Return the exact TOML text of a study.

    Raises InputError if the study contains Python code that TOML cannot represent.
    """
    experiment, options = plan.experiment, (plan.trajectories, plan.measures)
    c = Context(Problems("<text>"), facts={"scene": experiment.scene, "apart": True})
    tables = parse_toml(experiment.to_toml(complete=True), "text")
    try:
        vary = {axis.name: _write_axis(experiment, axis, c) for axis in plan.axes}
        table = StudyTable(plan.draws, plan.seed, plan.start, plan.q0, vary or None, *options)
        return write_toml({**tables, STUDY: write_table(table, c)})
    except NoTextError as reason:
        raise InputError(f"this study has no text: {reason}") from None


def _write_axis(experiment: Experiment, axis: StudyAxis, c: Context) -> Any:
    """Return the values of an axis as in a TOML text: objects as tables, with their labels."""
    if axis.values is None:
        return axis.sampler
    raw = [_write_axis_value(experiment, axis.name, value, c) for value in axis.values.values()]
    if axis.has_labels or list(generate_labels(tuple(raw))) != axis.labels:
        raw = [{"label": k, "value": x} for k, x in zip(axis.labels, raw, strict=True)]
    return raw if axis.in_turn else Choice(raw)


def _write_axis_value(experiment: Experiment, name: str, value: Any, c: Context) -> Raw:
    """Return a value at a name as in a TOML text."""
    if is_toml_value(value):
        return value
    if isinstance(value, np.ndarray | tuple | list):
        return np.asarray(value).tolist()
    path = find_path(experiment, name)
    if value is None or path is None:
        raise InputError(f"vary: {name}: a text cannot hold {format_value(value)}")
    return path.leaf.spec.write(value, c)
