"""A wheel with machine code: the same bits without Numba, on each processor level.

It takes minutes. ROBSIM_WHEEL names the wheel; otherwise uv builds one, in an environment of its
own with the oldest Numba: pytest -n 0 -m wheel tests/surface/test_wheel.py

Processes that compile share the kernel cache of the tests. The others have a cache of their own.
"""

import json
import os
import re
import subprocess
import sys
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from llvmlite import binding as llvm

from robsim.kernels.machine import cache_files, code_archive, llvm_modules, processor_levels

pytestmark = pytest.mark.wheel
ROOT = Path(__file__).parents[2]
FUSED = re.compile(r"\bv?f(n?m(add|sub)|ml[as])\w*")  # instructions that round once, not twice
MOST_BYTES = 1_600_000  # of machine code in the wheel
RUN = """
import hashlib, json, sys
import robsim as rs
run = rs.load_scenario(rs.examples.path("eye_in_hand")).run()
digest = hashlib.sha256(run.q.values.tobytes()).hexdigest()
print(json.dumps([digest, sys.modules.get("numba") is not None]))
"""
PLAIN_TEXTS = """
import hashlib, sys
sys.path.insert(0, sys.argv[1])
import numba_texts
from plain_modules import PlainModules
found = [each for each in numba_texts.list_c_functions() if each[0].split(".")[-1] in sys.argv[2:]]
numba_texts.list_c_functions = lambda: found
texts = numba_texts.record_numba_texts()
plain = PlainModules(texts)
for symbol in texts.functions:
    lines = plain.make(symbol).split("\\n")
    text = "".join(each for each in lines if "inttoptr (i64" not in each)  # unused: LLVM removes it
    print(symbol, hashlib.sha256(text.encode()).hexdigest())
"""
SHARED_CACHE = {"ROBSIM_CACHE_DIR": str(cache_files.USER_CACHE)}
WITHOUT_NUMBA = "import sys; sys.modules['numba'] = None\n"
OWN_STAGE = """
import numpy as np
import sys
from robsim.kernels.formulas.lane_math import cos_sin
from robsim.kernels.machine.lanes import get, put
from robsim.kernels.machine.program import evaluate_stages
from robsim.kernels.machine.stages import stage


@stage
def turn(w, step, angle="1", out="2"):
    c, s = cos_sin(get(w, angle))
    put(w, out, c)
    put(w, out + 1, s)


def add(program, angle):
    return [program.result(turn, "out", 2, angle=angle)]


(found,) = evaluate_stages(add, [np.array([[0.0, np.pi / 2, np.pi / 6]])])
import robsim as rs
rs.load_scenario(rs.examples.path("eye_in_hand")).run().outcome
print(np.abs(found - [[1, 0, np.sqrt(0.75)], [0, 1, 0.5]]).max() < 1e-15, "numba" in sys.modules)
"""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    if named := os.environ.get("ROBSIM_WHEEL"):
        return Path(named)
    folder = tmp_path_factory.mktemp("dist")
    build = ["uv", "build", "--quiet", "--wheel", "--out-dir", folder, ROOT]
    subprocess.run(build, check=True, env={**os.environ, "ROBSIM_MACHINE_CODE": "1"})
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture
def installed(wheel, tmp_path):
    """The folder of the package, at a path that is unknown at build time."""
    with zipfile.ZipFile(wheel) as file:
        file.extractall(tmp_path / "elsewhere")
    return tmp_path / "elsewhere" / "robsim"


