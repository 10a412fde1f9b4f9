"""Maps of studies: the data of a page that shows thousands of runs as points.

A map has a header and arrays by name, as a recording has. The entries of the header are:

* format, version: "robsim study", and the number of the version.
* title: title of the varied experiment.
* summary: the numbers of runs and draws.
* columns: the columns of the table, each with an array of one number for each run. Their meanings
  are in `robsim.studies.result_columns.COLUMN_MEANINGS`. An entry has a name and a unit. `shared`
  marks columns with one number for all runs of a draw. `measure` marks measures of the end, which
  runs that could not begin do not have. If an entry has `labels`, its array has the indices of the
  labels, and `numbers` are the numbers of the labels, if any.
* outcomes: name, words and colour of each outcome that occurs. The array "outcome" has the indices
  of these entries.
* filters: names of the columns that select runs on a page.
* in_turn, cells: the columns that differ within one draw, and the number of runs of a draw.
* counts: for each value of the column `by`, the number of runs, the number of runs that began, and
  the share of each outcome with its interval.
* notes: remarks about the counts.

Numbers are float32; integers below 2^32 are uint32.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.errors import InputError
from robsim.engine.outcome import Outcome
from robsim.page.recording_builder import Recording
from robsim.plot import palette
from robsim.studies.outcome_counts import MOST_GROUPS, OutcomeCounts
from robsim.studies.result_columns import COLUMN_MEANINGS
from robsim.studies.study_axes import StudyAxis
from robsim.studies.study_result import StudyResult

FORMAT, VERSION = "robsim study", 1
MOST_RUNS = 1_000_000  # largest number of points that a page moves fluently
MEASURES = tuple(COLUMN_MEANINGS)[tuple(COLUMN_MEANINGS).index("began") + 1 :]
_UNIT = re.compile(r"\(([^()]*)\)$")  # at the end of a meaning


class StudyMap(Recording):
    """The map of a study; the module describes its header and arrays."""

    def __repr__(self) -> str:
        """Return the title and the number of runs."""
        return f"<StudyMap {self.header['title']!r} of {len(self.arrays['run'])} runs>"


def build_study_map(study: StudyResult) -> StudyMap:
    """Return the map of the runs of a study.

    Raise InputError if there are no runs, or more than a page can show.
    """
    _check_map_size(study)
    labelled = {axis.name: axis for axis in study.plan.axes if _has_few_values(axis)}
    columns, arrays = _build_map_columns(study, labelled)
    outcomes, arrays["outcome"] = _list_map_outcomes(study)
    header = {
        "format": FORMAT,
        "version": VERSION,
        "title": study.experiment.title or "study",
        "summary": _summarise_plan(study),
        "columns": columns,
        "outcomes": outcomes,
        "filters": list(labelled),
        "in_turn": [axis.name for axis in study.plan.in_turn if axis.name in labelled],
        "cells": study.plan.cells,
        **_build_count_entries(study, [each["name"] for each in outcomes]),
    }
    return StudyMap(header, arrays)


def _check_map_size(study: StudyResult) -> None:
    """Raise InputError if there are no runs, or more than a page can show."""
    if study.plan.runs > MOST_RUNS:
        raise InputError(
            f"a map shows at most {MOST_RUNS} runs, and this study has {study.plan.runs}; "
            "count them by study.counts, or plot study.table"
        )
    if not len(study.runs):
        raise InputError("the study has no runs yet, so it has no map")


def _build_map_columns(
    study: StudyResult, labelled: dict[str, StudyAxis]
) -> tuple[list[dict[str, Any]], dict[str, NDArray[Any]]]:
    """Return the entries of all columns except the outcome, and their numbers or indices."""
    units, shared = _find_column_units(study), _find_shared_columns(study)
    columns: list[dict[str, Any]] = []
    arrays: dict[str, NDArray[Any]] = {}
    for name in (str(each) for each in study.table if each != "outcome"):
        base, axis = name.split("[")[0], labelled.get(name)
        own: dict[str, Any] = {"name": name, "unit": units.get(base, "")}
        own |= {"shared": base in shared, "measure": name in MEASURES}
        columns.append(own if axis is None else own | _list_axis_labels(axis))
        arrays[name] = (
            _convert_column_numbers(study, name)
            if axis is None
            else _encode_axis_values(study, axis)
        )
    return columns, arrays


def _has_few_values(axis: StudyAxis) -> bool:
    """Return whether an axis has few enough values to select runs by them."""
    return axis.values is not None and (not axis.is_number or len(axis.values) <= MOST_GROUPS)


def _list_axis_labels(axis: StudyAxis) -> dict[str, Any]:
    """Return the labels of an axis, and its numbers if it has numbers."""
    values = list((axis.values or {}).values())
    return {"labels": axis.labels, **({"numbers": values} if axis.is_number else {})}


def _encode_axis_values(study: StudyResult, axis: StudyAxis) -> NDArray[Any]:
    """Return the index of the value of each run."""
    return study.plan.codes(axis, study.runs).astype(np.uint32)


def _convert_column_numbers(study: StudyResult, name: str) -> NDArray[Any]:
    """Return a column as float32, or uint32 if it has integers."""
    values: NDArray[Any] = study.table[name].to_numpy()
    whole = values.dtype.kind in "iub"
    with np.errstate(over="ignore"):  # too large for float32: infinite, not drawn
        return np.asarray(values, dtype=np.uint32 if whole else np.float32)


def _list_map_outcomes(study: StudyResult) -> tuple[list[dict[str, str]], NDArray[Any]]:
    """Return the entries of the outcomes that occur, and the index of the outcome of each run."""
    own = study.table["outcome"].cat.remove_unused_categories()
    occurring = [Outcome[str(name)] for name in own.cat.categories]
    entries = [
        {"name": each.name, "words": each.words, "color": palette.OUTCOMES[each][0]}
        for each in occurring
    ]
    return entries, own.cat.codes.to_numpy().astype(np.uint32)


def _find_column_units(study: StudyResult) -> dict[str, str]:
    """Return the units of the columns that have a unit."""
    matches = {name: _UNIT.search(meaning) for name, meaning in COLUMN_MEANINGS.items()}
    own = {name: match[1] for name, match in matches.items() if match}
    declared = {each.path: each.unit for each in study.experiment.controls()}
    for axis in study.plan.axes:
        unit = declared.get(axis.name)
        own[axis.name] = unit if isinstance(unit, str) and unit != "1" else ""
    return own


def _find_shared_columns(study: StudyResult) -> set[str]:
    """Return the columns that are equal in all runs of one draw."""
    random = {axis.name for axis in study.plan.axes if not axis.in_turn}
    return {"draw", *random, *(name for name in COLUMN_MEANINGS if name.startswith("start_"))}


def _summarise_plan(study: StudyResult) -> str:
    """Return the numbers of runs, draws and varied values as text."""
    plan, count = study.plan, len(study.runs)
    turns = " × ".join(f"{len(axis.labels)} values of {axis.name}" for axis in plan.in_turn)
    draws = f"{plan.draws} draws" + (f" × {turns}" if turns else "")
    part = "" if count == plan.runs else f" of {plan.runs}"
    return f"{count}{part} runs: {draws}"


def _build_count_entries(study: StudyResult, names: list[str]) -> dict[str, Any]:
    """Return the counts of the outcomes by the first column with few values."""
    in_turn = (axis.name for axis in study.plan.in_turn if len(axis.labels) <= MOST_GROUPS)
    counts = study.counts(next(in_turn, None))
    return {
        "by": counts.by or "",
        "counts": _build_count_rows(counts, names),
        "notes": counts.notes,
    }


def _build_count_rows(counts: OutcomeCounts, names: list[str]) -> list[dict[str, Any]]:
    """Return the rows of counts; each outcome is the index of its entry."""
    return [
        {
            "label": label,
            "runs": runs,
            "began": began,
            "shares": [
                [i, shares[name].count, shares[name].value, str(shares[name])]
                for i, name in enumerate(names)
                if name in shares
            ],
        }
        for label, (runs, began, shares) in counts.rows.items()
    ]
