"""The folder of a study: its text, and its rows as Parquet files that are whole or not there."""

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
from robsim.studies.study_plan import Plan
from robsim.studies.study_text import format_plan, read_plan
from robsim.studies.trajectory_store import TrajectoryStore, count_trajectory_bytes

FORMAT = 1
VERSIONS = {"robsim": VERSION, "kernels": KERNEL_HASH}  # which decide the bits of a run
TEXT, ABOUT, TRACKS = "study.toml", "study.json", "trajectories.zarr"
COMPARED_VALUES = 50  # values of an axis that are compared with what their text says
ROW_BYTES = 150  # of a row on the disk
_ROW_FILE = re.compile(r"rows-(\d{13})-(\d{13})\.parquet")


class RowFile(NamedTuple):
    """A file of rows: those from one until before another."""

    first: int
    last: int
    path: Path


@dataclass(frozen=True)
class StudyStore:
    """A folder that holds a study."""

    folder: Path

    def begin(self, plan: Plan, resume: bool) -> None:
        """Write what the study is; FileError or InputError if another one is in the way."""
        import_pyarrow()
        text = make_exact_text(plan)
        if not self.is_there and self.parts():
            raise FileError(
                f"{self.folder} has rows of a study, and not its {ABOUT}; choose another folder"
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
        """Return the plan of the study here; FileError if there is none that can be read."""
        self.about()
        path = self.folder / TEXT
        return read_plan(Experiment.from_text(read_toml_text(path), str(path)))

    def about(self) -> dict[str, Any]:
        """Return what is said of the study; FileError if it is none of this or an older format."""
        path = self.folder / ABOUT
        if not self.is_there:
            raise FileError(f"{self.folder}: there is no study: it has no {ABOUT}")
        try:
            about = json.loads(read_toml_text(path))
            found = int(about["format"])
        except (ValueError, KeyError, TypeError, OverflowError):
            raise FileError(f"{path}: not as RobSim wrote it") from None
        if found > FORMAT:
            newer = about.get("robsim", "a newer version")
            raise FileError(
                f"{self.folder}: a study of format {found}, of RobSim {newer:.40}; this is "
                f"{VERSION}, which reads format {FORMAT}: install the newer one"
            )
        return dict(about)

    def parts(self) -> list[RowFile]:
        """Return the files of rows, in their order; FileError if two of them overlap."""
        with convert_os_errors(self.folder, "read"):
            names = sorted(path.name for path in self.folder.iterdir())
        found = [
            (match, self.folder / name) for name in names if (match := _ROW_FILE.fullmatch(name))
        ]
        parts = [RowFile(int(match[1]), int(match[2]), path) for match, path in found]
        for one, other in pairwise(parts):
            if other.first < one.last:
                raise FileError(f"{self.folder}: {one.path.name} and {other.path.name} overlap")
        return parts

    def missing(self, runs: int) -> Iterator[tuple[int, int]]:
        """Yield the runs that have no row yet, from one until before another."""
        first = 0
        for part in self.parts():
            if part.last > runs:
                raise FileError(f"{part.path}: the study has {runs} runs only")
            if part.first > first:
                yield first, part.first
            first = part.last
        if first < runs:
            yield first, runs

    def put(self, plan: Plan, first: int, last: int, found: ChunkResult) -> None:
        """Write the rows of some runs; FileError if they cannot be, and nothing is left then.

        What was kept of their instants is written first: without its rows it is not read.
        """
        if plan.trajectories:
            TrajectoryStore(self.folder / TRACKS).put(plan, first, found.tracks)
        rows = encode_parquet(make_table(plan, np.arange(first, last), found.facts))
        write_whole(self.folder / f"rows-{first:013d}-{last:013d}.parquet", rows)

    def facts(self, plan: Plan) -> tuple[Any, Columns]:
        """Return the numbers of the runs that are there, and what came out of them."""
        pa, pq = import_pyarrow()
        runs: list[Any] = []
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
                f"{self.folder} was begun elsewhere ({'; '.join(differ)}), and its rows would not "
                "have the same bits: begin it anew"
            )

    def _check_room(self, plan: Plan) -> None:
        """Raise InputError if the disk has no room for the rows, before anything runs."""
        with convert_os_errors(self.folder):
            free = shutil.disk_usage(self.folder).free
        need = plan.runs * (ROW_BYTES + (count_trajectory_bytes(plan) if plan.trajectories else 0))
        if need > free:
            raise InputError(
                f"{plan.runs} runs need about {need / 1e9:.3g} GB in {self.folder}, and "
                f"{free / 1e9:.3g} GB are free: fewer runs, or another disk"
            )


def make_exact_text(plan: Plan) -> str:
    """Return the text of a study, once it is known to say the same study; InputError if not."""
    text = format_plan(plan)
    again = read_plan(Experiment.from_text(text))
    if again.experiment != plan.experiment or format_plan(again) != text:
        raise InputError("no text says this study exactly, as a store needs: run it without one")
    for axis, other in zip(plan.axes, again.axes, strict=True):
        pairs = zip((axis.values or {}).values(), (other.values or {}).values(), strict=False)
        for one, two in () if axis.is_number else islice(pairs, COMPARED_VALUES):
            if plan.experiment.at(axis.name, one) != again.experiment.at(axis.name, two):
                raise InputError(
                    f"vary: {axis.name}: no text says these values exactly, as a store needs: "
                    "give them as texts or tables of a file, or run without a store"
                )
    return text


def _read_facts(table: Any, part: RowFile, plan: Plan) -> Columns:
    """Return what came out of the runs of a file; FileError if it is not theirs."""
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
        raise FileError(f"{part.path}: not as RobSim wrote it") from None
    return {**facts, "outcome": codes}


def encode_parquet(table: pd.DataFrame) -> memoryview:
    """Return a table as the content of a Parquet file."""
    pa, pq = import_pyarrow()
    sink = pa.BufferOutputStream()
    pq.write_table(pa.Table.from_pandas(table, preserve_index=False), sink)
    return memoryview(sink.getvalue())


def import_pyarrow() -> tuple[Any, Any]:
    """Return PyArrow and its part for Parquet; InputError if it is not installed."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise InputError(
            "a store, and Parquet, need PyArrow: pip install 'robsim[store]'"
        ) from None
    return pyarrow, pyarrow.parquet
