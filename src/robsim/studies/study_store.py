"""The folder of a study: its text, and its rows as Parquet files that are written atomically."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from robsim.base.atomic_files import convert_os_errors, write_whole
from robsim.base.errors import FileError, InputError
from robsim.engine.outcome import Outcome
from robsim.files.toml import read_toml_text
from robsim.kernels.machine.cache_files import KERNEL_HASH
from robsim.run.experiment import Experiment
from robsim.run.simulation_dataset import VERSION
from robsim.studies.result_columns import Columns, empty_columns, make_table
from robsim.studies.row_simulator import ChunkResult
from robsim.studies.study_plan import Codes, Plan
from robsim.studies.study_text import format_plan, read_plan
from robsim.studies.trajectory_store import TrajectoryStore, count_trajectory_bytes

FORMAT = 1
VERSIONS = {"robsim": VERSION, "kernels": KERNEL_HASH}  # they determine the bits of a run
TEXT, ABOUT, TRACKS = "study.toml", "study.json", "trajectories.zarr"
COMPARED_VALUES = 50  # values of an axis that are compared with their text
ROW_BYTES = 150  # disk space of a row
_ROW_FILE = re.compile(r"rows-(\d{13})-(\d{13})\.parquet")


class RowFile(NamedTuple):
    """A file with the rows from `first` to `last` (exclusive)."""

    first: int
    last: int
    path: Path


@dataclass(frozen=True)
class StudyStore:
    """A folder with a study."""

    folder: Path

    def begin(self, plan: Plan, resume: bool) -> None:
        """Write the description of the study.

        Raises FileError or InputError if the folder holds another study or has too little space.
        """
        import_pyarrow()
        text = make_exact_text(plan)
        if not self.is_there and self.parts():
            raise FileError(
                f"{self.folder} has rows of a study, but no {ABOUT}; choose another folder"
            )
        if self.is_there:
            self._check(text, resume)
            return
        self._check_room(plan)
        about = {"format": FORMAT, **VERSIONS, "runs": plan.runs, "draws": plan.draws}
        write_whole(self.folder / TEXT, text)
        write_whole(self.folder / ABOUT, json.dumps(about, indent=1) + "\n")

    @property
    def is_there(self) -> bool:
        """Whether the folder holds a study."""
        with convert_os_errors(self.folder, "read"):
            return (self.folder / ABOUT).exists()

    def plan(self) -> Plan:
        """Return the plan of the study; raise FileError if it cannot be read."""
        self.about()
        path = self.folder / TEXT
        return read_plan(Experiment.from_text(read_toml_text(path), str(path)))

    def about(self) -> dict[str, Any]:
        """Return the description of the study; raise FileError if its format is unknown."""
        path = self.folder / ABOUT
        if not self.is_there:
            raise FileError(f"{self.folder}: no study here: {ABOUT} is missing")
        text = read_toml_text(path)
        try:
            about = json.loads(text)
            version = int(about["format"])
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
            raise FileError(f"{path}: not in the form that RobSim writes") from None
        if version > FORMAT:
            newer = about.get("robsim", "a newer version")
            raise FileError(
                f"{self.folder}: a study of format {version}, of RobSim {newer:.40}; this is "
                f"{VERSION}, which reads format {FORMAT}: install the newer one"
            )
        return dict(about)

    def parts(self) -> list[RowFile]:
        """Return the files of rows in order; raise FileError if two of them overlap."""
        with convert_os_errors(self.folder, "read"):
            names = sorted(path.name for path in self.folder.iterdir())
        matches = [
            (match, self.folder / name) for name in names if (match := _ROW_FILE.fullmatch(name))
        ]
        parts = [RowFile(int(match[1]), int(match[2]), path) for match, path in matches]
        for one, other in pairwise(parts):
            if other.first < one.last:
                raise FileError(f"{self.folder}: {one.path.name} and {other.path.name} overlap")
        return parts

    def missing(self, runs: int) -> Iterator[tuple[int, int]]:
        """Yield the ranges of runs without rows, as first and last (exclusive)."""
        first = 0
        for part in self.parts():
            if part.last > runs:
                raise FileError(f"{part.path}: the study has {runs} runs only")
            if part.first > first:
                yield first, part.first
            first = part.last
        if first < runs:
            yield first, runs

    def put(self, plan: Plan, first: int, last: int, result: ChunkResult) -> None:
        """Write the rows of some runs; raise FileError and leave no file if that fails.

        Instants are written first: a reader ignores instants without rows.
        """
        if plan.trajectories:
            TrajectoryStore(self.folder / TRACKS).put(plan, first, result.tracks)
        rows = encode_parquet(make_table(plan, np.arange(first, last), result.facts))
        write_whole(self.folder / f"rows-{first:013d}-{last:013d}.parquet", rows)

    def facts(self, plan: Plan) -> tuple[Codes, Columns]:
        """Return the numbers of the finished runs, and their columns."""
        pa, pq = import_pyarrow()
        runs: list[Codes] = []
        parts: list[Columns] = []
        for part in self.parts():
            with convert_os_errors(part.path, "read"):
                try:
                    table = pq.read_table(part.path)
                except pa.ArrowException as error:
                    why = str(error).splitlines()[0]
                    advice = "delete it, and resume the study"
                    raise FileError(f"{part.path} is damaged ({why:.120}); {advice}") from None
            parts.append(_read_facts(table, part, plan))
            runs.append(np.arange(part.first, part.last))
        if not parts:
            return np.arange(0), empty_columns(plan)
        return np.concatenate(runs), {
            name: np.concatenate([part[name] for part in parts]) for name in parts[0]
        }

    def _check(self, text: str, resume: bool) -> None:
        """Raise FileError if the folder holds another study, or this study cannot be resumed."""
        about = self.about()
        if read_toml_text(self.folder / TEXT) != text:
            raise FileError(
                f"{self.folder} holds another study; choose another folder, or remove this one"
            )
        if not resume:
            raise FileError(
                f"{self.folder} holds this study already; resume it (resume=True, --resume), or "
                "choose another folder"
            )
        other = {key: (about.get(key), now) for key, now in VERSIONS.items()}
        differ = [f"{key} {was}, now {now}" for key, (was, now) in other.items() if was != now]
        if differ:
            raise FileError(
                f"{self.folder} was begun with other versions ({'; '.join(differ)}), and new rows "
                "would not have the same bits: begin a new study"
            )

    def _check_room(self, plan: Plan) -> None:
        """Raise InputError if the disk has too little space for the rows."""
        with convert_os_errors(self.folder):
            free = shutil.disk_usage(self.folder).free
        need = plan.runs * (ROW_BYTES + (count_trajectory_bytes(plan) if plan.trajectories else 0))
        if need > free:
            raise InputError(
                f"{plan.runs} runs need about {need / 1e9:.3g} GB in {self.folder}, and "
                f"{free / 1e9:.3g} GB are free: fewer runs, or another disk"
            )


def make_exact_text(plan: Plan) -> str:
    """Return the text of a study; raise InputError if the text does not reproduce the study."""
    text = format_plan(plan)
    again = read_plan(Experiment.from_text(text))
    if again.experiment != plan.experiment or format_plan(again) != text:
        raise InputError(
            "no text describes this study exactly, and a store needs such a text: run it without a "
            "store"
        )
    for axis, other in zip(plan.axes, again.axes, strict=True):
        pairs = zip((axis.values or {}).values(), (other.values or {}).values(), strict=False)
        for one, two in () if axis.is_number else islice(pairs, COMPARED_VALUES):
            if plan.experiment.at(axis.name, one) != again.experiment.at(axis.name, two):
                raise InputError(
                    f"vary: {axis.name}: no text describes these values exactly, as a store needs: "
                    "give them as texts or tables of a file, or run without a store"
                )
    return text


def _read_facts(table: Any, part: RowFile, plan: Plan) -> Columns:
    """Return the results of a file of rows; raise FileError if its runs differ from its name."""
    if table.num_rows != part.last - part.first:
        raise FileError(f"{part.path}: {table.num_rows} rows instead of {part.last - part.first}")
    try:
        data = table.to_pandas()
        if not np.array_equal(data["run"], np.arange(part.first, part.last)):
            raise ValueError
        names = {axis.name for axis in plan.axes}
        known = {"run", "draw"} | {name for name in data if str(name).split("[")[0] in names}
        facts = {str(name): data[name].to_numpy() for name in data if name not in known}
        codes = np.array([int(Outcome[name]) for name in facts["outcome"]], dtype=np.int8)
    except (KeyError, ValueError):
        raise FileError(f"{part.path}: not in the form that RobSim writes") from None
    return {**facts, "outcome": codes}


def encode_parquet(table: pd.DataFrame) -> memoryview:
    """Return a table as the content of a Parquet file."""
    pa, pq = import_pyarrow()
    sink = pa.BufferOutputStream()
    pq.write_table(pa.Table.from_pandas(table, preserve_index=False), sink)
    return memoryview(sink.getvalue())


def import_pyarrow() -> tuple[Any, Any]:
    """Import PyArrow and its Parquet module; raise InputError if it is not installed."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise InputError(
            "stores and Parquet files need PyArrow: pip install 'robsim[store]'"
        ) from None
    return pyarrow, pyarrow.parquet
