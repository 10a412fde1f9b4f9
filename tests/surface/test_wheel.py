"""A wheel with compiled kernels, built in one folder and used in another.

It takes minutes, and needs the tools `build` and `hatchling`:
pytest -n 0 -m wheel tests/surface/test_wheel.py
"""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.wheel
ROOT = Path(__file__).parents[2]
DEMO = """
import hashlib, json, sys
import robsim
from robsim import cli
sys.argv = ["robsim", "demo", "--no-figures", "--force", "-o", "demo"]
cli.main()
from robsim.kernels.machine import prebuilt
from robsim.kernels.machine.compile_notice import NOTICE
q = hashlib.sha256(robsim.open_run("demo/run.nc").q.values.tobytes()).hexdigest()
print(json.dumps([robsim.__file__, prebuilt.LEVEL, NOTICE.compiled, q]))
"""
ONE_KERNEL = """
import numpy as np
from robsim.kernels.formulas import interaction
from robsim.kernels.machine import compile_notice
compile_notice.PATIENCE = 0.0
interaction.points_interaction(np.ones((1, 2, 1)), np.ones((1, 1)), np.empty((2, 6, 1)))
"""
FILE_OF_ONE = "formulas/interaction.py"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dist")
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "-o", folder, ROOT]
    subprocess.run(build, check=True, env={**os.environ, "ROBSIM_PREBUILT": "1"})
    (path,) = folder.iterdir()
    return path


@pytest.fixture
def installed(wheel, tmp_path):
    """The folder of the package, at a path that is unknown at build time."""
    with zipfile.ZipFile(wheel) as file:
        file.extractall(tmp_path / "elsewhere")
    return tmp_path / "elsewhere" / "robsim"


def python(installed, code, **more):
    """Run code with the package that is installed there; return its output and its messages."""
    environment = {k: v for k, v in os.environ.items() if k != "PYTEST_CURRENT_TEST"}
    environment |= {
        "PYTHONPATH": str(installed.parent),
        "ROBSIM_CACHE_DIR": str(installed.parents[1] / "cache"),
        **more,
    }
    done = subprocess.run(
        [sys.executable, "-c", code],
        check=True,
        capture_output=True,
        text=True,
        env=environment,
        cwd=installed.parents[1],
    )
    return done.stdout, done.stderr


def demo(installed, **more):
    """Run the demo: the level that served, the compiled kernels, and a digest of its motion."""
    out, err = python(installed, DEMO, **more)
    file, *rest = json.loads(out.splitlines()[-1])
    assert Path(file).parent == installed and "converged" in out
    return *rest, err


def list_cache_files(installed):
    return list((installed.parents[1] / "cache").rglob("*.nbc"))


def levels(installed):
    return sorted((installed / "kernels/_prebuilt").glob("*/"))


def test_the_wheel_is_for_this_platform_and_holds_levels(wheel, installed):
    version = f"cp{sys.version_info.major}{sys.version_info.minor}"
    assert wheel.name.split("-")[2:4] == [version, version] and not wheel.name.endswith("any.whl")
    assert levels(installed)
    assert all(len(list(level.glob("*.nbc"))) > 100 for level in levels(installed))


def test_the_demo_runs_without_compiling_whatever_the_processor_is_called(installed):
    best, compiled, motion, err = demo(installed)
    assert (compiled, err) == ([], "") and best
    assert demo(installed, NUMBA_CPU_NAME="nehalem")[:3] == (best, [], motion)
    assert not list_cache_files(installed)


def test_warm_has_nothing_to_do(installed):
    code = "import sys; from robsim import cli; sys.argv = ['robsim', 'warm']\n"
    out, _ = python(installed, code + "if __name__ == '__main__': cli.main()")
    assert out.startswith("nothing to do: the kernels of the package serve here")
    assert not list_cache_files(installed)


def test_each_level_and_the_compiler_give_the_same_bits(installed):
    found = []
    for level in [*reversed(levels(installed)), None]:
        used, compiled, motion, _ = demo(installed)
        assert used == (level.name if level else "") and bool(compiled) == (level is None)
        found.append(motion)
        if level:
            level.rename(installed / level.name)
    assert len(found) > 1 and len(set(found)) == 1


def test_truncated_files_are_compiled_anew(installed):
    _, _, motion, _ = demo(installed)
    for path in (installed / "kernels/_prebuilt").rglob("outcome_rules.*.nbc"):
        path.write_bytes(path.read_bytes()[:-100])
    _, compiled, again, _ = demo(installed)
    assert again == motion and compiled
    assert {name.partition(".")[0] for name in compiled} == {"outcome_rules"}


def test_a_wheel_of_other_sources_or_versions_is_reported_in_one_line(installed):
    made_with = installed / "kernels/_prebuilt/versions.txt"
    versions, kernels = made_with.read_text().splitlines()
    edited = installed / "kernels" / FILE_OF_ONE
    edited.write_text(edited.read_text() + "\n")
    for i, (text, reason) in enumerate(
        (
            (f"{versions}\n{kernels}\n", "are of other sources"),
            (f"Numba 0.1, llvmlite 0.2, Python 3.3\n{kernels}\n", "Python 3.3, this is Numba"),
        )
    ):
        made_with.write_text(text)
        out, err = python(installed, ONE_KERNEL, ROBSIM_CACHE_DIR=str(installed / f"cache{i}"))
        assert out == "" and err.count("\n") == 1
        assert err.startswith("robsim: compiling kernels, once") and reason in err
