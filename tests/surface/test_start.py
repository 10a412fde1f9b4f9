"""A quick start: the modules that `import robsim` loads, and the imports of the kernels."""

import ast
import json
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import robsim

LATE = (
    *("matplotlib", "viser", "xarray", "pandas", "pydantic", "scipy", "click", "h5netcdf", "h5py"),
    "websockets",
)
ROOT = Path(robsim.__file__).parent
KERNELS = sorted((ROOT / "kernels").rglob("*.py"))
COMPILER = {"llvmlite", "numba", "numpy"}  # of the files that depend on how Numba compiles


@cache
def loaded_by(*steps):
    """The top-level modules that a fresh Python has loaded after each of some steps of code."""
    text = "\nprint(json.dumps(sorted({m.split('.')[0] for m in sys.modules})))\n"
    code = "import json, sys\n" + "".join(step + text for step in steps)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True)
    assert done.stderr == ""
    return [set(json.loads(line)) for line in done.stdout.splitlines()]


STEPS = {  # in the order of their dependence, so that none hides behind another
    "import robsim as rs; dir(rs); rs.IBVS(); rs.Pose.at(0, 0, 1); rs.robots.names()": (),
    "import robsim.testing, robsim.files.examples": (),
    "rs.kinematics.clearance": (),
    "import robsim.classic": (),
    "rs.load_scenario": (),
    "import robsim.cli": ("click",),
    "rs.open_run": ("xarray", "pandas"),
    "rs.advise; rs.compare; rs.explain; rs.diagnose": (),
}


def test_heavy_modules_are_loaded_only_on_demand():
    (before,) = loaded_by("import numba")  # which looks for SciPy
    for (step, allowed), loaded in zip(STEPS.items(), loaded_by(*STEPS), strict=True):
        assert "robsim" in loaded
        assert set(LATE) & loaded - before <= set(allowed), step
        before |= loaded


@pytest.mark.parametrize(
    "code", ["import robsim; dir(robsim)", "import robsim.cli", "import robsim.cli.schema_command"]
)
def test_help_and_completion_load_no_numbers(code):
    (loaded,) = loaded_by(code)
    assert not {"numpy", "numba", "llvmlite"} & loaded


def test_public_names_are_imported_in_any_order_and_once():
    code = "import robsim; names = dir(robsim)\n"
    code += "found = {name: getattr(robsim, name) for name in reversed(names)}\n"
    code += "assert all(vars(robsim)[name] is found[name] for name in names)\n"
    code += "from robsim.servo.tasks.schemes import IBVS; assert robsim.IBVS is IBVS"
    loaded_by(code)


def test_a_users_kind_meets_the_shipped_ones_whatever_was_imported():
    code = "from robsim.declare import register\n"
    code += "class Mine: name = 'camera'\n"
    code += "try: register('law')(Mine)\n"
    code += "except ValueError as error: assert 'CameraLaw' in str(error)\n"
    code += "else: raise AssertionError\n"
    code += "Mine.name = 'mine'; register('law')(Mine)\n"
    code += "import robsim; assert 'mine' in robsim.declare.families()['law'].kinds\n"
    code += "assert robsim.declare.families()['task'].kinds['mission'] is robsim.Mission"
    loaded_by(code)


def imports(path):
    """The modules that a file imports, wherever the statement stands."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}: a relative import"
            yield node.module


@pytest.mark.parametrize("path", KERNELS, ids=lambda path: path.stem)
def test_kernels_import_math_numpy_numba_and_kernels_only(path):
    machine = "machine" in path.parts
    allowed = (
        COMPILER | sys.stdlib_module_names if machine else {"math", "numpy", "numba", "typing"}
    )
    names = {name for name in imports(path) if not f"{name}.".startswith("robsim.kernels.")}
    others = {name for name in names if name.split(".")[0] not in allowed}
    assert others <= ({"robsim.container"} if machine else set())


def test_kernels_work_without_the_rest_of_us():
    """Only the package itself, which is imported first, loads modules outside the kernels."""
    code = "import sys, types; from pathlib import Path; import importlib.util as u\n"
    code += f"root = types.ModuleType('robsim'); root.__path__ = [{str(ROOT)!r}]\n"
    code += "sys.modules['robsim'] = root\n"
    names = (".".join(path.relative_to(ROOT).with_suffix("").parts) for path in KERNELS)
    code += "".join(f"import robsim.{name}\n" for name in names if not name.endswith("__init__"))
    code += "ours = {m for m in sys.modules if m.startswith('robsim.')} - {'robsim.container'}\n"
    code += "assert all(m.startswith('robsim.kernels') for m in ours), ours"
    (loaded,), (numba,) = loaded_by(code), loaded_by("import numba")
    assert not set(LATE) & loaded - numba
