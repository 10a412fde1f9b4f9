"""Checkpoints: files that let a stopped run continue with unchanged bits.

A checkpoint holds data only: a header and arrays of numbers, with a checksum. It contains no code,
and a checkpoint that does not fit its experiment is rejected.
"""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, NamedTuple

import numpy as np

from robsim import __version__
from robsim.base.arrays import as_bool, as_integer
from robsim.base.atomic_files import convert_os_errors, write_whole
from robsim.base.errors import FileError, FileWarning, InputError, format_value
from robsim.base.file_content import open_regular_file
from robsim.container import ArrayBlock, ContainerError, pack_container, unpack_container
from robsim.engine.chunk import Chunk, ChunkProgress
from robsim.kernels.machine.cache_files import KERNEL_HASH, VERSIONS
from robsim.kernels.machine.processor_levels import find_processor_name
from robsim.kernels.machine.program import Program

if TYPE_CHECKING:
    from robsim.engine.loop import Loop

FORMAT = "RobSim checkpoint 2"
MACHINE = "the processor"
INTERVAL = 10.0  # seconds between checkpoints
SHARE = 0.01  # largest share of the run time for writing checkpoints


class _StartedLoop(NamedTuple):
    """A loop that has begun, and its chunks in their present state."""

    loop: Loop
    chunks: list[ChunkProgress]


class CheckpointFile:
    """Writer and reader of the checkpoint file of a run.

    A mission has a loop for each phase; the loops begin one after the other. `identity` is a hash
    of all data that determine the bits of the runs.
    """

    def __init__(self, path: str | os.PathLike[str], identity: str, resume: bool):
        self.path, self.identity = Path(path), identity
        self._started: list[_StartedLoop] = []
        self._next_time = time.monotonic() + INTERVAL
        self._is_writable = True
        self._stored = self._read() if resume else []

    def begin(self, loop: Loop, chunks: list[ChunkProgress]) -> list[ChunkProgress]:
        """Return the chunks of the next loop, restored from the checkpoint if it holds them."""
        if self._stored:
            with _convert_misfit_errors(self.path):
                chunks = _restore_chunks(loop, *self._stored.pop(0))
        self._started.append(_StartedLoop(loop, chunks))
        return chunks

    @property
    def is_due(self) -> bool:
        """Whether it is time for a checkpoint."""
        return self._is_writable and time.monotonic() > self._next_time

    def save(self) -> None:
        """Write a checkpoint of all loops so far, while their chunks are paused.

        If it cannot be written, a FileWarning is issued once.
        """
        began = time.monotonic()
        try:
            loops, arrays = zip(*(_describe_loop(*each) for each in self._started), strict=True)
            own = {"format": FORMAT, "experiment": self.identity, "loops": loops}
            flat = [array for each in arrays for array in each]
            with pack_container({**own, **_get_software_versions()}, flat).getbuffer() as content:
                write_whole(self.path, content)
        except InputError as error:
            if self._is_writable:
                warnings.warn(f"no checkpoint: {error}", FileWarning, stacklevel=2)
            self._is_writable = False
        now = time.monotonic()
        self._next_time = now + max(INTERVAL, (now - began) / SHARE)

    def _read(self) -> list[tuple[Any, list[Any]]]:
        """Return the description and the arrays of each loop; FileError for an unusable file."""
        with convert_os_errors(self.path, "read"):
            if not self.path.exists():
                raise FileError(f"no checkpoint {self.path}: run without resume")
            with open_regular_file(self.path, "a checkpoint") as file:
                header, arrays = _unpack_checkpoint(file, self.path)
        for name, here in _get_software_versions().items():
            if (was := header.get(name)) == here:
                continue
            differs = f"{name} was {was!s:.300}, and here is {here}"
            if name != MACHINE:
                raise FileError(f"{self.path} cannot be resumed: {differs}")
            warning = f"{self.path}: {differs}: the last bits may differ from those of one machine"
            warnings.warn(warning, FileWarning, stacklevel=2)
        if header.get("experiment") != self.identity:
            raise FileError(f"{self.path} is of another experiment, or of other settings")
        rest = iter(arrays)
        with _convert_misfit_errors(self.path):
            return [(each, [next(rest) for _ in range(each["arrays"])]) for each in header["loops"]]


def _unpack_checkpoint(file: BinaryIO, path: Path) -> tuple[dict[str, Any], list[Any]]:
    """Return the header and the arrays of a checkpoint; FileError for another or a damaged file."""
    try:
        header, arrays = unpack_container(file)
    except ContainerError as error:
        if not error.is_incomplete:
            raise FileError(f"{path} is damaged: it {error}") from None
        header, arrays = None, []
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise FileError(f"{path} is not a checkpoint of this version of RobSim, or is truncated")
    return header, arrays


