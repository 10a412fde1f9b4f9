"""The folder of a study: its text, its rows as Parquet files, and its pictures and meshes.

The identity of a study is a digest of its text and of the versions that simulated it. The digest of
each row file includes it.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from robsim.base.atomic_files import convert_os_errors, write_whole
from robsim.base.errors import FileError, InputError
from robsim.files.toml import read_toml_text
from robsim.kernels.machine.cache_files import KERNEL_HASH
from robsim.run.experiment import Experiment
from robsim.run.simulation_dataset import VERSION
from robsim.run.stored_data import write_stored_value
from robsim.studies.result_columns import Columns, empty_columns, make_table
from robsim.studies.row_files import (
    DIGEST_SUFFIX,
    RowFile,
    import_pyarrow,
    select_facts,
    write_row_file,
)
from robsim.studies.row_simulator import ChunkResult
from robsim.studies.study_plan import Codes, Plan
from robsim.studies.study_text import format_plan, read_plan
from robsim.studies.trajectory_store import (
    INSTANT_NAMES,
    TrajectoryStore,
    count_trajectory_bytes,
    digest_instants,
)

FORMAT = 2
VERSIONS = {"robsim": VERSION, "kernels": KERNEL_HASH}  # they determine the bits of a run
TEXT, ABOUT, TRACKS = "study.toml", "study.json", "trajectories.zarr"
COMPARED_VALUES = 50  # values of an axis that are compared with their text
ROW_BYTES = 150  # disk space of a row


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
        about["digest"] = _digest_description(about, text)
        for value in plan.experiment.stored_data.values():  # once for all rows
            write_stored_value(value, self.folder)
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

    @property
    def identity(self) -> str:
        """The digest of the text and of the versions of the study."""
        return str(self.about()["digest"])

    def about(self) -> dict[str, Any]:
        """Return the description of the study.

        Raises FileError if its format is unknown, or if it or the text of the study was changed.
        """
        path = self.folder / ABOUT
        if not self.is_there:
            raise FileError(f"{self.folder}: no study here: {ABOUT} is missing")
        text = read_toml_text(path)
        try:
            about = dict(json.loads(text))
            version = int(about["format"])
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError):
            raise FileError(f"{path}: not in the form that RobSim writes") from None
        if version != FORMAT:
            raise FileError(
                f"{self.folder}: a study of format {version}, of RobSim "
                f"{about.get('robsim', 'of another version')!s:.40}; this is {VERSION}, which "
                f"reads format {FORMAT}: install the other version, or run its {TEXT} again"
            )
        stated = about.pop("digest", None)
        if stated != _digest_description(about, read_toml_text(self.folder / TEXT)):
            raise FileError(
                f"{self.folder}: {TEXT} or {ABOUT} was changed after the study began; restore it, "
                "or begin a new study of the changed text in another folder"
            )
        return {**about, "digest": stated}

    def parts(self) -> list[RowFile]:
        """Return the files of rows in order; raise FileError if two of them overlap."""
        with convert_os_errors(self.folder, "read"):
            paths = sorted(self.folder.iterdir())
        parts = [part for path in paths if (part := RowFile.of(path))]
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
        table = make_table(plan, np.arange(first, last), result.facts)
        if plan.trajectories:
            TrajectoryStore(self.folder / TRACKS).put(plan, first, result.tracks)
            for name, values in result.tracks.items():
                table[f"{name}{DIGEST_SUFFIX}"] = digest_instants(values)
        write_row_file(self.folder, self.identity, first, last, table)

    def facts(self, plan: Plan) -> tuple[Codes, Columns]:
        """Return the numbers of the finished runs, and their columns."""
        identity, parts = self.identity, self.parts()
        if not parts:
            return np.arange(0), empty_columns(plan)
        columns = [select_facts(part.read(identity), part, plan) for part in parts]
        return np.concatenate([np.arange(part.first, part.last) for part in parts]), {
            name: np.concatenate([each[name] for each in columns]) for name in columns[0]
        }

    def trajectories(self, plan: Plan) -> xr.Dataset:
        """Return the instants of the finished runs, which are read and checked on demand."""
        identity, parts = self.identity, self.parts()
        if not parts:
            raise InputError("the study has no runs yet, so it has no trajectories")
        rows = [part.read(identity) for part in parts]
        runs = np.concatenate([each["run"] for each in rows])
        digests = {
            name: np.concatenate([each[f"{name}{DIGEST_SUFFIX}"] for each in rows])
            for name in INSTANT_NAMES
        }
        return TrajectoryStore(self.folder / TRACKS).open(plan, runs, digests)

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
        for part in self.parts():
            part.check(about["digest"])

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
    again = read_plan(Experiment.from_text(text, stored_data=plan.experiment.stored_data.values()))
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


def _digest_description(about: dict[str, Any], text: str) -> str:
    """Return the digest of a description without its own digest, and of the text of a study."""
    description = json.dumps(about, sort_keys=True)
    return hashlib.sha256(f"{description}\n{text}".encode()).hexdigest()
