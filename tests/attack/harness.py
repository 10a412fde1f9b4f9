"""Attacks: seeded cases of one class, each tried in a process that it cannot leave.

A class is a module beside this one with `NAME` and `case(seed)`; `test_attacks` has the number of
its cases. `case` draws one input from the seed, gives it to RobSim, and returns whether it was
taken (`True`) or refused by a `RobSimError` or by the exit status 2 (`False`). Whatever else it
raises is a foreign error; `Lost` and `Wrong` name the lost data, or the wrong result.
"""

from __future__ import annotations

import importlib
import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
import traceback
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

PATIENCE = 20.0  # seconds, after which a case hangs
START = 120.0  # seconds for the first case of a process, which may compile
TESTS = Path(__file__).parents[1]
_OTHERS = ("harness", "__main__", "test_attacks")
CLASSES = sorted(p.stem for p in Path(__file__).parent.glob("*.py") if p.stem not in _OTHERS)


class Lost(Exception):
    """A result that had been computed, or a file that had been written, is gone."""


class Wrong(Exception):
    """The result is not the expected result."""


@dataclass
class Tally:
    """How many cases of a class were tried, taken and refused, and the problems."""

    name: str
    tried: int = 0
    taken: int = 0
    problems: list[tuple[str, int, str]] = field(default_factory=list)  # kind, seed, problem

    def count(self, kind: str) -> int:
        """Return how many problems there are of a kind: crash, hang, foreign, lost or wrong."""
        return sum(each == kind for each, _, _ in self.problems)

    def __str__(self) -> str:
        lines = [f"{self.name}: {len(self.problems)} of {self.tried} failed"]
        return "\n".join(
            [*lines, *(f"{kind}, seed {seed}: {what}" for kind, seed, what in self.problems)]
        )


def attacked(name: str, seeds: Iterable[int], source: str | None = None) -> Tally:
    """Try the cases of a class one after the other; `source` is a folder of another RobSim."""
    module = importlib.import_module(f"attack.{name}")
    tally, child = Tally(module.NAME), None
    patience = getattr(module, "PATIENCE", PATIENCE)
    try:
        for seed in seeds:
            child = child or _Child(name, source)
            kind, what = child.tried(seed, patience)
            tally.tried += 1
            tally.taken += kind == "taken"
            if kind not in ("taken", "refused"):
                tally.problems.append((kind, seed, what))
            if kind in ("crash", "hang"):
                child = child.close()
    finally:
        if child:
            child.close()
    return tally


class _Child:
    """A process that tries cases."""

    def __init__(self, name: str, source: str | None) -> None:
        paths = [*([source] if source else []), str(TESTS), os.environ.get("PYTHONPATH", "")]
        own = {"PYTHONPATH": os.pathsep.join(paths), "MPLBACKEND": "agg", "ROBSIM_QUIET": "1"}
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115  closed by `close`
        self._process = subprocess.Popen(
            [sys.executable, "-c", "import sys; from attack.harness import serve; serve()", name],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            cwd=self._folder.name,
            env={**os.environ, **own},
            start_new_session=True,
        )
        self._answers: queue.Queue[bytes] = queue.Queue()
        self._first = True
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        for line in self._process.stdout:
            self._answers.put(line)
        self._answers.put(b"")

    def tried(self, seed: int, patience: float) -> tuple[str, str]:
        """Try one case; return "taken", "refused" or what went wrong, and its description."""
        try:
            self._process.stdin.write(f"{seed}\n".encode())
            self._process.stdin.flush()
            line = self._answers.get(timeout=START if self._first else patience)
        except queue.Empty:
            return "hang", f"no answer in {patience:.0f} s"
        except BrokenPipeError:
            line = b""
        self._first = False
        if not line:
            return "crash", f"ended with {self._process.wait()}; {self._said()}"
        kind, what = json.loads(line)
        return kind, what

    def _said(self) -> str:
        self._errors.seek(0)
        return self._errors.read().decode(errors="replace")[-400:]

    def close(self) -> None:
        """End the process and remove its folder."""
        self._process.kill()
        self._process.wait()
        self._process.stdin.close()
        self._process.stdout.close()
        self._errors.close()
        self._folder.cleanup()


def serve() -> None:
    """Try the seeds that come on stdin, one a line, and answer on the original stdout."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # whatever RobSim prints goes elsewhere
    case = importlib.import_module(f"attack.{sys.argv[1]}").case
    for line in sys.stdin:
        print(json.dumps(_verdict(case, int(line))), file=answers, flush=True)


def _verdict(case, seed: int) -> tuple[str, str]:
    try:
        return ("taken" if case(seed) else "refused"), ""
    except (Lost, Wrong) as problem:
        return type(problem).__name__.lower(), str(problem)
    except BaseException as error:  # noqa: BLE001  the attacks look for any error
        where = traceback.extract_tb(error.__traceback__)[-1]
        last = f"{Path(where.filename).name}:{where.lineno}"
        return "foreign", f"{type(error).__name__}: {str(error)[:200]} ({last})"
