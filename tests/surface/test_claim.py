"""Of several processes that need a kernel at once one compiles it, and the others wait for it."""

import os
import subprocess
import sys

import pytest

from robsim.kernels.machine.compiler.compile_lock import CompileLock

COUNTED = """
from robsim.kernels.machine import cache_files
from robsim.kernels.formulas import se3
import numpy as np
se3.exp_se3(np.zeros((6, 1)), np.empty((3, 4, 1)))
print(len(cache_files.SAVED))
"""


@pytest.mark.full
def test_one_process_compiles_and_the_others_load(tmp_path):
    environment = {**os.environ, "ROBSIM_CACHE_DIR": str(tmp_path), "ROBSIM_QUIET": "1"}
    environment["ROBSIM_USE_NUMBA"] = "1"  # also where the package has machine code
    call = [sys.executable, "-c", COUNTED]
    each = [
        subprocess.Popen(call, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(3)
    ]
    saved = [int(process.communicate(timeout=120)[0]) for process in each]
    kept = list((tmp_path / "kernels").iterdir())
    assert sum(saved) == len(kept) > 0, (saved, kept)
    assert all(path.suffix == ".nbc" for path in kept)


def test_a_claim_ends_with_its_object(tmp_path):
    first = CompileLock(tmp_path / "kernel.nbc")
    assert not first.waited and [path.name for path in tmp_path.iterdir()] == ["kernel.lock"]
    del first
    assert not list(tmp_path.iterdir())
    assert not CompileLock(tmp_path / "kernel.nbc").waited


def test_a_process_that_exits_with_a_claim_deletes_it_silently(tmp_path):
    code = f"""
import sys
from pathlib import Path
from robsim.kernels.machine.compiler.compile_lock import CompileLock
sys.claim = CompileLock(Path({str(tmp_path)!r}, "kernel.nbc"))  # sys ends after all modules
"""
    call = [sys.executable, "-c", code]
    ended = subprocess.run(call, capture_output=True, text=True, check=True)
    assert ended.stderr == ""
    assert not list(tmp_path.iterdir())


def test_where_nothing_can_be_written_nobody_waits(tmp_path):
    (tmp_path / "file").write_text("")
    assert not CompileLock(tmp_path / "file" / "kernel.nbc").waited
