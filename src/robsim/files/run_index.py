"""The index of a run file: names, types, shapes, offsets and attributes of its variables."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import partial
from itertools import groupby
from typing import Any, BinaryIO, ClassVar, Self, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from robsim.base.errors import format_value
from robsim.container import NUMBERS, ArrayBlock, check_blocks_fit, is_json_count

T = TypeVar("T")
TEXTS = "text"
LONGEST_NAME = 250
SPREAD = 64  # largest memory of texts, in file sizes: each is stored as wide as the longest


@dataclass(frozen=True)
class IndexEntry(ArrayBlock):
    """A variable in a file: a block of numbers, or texts with their repetitions."""

    kinds: ClassVar[set[str]] = {*NUMBERS, TEXTS}

    name: str
    dims: list[str]
    texts: list[tuple[str, int]]
    attributes: dict[str, Any]

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in (self.name, *_check_json_list(self.dims), *_check_json_dict(self.attributes)):
            _check_variable_name(name)
        if len(self.shape) != len(self.dims):
            raise ValueError(f"{self.name}: invalid shape: {format_value(self.shape)}")
        if not all(
            len(p) == 2 and isinstance(p[0], str) and is_json_count(p[1]) for p in self.texts
        ):
            raise ValueError(f"{self.name}: invalid texts")
        if sum(count for _, count in self.texts) != (self.size if self.dtype == TEXTS else 0):
            raise ValueError(f"{self.name}: the number of texts does not match its shape")

    @classmethod
    def of(cls, name: Any, variable: xr.Variable) -> Self:
        """Return the entry of a variable; ValueError or TypeError if a file cannot hold it."""
        values = variable.values
        is_text = is_text_array(values)
        return cls(
            TEXTS if is_text else values.dtype.newbyteorder("<").str,
            list(values.shape),
            0,
            name,
            list(map(_check_json_text, variable.dims)),
            _count_repeats(values) if is_text else [],
            {key: _encode_attribute(value) for key, value in variable.attrs.items()},
        )

    @property
    def bytes(self) -> int:
        """The size of the numbers in the file, in bytes."""
        return 0 if self.dtype == TEXTS else super().bytes

    @property
    def width(self) -> int:
        """The memory of the texts in bytes; in an array each is as wide as the longest."""
        return 4 * self.size * max((len(text) or 1 for text, _ in self.texts), default=0)

    def read(self, file: BinaryIO) -> NDArray[Any]:
        """Return the numbers, or the texts."""
        if self.dtype != TEXTS:
            return super().read(file)
        words = np.array([text for text, _ in self.texts], dtype=str)
        counts = np.array([count for _, count in self.texts], dtype=int)
        return np.repeat(words, counts).reshape(self.shape)

    def variable(self, file: BinaryIO) -> xr.Variable:
        """Return the variable from an open file."""
        attributes = {key: _decode_attribute(value) for key, value in self.attributes.items()}
        return xr.Variable(self.dims, self.read(file), attributes)


def _count_repeats(texts: NDArray[Any]) -> list[tuple[str, int]]:
    """Return each text with the number of its repetitions."""
    return [(text, len(list(same))) for text, same in groupby(texts.ravel().tolist())]


def is_text_array(values: NDArray[Any]) -> bool:
    """Return whether an array holds texts; TypeError if it holds neither texts nor numbers."""
    if values.dtype.kind == "U":
        return True
    if values.dtype.kind in "OT" and all(isinstance(each, str) for each in values.ravel()):
        return True
    if values.dtype.newbyteorder("<").str not in NUMBERS:
        raise TypeError(f"a run file has numbers and texts, not values of type {values.dtype}")
    return False


def write_index(entries: list[IndexEntry], run: xr.Dataset) -> dict[str, Any]:
    """Return the index of a Dataset."""
    return {
        "variables": [vars(entry) for entry in entries],
        "coordinates": list(map(_check_json_text, run.coords)),
        "attributes": {
            _check_json_text(key): _encode_attribute(value) for key, value in run.attrs.items()
        },
    }


def read_index(index: Any, size: int) -> tuple[list[IndexEntry], list[str], dict[str, Any]]:
    """Return the variables, the names of the coordinates and the attributes of an index.

    Raise ValueError, TypeError or OverflowError if it does not describe a content of `size` bytes.
    """
    table = _check_json_dict(index)
    entries = [_parse_entry(each) for each in _check_json_list(table["variables"])]
    coordinates = list(map(_check_json_text, _check_json_list(table["coordinates"])))
    check_entry_sizes(entries, size)
    if not {entry.name for entry in entries} >= set(coordinates):
        raise ValueError("a coordinate is not a variable")
    for name in _check_json_dict(table["attributes"]):
        _check_variable_name(name)
    return (
        entries,
        coordinates,
        {key: _decode_attribute(v) for key, v in table["attributes"].items()},
    )


def _parse_entry(table: Any) -> IndexEntry:
    if _check_json_dict(table).keys() != {field.name for field in fields(IndexEntry)}:
        raise ValueError("a variable is not described")
    return IndexEntry(**table)


def check_entry_sizes(entries: list[IndexEntry], size: int) -> None:
    """Raise ValueError unless all variables fit into a content of `size` bytes."""
    if len({entry.name for entry in entries}) < len(entries):
        raise ValueError("a variable occurs twice")
    check_blocks_fit(entries, size)
    if sum(entry.width for entry in entries) > SPREAD * size:
        raise ValueError("texts are too long for one array")
    if any(each > size for entry in entries for each in entry.shape):
        raise ValueError("a dimension is longer than the file")


def _encode_attribute(value: Any) -> Any:
    """Return an attribute for JSON; TypeError if it is not a number, a text or a list of them."""
    if isinstance(value, np.generic | np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, str | int | float) and not isinstance(value, bool):
        return value
    values = np.asarray(value)
    if values.ndim == 1 and is_text_array(values):
        return values.tolist()
    if values.ndim != 1 or values.dtype.kind not in "iuf":
        raise TypeError(f"expected a number, a text or a list of them, got {format_value(value)}")
    return {"dtype": values.dtype.newbyteorder("<").str, "values": values.tolist()}


def _decode_attribute(value: Any) -> Any:
    """Return the attribute from JSON; ValueError, TypeError or OverflowError if it is invalid."""
    if isinstance(value, list):
        return list(map(_check_json_text, value))
    if isinstance(value, dict):
        kind = _check_json_text(value["dtype"])
        if kind not in NUMBERS - {"|b1"} or not all(
            map(_is_index_number, _check_json_list(value["values"]))
        ):
            raise ValueError("an attribute is not an array of numbers")
        return np.array(value["values"], dtype=kind)
    return value if _is_index_number(value) else _check_json_text(value)


def _check_variable_name(name: Any) -> None:
    """Raise ValueError unless a name can be printed and is not a path."""
    short = 0 < len(_check_json_text(name)) <= LONGEST_NAME
    if not (short and name.isprintable() and "/" not in name):
        raise ValueError(
            f"invalid name of a variable, dimension or attribute: {format_value(name)}"
        )


def _is_index_number(value: Any) -> bool:
    return type(value) in (int, float)


def _check_json_type(value: Any, kind: type[T], words: str) -> T:
    if not isinstance(value, kind):
        raise TypeError(f"expected {words}, got {format_value(value)}")
    return value


_check_json_text = partial(_check_json_type, kind=str, words="a text")
_check_json_list = partial(_check_json_type, kind=list, words="a list")
_check_json_dict = partial(_check_json_type, kind=dict, words="names and values")