@contextmanager
def _convert_misfit_errors(path: Path) -> Iterator[None]:
    """Raise FileError if reading fails because a checkpoint does not fit its loops."""
    try:
        yield
    except (ValueError, TypeError, LookupError, OverflowError, StopIteration) as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"{path} does not fit its experiment: {error!s:.200}") from None


def _get_software_versions() -> dict[str, str]:
    return {
        "RobSim": f"{__version__}, kernels {KERNEL_HASH}",
        "software": f"{VERSIONS}, NumPy {np.__version__}",
        MACHINE: find_processor_name(),
    }


def _describe_loop(loop: Loop, chunks: list[ChunkProgress]) -> tuple[dict[str, Any], list[Any]]:
    """Return the description of a loop in a checkpoint, and its arrays."""
    arrays: list[Any] = []
    descriptions = []
    for going in chunks:
        recorder, rows = loop.recorder, slice(going.rows[0], going.rows[-1] + 1)
        last = -(-going.step // recorder.every) if recorder.every else 0
        arrays += [recorder.table[rows, :last], recorder.ends[rows]]
        paths: list[list[str]] = []
        if going.chunk:
            remembered = _flatten_memory(going.chunk.memory)
            paths = [list(path) for path, _ in remembered]
            on = np.isin(going.rows, going.chunk.rows)
            arrays += [on, going.chunk.numbers, *(array for _, array in remembered)]
        own = {"runs": len(going.rows), "on": bool(going.chunk), "memory": paths}
        descriptions.append({"step": going.step, "done": going.done, **own})
    return {"chunks": descriptions, "arrays": len(arrays)}, arrays


def _restore_chunks(loop: Loop, description: Any, arrays: list[Any]) -> list[ChunkProgress]:
    """Return the described chunks, and fill the record of their loop in place.

    Raise ValueError, TypeError or LookupError if they do not fit the loop.
    """
    rest, chunks, first = iter(arrays), [], 0
    for each in description["chunks"]:
        count, table, ends = each["runs"], next(rest), next(rest)
        rows = np.arange(first, first + as_integer(count, "runs", 1, len(loop.q0) - first + 1))
        first += count
        loop.recorder.table[rows, : table.shape[1]] = table
        loop.recorder.ends[rows] = ends
        step = as_integer(each["step"], "step", 0, loop.steps + 2)
        going = ChunkProgress(rows, None, step, as_bool(each["done"], "done"))
        if each["on"]:
            going.chunk = _restore_chunk(loop.sequence.program, rows, each["memory"], rest)
        chunks.append(going)
    if first != len(loop.q0):
        raise ValueError(f"chunks of {first} runs, expected {len(loop.q0)}")
    return chunks


def _restore_chunk(
    program: Program, rows: Any, paths: list[list[str]], rest: Iterator[Any]
) -> Chunk:
    """Return the running runs of a chunk."""
    going, numbers = next(rest), next(rest)
    if going.shape != rows.shape or going.dtype != bool or not going.any():
        raise ValueError("no running runs")
    chunk = Chunk(program, rows[going])
    if numbers.shape != chunk.numbers.shape or numbers.dtype != chunk.numbers.dtype:
        raise ValueError(f"expected numbers of shape {chunk.numbers.shape}, got {numbers.shape}")
    for row in program.wholes:  # addresses, which are valid in this process only
        numbers[:, row] = chunk.numbers[:, row]
    chunk.numbers[:] = numbers
    for path in paths:
        _set_nested(chunk.memory, path, next(rest))
    return chunk


def _flatten_memory(memory: dict[str, Any]) -> list[tuple[tuple[str, ...], Any]]:
    """Return arrays by their path through nested tables; InputError if some are not numeric."""
    arrays: list[tuple[tuple[str, ...], Any]] = []
    for name, value in memory.items():
        if isinstance(value, dict):
            arrays += [((name, *path), array) for path, array in _flatten_memory(value)]
            continue
        array = np.asarray(value)
        if array.dtype.newbyteorder("<").str not in ArrayBlock.kinds or not isinstance(name, str):
            raise InputError(f"memory {format_value(name)} is not an array of numbers")
        arrays.append(((name,), array))
    return arrays


def _set_nested(memory: dict[str, Any], path: list[str], array: Any) -> None:
    for name in path[:-1]:
        memory = memory.setdefault(name, {})
    memory[path[-1]] = array
