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
MACHINE = ROOT / "kernels" / "machine"
COMPILERS = {"llvmlite", "numba"}
COMPILING = [  # the files that generate or load machine code
    *(MACHINE / "compiler").glob("*.py"),
    *(MACHINE / f"{name}.py" for name in ("code_engine", "llvm_modules")),
]


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


@pytest.mark.full
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


def module_name(path):
    return ".".join(path.relative_to(ROOT.parent).with_suffix("").parts).removesuffix(".__init__")


def read_imports(path, *, late=True):
    """The modules that a file imports, wherever the statement stands, or as it is imported."""
    waiting = [ast.parse(path.read_text(encoding="utf-8"))]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.Import):
            yield from (name.name for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}: a relative import"
            yield from (node.module, *(f"{node.module}.{name.name}" for name in node.names))
        elif late or not is_late(node):
            waiting += ast.iter_child_nodes(node)


def is_late(node):
    """Whether a statement does not run when its module is imported."""
    is_function = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    return is_function or (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING")


def foreign_packages(names):
    """The packages of modules, without ours of kernels."""
    return {n.split(".")[0] for n in names if not f"{n}.".startswith("robsim.kernels.")}


@pytest.mark.parametrize(
    "path", [path for path in KERNELS if MACHINE not in path.parents], ids=module_name
)
def test_kernels_import_math_numpy_typing_and_kernels_only(path):
    assert foreign_packages(read_imports(path)) <= {"math", "numpy", "typing"}


@pytest.mark.parametrize("path", list(MACHINE.rglob("*.py")), ids=lambda path: path.stem)
def test_the_machine_imports_a_compiler_where_code_is_generated_or_late(path):
    names = set(read_imports(path))
    ours = {n for n in names if n.startswith("robsim.") and not n.startswith("robsim.kernels")}
    assert all(name.startswith("robsim.container") for name in ours)
    others = foreign_packages(names) - sys.stdlib_module_names
    assert others <= {"numpy", "robsim"} | COMPILERS
    if path not in COMPILING:
        early = set(read_imports(path, late=False))
        assert not COMPILERS & foreign_packages(early)
        assert not early & {module_name(each) for each in COMPILING if each.stem != "__init__"}


ALL = """
import importlib, pkgutil, robsim
for each in pkgutil.walk_packages(robsim.__path__, "robsim."):
    if each.name not in {compiling} and not each.name.endswith("__main__"):
        importlib.import_module(each.name)
"""
SCENARIO = """
import robsim as rs
class Finder:
    def find_spec(self, name, path=None, target=None):
        if name in ("numba", "llvmlite"):
            frame, callers = sys._getframe(), set()
            while frame := frame.f_back:
                callers.add((frame.f_globals["__name__"], frame.f_code.co_name))
            found[name] = ("robsim.kernels.machine.machine_code", "find_address") in callers
found = {}
sys.meta_path.insert(0, Finder())
experiment = rs.load_scenario(rs.examples.path("visp_tutorial"))
experiment.loop()
assert all(found.values()), found
"""


def test_no_module_but_those_that_compile_imports_a_compiler():
    (loaded,) = loaded_by(ALL.format(compiling={module_name(path) for path in COMPILING}))
    assert "robsim" in loaded and not COMPILERS & loaded


@pytest.mark.full
def test_only_the_search_for_machine_code_imports_a_compiler():
    """A scenario is read and its loop built, which calls kernels."""
    loaded_by(SCENARIO)


def test_kernels_work_without_the_rest_of_us():
    """Only the package itself, which is imported first, loads modules outside the kernels."""
    code = "import sys, types; from pathlib import Path; import importlib.util as u\n"
    code += f"root = types.ModuleType('robsim'); root.__path__ = [{str(ROOT)!r}]\n"
    code += "sys.modules['robsim'] = root\n"
    code += "".join(f"import {module_name(path)}\n" for path in KERNELS)
    code += "ours = {m for m in sys.modules if m.startswith('robsim.')} - {'robsim.container'}\n"
    code += "assert all(m.startswith('robsim.kernels') for m in ours), ours"
    (loaded,), (numba,) = loaded_by(code), loaded_by("import numba")
    assert not set(LATE) & loaded - numba
