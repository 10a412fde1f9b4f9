"""Tables in CSV and Parquet files, data frames and rows, with limits of their size."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from robsim.base.atomic_files import convert_os_errors
from robsim.base.errors import FileError, InputError, format_value
from robsim.base.file_content import open_regular_file

if TYPE_CHECKING:
    import pandas as pd

LARGEST = 2_000_000_000  # bytes of a file
WIDEST = 10_000  # columns; pandas needs minutes for many more
LONGEST_HEADER = 1 << 22  # bytes of the first line
MOST = 200_000_000  # numbers of a Parquet file, which can be compressed to nothing


def read_table(path: Any, needed: Iterable[str]) -> tuple[str, pd.DataFrame]:
    """Return the name of a table for error messages, and the table with at least some columns.

    `path` is a CSV or Parquet file, a data frame or a list of rows. Columns of CSV files are text.
    Raise FileError if the table cannot be read or is too large, or if a needed column occurs twice.
    """
    name, frame = _open_table(path, set(needed))
    _check_repeated(name, list(frame.columns), needed)
    return name, frame


def _open_table(path: Any, needed: set[str]) -> tuple[str, pd.DataFrame]:
    """Return the name of a table and the table; see `read_table`."""
    import pandas as pd

    if isinstance(path, pd.DataFrame):
        return "table", path
    if isinstance(path, list | tuple):
        return "rows", pd.DataFrame(_check_rows(path))
    with convert_os_errors(path, "read"):
        reader = READERS.get(Path(path).suffix.lower())
    if reader is None:
        raise FileError(f"{path}: expected a .csv or .parquet file")
    with open_regular_file(path, "a CSV or Parquet file") as file:
        if os.fstat(file.fileno()).st_size > LARGEST:
            raise FileError(f"{path}: larger than {LARGEST // 1_000_000} MB")
        try:
            return str(path), reader(str(path), file, needed)
        except ImportError:
            raise InputError("Parquet needs PyArrow: pip install 'robsim[store]'") from None
        except FileError:
            raise
        except Exception as error:  # noqa: BLE001  readers raise many kinds of errors
            raise FileError(f"{path} cannot be read as a table: {error!s:.200}") from None


def _read_csv(name: str, file: BinaryIO, needed: set[str]) -> pd.DataFrame:
    """Return the columns of a CSV file as text, for exact rounding when they are parsed."""
    import pandas as pd

    header = file.readline(LONGEST_HEADER)
    if len(header) == LONGEST_HEADER:
        raise FileError(f"{name}: the first line has more than {LONGEST_HEADER} bytes")
    columns = next(csv.reader([header.decode("utf-8-sig")]), [])
    _check_width(name, len(columns))
    _check_repeated(name, columns, needed)  # pandas would rename the second column
    file.seek(0)
    frame: pd.DataFrame = pd.read_csv(file, dtype=str)
    return frame


def _read_parquet(name: str, file: BinaryIO, needed: set[str]) -> pd.DataFrame:
    """Return the needed columns of a Parquet file."""
    import pandas as pd
    from pyarrow import parquet, types

    schema, rows = parquet.read_schema(file), parquet.read_metadata(file).num_rows
    _check_width(name, len(schema))
    _check_repeated(name, schema.names, needed)
    columns = [each for each in schema if each.name in needed]
    if rows * len(columns) > MOST:
        raise FileError(f"{name}: {rows} rows of {len(columns)} columns; at most {MOST} numbers")
    for each in columns:
        if not any(
            is_kind(each.type) for is_kind in (types.is_floating, types.is_integer, types.is_null)
        ):
            raise FileError(f"{name}: column {each.name}: expected numbers, got {each.type}")
    frame: pd.DataFrame = pd.read_parquet(file, columns=[each.name for each in columns])
    return frame


READERS: dict[str, Callable[[str, BinaryIO, set[str]], pd.DataFrame]] = {
    ".csv": _read_csv,
    ".parquet": _read_parquet,
}


def _check_rows(rows: Sequence[Mapping[str, float]]) -> list[Mapping[str, float]]:
    """Return checked rows; raise FileError without rows, or for a row that is not a mapping."""
    if not rows:
        raise FileError("rows: nothing was recorded")
    for i, row in enumerate(rows):
        if not isinstance(row, Mapping):
            raise FileError(
                f"rows: expected {{column: number}}, got {format_value(row)} in row {i}"
            )
    return list(rows)


def _check_width(name: str, columns: int) -> None:
    """Raise FileError for a table of too many columns."""
    if columns > WIDEST:
        raise FileError(f"{name}: {columns} columns; at most {WIDEST} are read")


def _check_repeated(name: str, columns: Sequence[str], needed: Iterable[str]) -> None:
    """Raise FileError if a needed column occurs twice."""
    for column in needed:
        if columns.count(column) > 1:
            raise FileError(f"{name}: column {column} occurs {columns.count(column)} times")
