"""Checkpoints: from what a run that was stopped goes on, with the same bits as one that was not."""

from __future__ import annotations

import hashlib
import os
import platform
import time
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from llvmlite import binding as llvm

from robsim import __version__
from robsim.base.errors import FileError, FileWarning, InputError, said
from robsim.base.output import refused, write_whole
from robsim.engine.chunk import Chunk, Going
from robsim.kernels.machine.store import KERNEL_HASH, VERSIONS
from robsim.run.sealed import sealed, unsealed
from robsim.run.secret import secret

if TYPE_CHECKING:
    from robsim.engine.loop import Loop
    from robsim.run.experiment import Experiment

INTERVAL = 10.0  # seconds between checkpoints
SHARE = 0.01  # of the time, which writing them takes at most


class _Begun(NamedTuple):
    """A loop, and its chunks as they are."""

    loop: Loop
    chunks: list[Going]


class Keeper:
    """Writes checkpoints of a run to a file, and takes up the one that is there.

    A mission has a loop for each phase, which begin one after the other.
    """

    def __init__(self, path: str | os.PathLike[str], experiment: Experiment, resume: bool):
        self.path, self.experiment = Path(path), experiment
        self._begun: list[_Begun] = []
        self._next = time.monotonic() + INTERVAL
        self._works = True
        self._left = self._read() if resume else []

    def begin(self, loop: Loop, chunks: list[Going]) -> list[Going]:
        """Return the chunks of the next loop as they were left, or as given at their start."""
        if self._left:
            chunks = _restored(loop, *self._left.pop(0))
        self._begun.append(_Begun(loop, chunks))
        return chunks

    @property
    def is_due(self) -> bool:
        """Whether it is time for a checkpoint."""
        return self._works and time.monotonic() > self._next

    def save(self) -> None:
        """Write a checkpoint of all loops so far, all of whose chunks wait.

        FileWarning, once: that cannot be done.
        """
        began = time.monotonic()
        try:
            said, arrays = zip(*(_described(*each) for each in self._begun), strict=True)
            about = {**_made_with(), "experiment": identity(self.experiment), "loops": said}
            flat = [array for each in arrays for array in each]
            write_whole(self.path, sealed(about, flat, secret()))
        except InputError as error:
            if self._works:
                warnings.warn(f"no checkpoint: {error}", FileWarning, stacklevel=2)
            self._works = False
        now = time.monotonic()
        self._next = now + max(INTERVAL, (now - began) / SHARE)

    def _read(self) -> list[tuple[Any, list[Any]]]:
        """Return what is said of each loop, with its arrays; FileError if it does not serve."""
        with refused(self.path, "read"):
            content = self.path.read_bytes() if self.path.exists() else None
        if content is None:
            raise FileError(f"no checkpoint {self.path}: run without resume")
        about, arrays = unsealed(content, secret(), str(self.path))
        for name, here in _made_with().items():
            if about[name] != here:
                raise FileError(
                    f"{self.path} cannot be taken up: {name} was {about[name]}, and here is {here}"
                )
        if about["experiment"] != identity(self.experiment):
            raise FileError(f"{self.path} is of another experiment, or of other settings")
        rest = iter(arrays)
        return [(said, [next(rest) for _ in range(said["arrays"])]) for said in about["loops"]]


def identity(experiment: Experiment) -> str:
    """Return a hash of all that the bits of an experiment's runs depend on.

    InputError: its text cannot say it.
    """
    from robsim.run.origin import one_run

    digest = hashlib.sha256(one_run(experiment).to_toml(complete=True).encode())
    for name, values in {"start": experiment.start, **experiment.varied}.items():
        array = np.ascontiguousarray(np.nan if values is None else values)
        digest.update(f"{name} {array.dtype} {array.shape}".encode() + array.tobytes())
    return digest.hexdigest()


def _made_with() -> dict[str, str]:
    return {
        "RobSim": f"{__version__}, kernels {KERNEL_HASH}",
        "software": f"{VERSIONS}, NumPy {np.__version__}",
        "the machine": f"{platform.machine()} {llvm.get_host_cpu_name()}",
    }


def _described(loop: Loop, chunks: list[Going]) -> tuple[dict[str, Any], list[Any]]:
    """Return what a checkpoint says of a loop, and its arrays."""
    arrays: list[Any] = []
    said = []
    for going in chunks:
        recorder, own = loop.recorder, slice(going.rows[0], going.rows[-1] + 1)
        last = -(-going.step // recorder.every) if recorder.every else 0
        arrays += [going.rows, recorder.table[own, :last], recorder.ends[own]]
        paths: list[list[str]] = []
        if going.chunk:
            remembered = _flat(going.chunk.memory)
            paths = [list(path) for path, _ in remembered]
            arrays += [going.chunk.rows, going.chunk.numbers, *(array for _, array in remembered)]
        said.append(
            {"step": going.step, "done": going.done, "on": bool(going.chunk), "memory": paths}
        )
    return {"chunks": said, "arrays": len(arrays)}, arrays


def _restored(loop: Loop, said: Any, arrays: list[Any]) -> list[Going]:
    """Return chunks as they were described, and fill the record of their loop in place."""
    rest = iter(arrays)
    chunks = []
    for each in said["chunks"]:
        rows, table, ends = next(rest), next(rest), next(rest)
        loop.recorder.table[rows, : table.shape[1]] = table
        loop.recorder.ends[rows] = ends
        going = Going(rows, None, each["step"], each["done"])
        if each["on"]:
            going.chunk = Chunk(loop.sequence.program, next(rest))
            going.chunk.numbers[:] = next(rest)
            for path in each["memory"]:
                _put(going.chunk.memory, path, next(rest))
        chunks.append(going)
    return chunks


def _flat(memory: dict[str, Any]) -> list[tuple[tuple[str, ...], Any]]:
    """Return arrays by their way through nested tables; InputError: some are not numbers."""
    found: list[tuple[tuple[str, ...], Any]] = []
    for name, value in memory.items():
        if isinstance(value, dict):
            found += [((name, *path), array) for path, array in _flat(value)]
            continue
        array = np.asarray(value)
        if array.dtype.hasobject or not isinstance(name, str):
            raise InputError(f"what is remembered as {said(name)} is no array of numbers")
        found.append(((name,), array))
    return found


def _put(memory: dict[str, Any], path: list[str], array: Any) -> None:
    for name in path[:-1]:
        memory = memory.setdefault(name, {})
    memory[path[-1]] = array
