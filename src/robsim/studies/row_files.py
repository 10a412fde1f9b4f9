"""Files of the rows of a study: Parquet files, each named by its runs and a digest.

The digest covers the identity of the study, the range of the runs and the content, so that a
damaged file or a file of another study is rejected before its numbers are read.
"""

from __future__ import annotations

import hashlib
import re
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
import pandas as pd

from robsim.base.atomic_files import write_whole
from robsim.base.errors import FileError, InputError
from robsim.base.file_content import read_bytes
from robsim.engine.outcome import Outcome
from robsim.studies.result_columns import Columns
from robsim.studies.study_plan import Plan

DIGEST_SUFFIX = "_digest"  # of the columns with the digests of stored instants
LARGEST_ROW = 10_000  # bytes; a row has at most some hundred numbers
LARGEST_FOOTER = 10_000_000  # bytes
_NAME = re.compile(r"rows-(\d{13})-(\d{13})-([0-9a-f]{16})\.parquet")


class RowFile(NamedTuple):
    """A file with the rows from `first` to `last` (exclusive), and the digest in its name."""

    first: int
    last: int
    digest: str
    path: Path

    @classmethod
    def of(cls, path: Path) -> Self | None:
        """Return the row file at a path, or None if the path has another name."""
        match = _NAME.fullmatch(path.name)
        return cls(int(match[1]), int(match[2]), match[3], path) if match else None

    def read(self, identity: str) -> pd.DataFrame:
        """Return the rows; raise FileError if the file is damaged or of another study."""
        pa, pq = import_pyarrow()
        content = self._read_checked(identity)
        try:
            table: pd.DataFrame = pq.read_table(BytesIO(content)).to_pandas()
        except pa.ArrowException as error:
            raise FileError(f"{self.path}: not readable: {str(error).splitlines()[0]}") from None
        if not np.array_equal(table.get("run", ()), np.arange(self.first, self.last)):
            raise FileError(f"{self.path}: not in the form that RobSim writes")
        return table

    def _read_checked(self, identity: str) -> bytes:
        """Return the content of the file, after a check of its digest."""
        largest = (self.last - self.first) * LARGEST_ROW + LARGEST_FOOTER
        content = read_bytes(self.path, "rows of a study", largest)
        if _make_digest(identity, self.first, self.last, content) != self.digest:
            raise FileError(
                f"{self.path} is damaged, or of another study; delete it, and resume the study"
            )
        return content

    def check(self, identity: str) -> None:
        """Raise FileError if the file is damaged or of another study."""
        self._read_checked(identity)


def write_row_file(folder: Path, identity: str, first: int, last: int, table: pd.DataFrame) -> None:
    """Write the rows of some runs; raise FileError and leave no file if that fails."""
    content = encode_parquet(table)
    digest = _make_digest(identity, first, last, content)
    write_whole(folder / f"rows-{first:013d}-{last:013d}-{digest}.parquet", content)


def _make_digest(identity: str, first: int, last: int, content: bytes | memoryview) -> str:
    """Return the digest in the name of a row file."""
    digest = hashlib.sha256(f"{identity} {first} {last}\n".encode())
    digest.update(content)
    return digest.hexdigest()[:16]


def select_facts(rows: pd.DataFrame, part: RowFile, plan: Plan) -> Columns:
    """Return the results in the rows of a file; raise FileError if columns are missing."""
    names = {axis.name for axis in plan.axes}
    known = {"run", "draw"} | {name for name in rows if str(name).split("[")[0] in names}
    facts = {
        str(name): rows[name].to_numpy()
        for name in rows
        if name not in known and not str(name).endswith(DIGEST_SUFFIX)
    }
    try:
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