def start(installed, *command, **more):
    """Run Python with the installed package; return its output and its messages."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTEST_CURRENT_TEST"}
    environment["ROBSIM_CACHE_DIR"] = str(installed.parents[1] / "cache")
    environment |= {"PYTHONPATH": str(installed.parent), **more}
    process = subprocess.run(
        [sys.executable, *command], capture_output=True, text=True, env=environment, check=False
    )
    assert process.returncode == 0, process.stderr
    return process.stdout, process.stderr


def run_scenario(installed, first="", **more):
    """Return the digest of a motion, whether Numba was imported, and the messages."""
    out, err = start(installed, "-c", first + RUN, **more)
    return *json.loads(out), err


def archives(installed):
    return installed / "kernels" / code_archive.FOLDER.name


def change_archives(installed, change):
    """Rewrite all archives, changed."""
    for path in archives(installed).iterdir():
        archive = code_archive.unpack_archive(path.read_bytes())
        change(archive)
        path.write_bytes(code_archive.pack_archive(archive))


def test_the_wheel_is_pure_and_small(wheel, installed):
    assert wheel.name.endswith("-py3-none-any.whl")
    files = {path.stem: path.stat().st_size for path in archives(installed).iterdir()}
    assert files.keys() == {code_archive.BITCODE, *processor_levels.LEVELS}
    assert sum(files.values()) < MOST_BYTES


def test_two_builds_write_the_same_code():
    """Numba names the exceptions of a kernel by addresses, which differ in each process."""
    tools, kernels = ROOT / "tools/machine_code", ["find_log_shares", "region_stage"]
    command = [sys.executable, "-c", PLAIN_TEXTS, tools, *kernels]
    environment = {**os.environ, "ROBSIM_USE_NUMBA": "1", "PYTHONHASHSEED": "0"}
    first, second = (
        subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout
        for _ in range(2)
    )
    assert first == second and len(first.split("\n")) == 3


def test_all_scenarios_have_the_same_bits_without_numba(installed):
    script = ROOT / "tests" / "bit_digests.py"
    levels = ["bitcode", *processor_levels.find_levels()]
    with ThreadPoolExecutor(2) as pool:
        compiled = pool.submit(start, installed, script, "numba", **SHARED_CACHE)
        shipped = list(pool.map(lambda level: start(installed, script, level)[0], levels))
    expected = json.loads(compiled.result()[0])
    assert len(expected) > 60
    assert {level: json.loads(each) for level, each in zip(levels, shipped, strict=True)} == (
        dict.fromkeys(levels, expected)
    )


@pytest.mark.parametrize(
    ("triple", "processor", "every"),
    [
        ("aarch64-unknown-linux-gnu", "cortex-a76", 1),
        ("arm64-apple-macosx11.0", "apple-m1", 4),
        ("x86_64-pc-windows-msvc", "x86-64-v3", 4),
    ],
)
def test_code_of_other_systems_is_emitted_without_fused_operations(
    installed, triple, processor, every
):
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    machine = llvm_modules.make_target_machine(processor, "", triple)
    path = archives(installed) / f"{code_archive.BITCODE}.lzma"
    parts = code_archive.unpack_archive(path.read_bytes()).parts
    for symbol, code in list(parts.items())[::every]:
        module = llvm_modules.parse_module(code, machine)
        llvm_modules.optimise(module, machine)
        assembly = machine.emit_assembly(module)
        assert f"{symbol}:" in assembly
        assert not FUSED.search(assembly), symbol


def test_nothing_is_written_where_the_level_is_known(installed):
    assert processor_levels.find_levels()
    _, used_numba, messages = run_scenario(installed, WITHOUT_NUMBA)
    assert (used_numba, messages) == (False, "")
    assert not list((installed.parents[1] / "cache").rglob("*"))


def test_warm_has_nothing_to_do_and_translates_bitcode_once(installed):
    out, _ = start(installed, "-m", "robsim", "warm")
    assert out.startswith("nothing to do: the package has machine code for this processor")
    for level in processor_levels.LEVELS:
        (archives(installed) / f"{level}.lzma").unlink()
    first, _ = start(installed, "-m", "robsim", "warm")
    assert first.startswith("compiled 2")
    size = sum(path.stat().st_size for path in (installed.parents[1] / "cache").rglob("*.nbc"))
    assert size < 1_000_000
    again, _ = start(installed, "-m", "robsim", "warm")
    assert again.startswith("nothing to do")
    assert run_scenario(installed, WITHOUT_NUMBA)[1:] == (False, "")


@pytest.mark.parametrize("fault", ["sources", "damage", "newer bitcode", "unknown symbol", "none"])
def test_code_that_does_not_fit_is_left_to_numba(installed, fault):
    expected, _, _ = run_scenario(installed)
    if fault == "sources":
        edited = installed / "kernels" / "formulas" / "interaction.py"
        edited.write_text(edited.read_text() + "\n")
    elif fault == "damage":
        for path in archives(installed).iterdir():
            path.write_bytes(path.read_bytes()[:-1] + b"?")
    elif fault == "none":
        for path in archives(installed).iterdir():
            path.unlink()
    else:
        for level in processor_levels.LEVELS:  # bitcode alone
            (archives(installed) / f"{level}.lzma").unlink()
        if fault == "newer bitcode":
            change_archives(installed, lambda archive: setattr(archive, "llvm", 999))
        else:
            change_archives(
                installed,
                lambda archive: [n.append("no_such_symbol") for n in archive.needs.values()],
            )
    found, used_numba, messages = run_scenario(installed, **SHARED_CACHE)
    assert (found, used_numba) == (expected, True)
    assert "no_such_symbol" not in messages and "LLVM ERROR" not in messages


def test_a_stage_of_a_user_runs_beside_shipped_ones(installed, tmp_path):
    script = tmp_path / "own_stage.py"
    script.write_text(OWN_STAGE)
    assert start(installed, script, **SHARED_CACHE)[0] == "True True\n"
