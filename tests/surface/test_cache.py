"""Compiled kernels are kept between starts, and never when a source has changed."""

import ast
import json
import os
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

import numba
import pytest

import robsim
from robsim.kernels.machine import cache_files, sources

KERNELS = Path(robsim.__file__).parent / "kernels"
CALL = """
import json, sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from robsim.kernels.image_features import photometric_moments as moments
from robsim.kernels.machine import cache_files
found = moments.shift_moment(np.array([3.0, 9.0]), 0, 0.0, 0.0)
stats = moments.shift_moment.dispatcher.stats
hits, misses = (sum(count.values()) for count in (stats.cache_hits, stats.cache_misses))
print(json.dumps([moments.__file__, found, hits, misses, str(cache_files.CACHE)]))
"""
SOLVE = """
import json, sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from robsim.kernels.linear_algebra import pseudoinverse
x, rank = np.empty((2, 1)), np.empty(1, np.int64)
pseudoinverse.least_squares(np.ones((2, 2, 1)), np.ones((2, 1)), 0.0, 1e-9, x, rank)
hits = sum(pseudoinverse.least_squares.dispatcher.stats.cache_hits.values())
print(json.dumps([pseudoinverse.__file__, x[:, 0].round(14).tolist(), int(rank[0]), hits]))
"""
OWN = """
import json, sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from mine import scaling
from robsim.kernels.machine import cache_files
x = np.ones(2)
scaling.scale(x)
scaling.twice(x)
scaling.shift(x)
stats = [each.dispatcher.stats for each in (scaling.scale, scaling.twice)]
hits = [sum(each.cache_hits.values()) for each in stats]
from robsim.kernels.machine.compiler.compile_notice import NOTICE
hits.append(1 - NOTICE.compiled.count("scaling.shift"))
print(json.dumps([scaling.__file__, x.tolist(), hits]))
"""
FILES = {
    "__init__": "",
    "factor": "FACTOR = 3.0\n",
    "applied": """
from robsim.kernels.machine.kernel import kernel
def applied(function):
    @kernel
    def apply(x):
        x[0] = function(x[0])
    return apply
""",
    "doubled": """
from robsim.kernels.machine.kernel import part
@part
def doubled(x):
    return 2.0 * x
""",
    "scaling": """
from robsim.kernels.machine.entry import entry
from robsim.kernels.machine.kernel import kernel
from .applied import applied
from .doubled import doubled
from . import factor
@kernel
def scale(x):
    x[1] *= factor.FACTOR
twice = applied(doubled)
@entry("float64[::1]")
def shift(x):
    x[1] += doubled(factor.FACTOR)
""",
}
REACH = """
import importlib, json, sys
sys.path.insert(0, sys.argv[1])
from robsim.kernels.machine import sources
def digests():
    importlib.reload(sources)
    return {module: sources.digest_of(module) for module in sources.SOURCES}
before, changed = digests(), {}
for module, path in json.loads(sys.argv[2]).items():
    with open(path, "ab") as file:
        file.write(b"# edited\\n")
    after = digests()
    changed[module] = [name for name in after if before[name] != after[name]]
    before = after
print(json.dumps(changed))
"""
INDEX = "(i + j) * (i + j + 1) // 2 + j"  # of moment_index


@pytest.fixture
def copy(tmp_path):
    """A copy of the kernels and the container of their code, as a package that has no more."""
    shutil.copytree(
        KERNELS, tmp_path / "robsim" / "kernels", ignore=shutil.ignore_patterns("__py*")
    )
    (tmp_path / "robsim" / "__init__.py").touch()
    shutil.copy(KERNELS.parent / "container.py", tmp_path / "robsim")
    return tmp_path


def start(copy, cache, code=CALL):
    """Run a kernel of the copy in a fresh Python: its result, hits, misses, cache folder."""
    environment = {**os.environ, "ROBSIM_CACHE_DIR": str(cache), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code, str(copy)],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
    )
    assert (done.returncode, done.stderr) == (0, "")
    file, *rest = json.loads(done.stdout)
    assert Path(file).is_relative_to(copy)
    return rest


def edit(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def compiled(cache):
    return {path: path.stat().st_mtime_ns for path in cache.rglob("*.nbc")}


@pytest.mark.first_start
def test_an_edit_in_a_callee_of_another_file_is_seen_and_a_second_start_compiles_nothing(copy):
    cache = copy / "cache"
    found, hits, misses, folder = start(copy, cache)
    assert (found, hits, misses) == (3.0, 0, 1)
    before = compiled(cache)
    assert before and Path(folder).parent == cache

    assert start(copy, cache) == [3.0, 1, 0, folder]
    edit(copy / "robsim/kernels/control/docking_law.py", "\n", "\n\n")  # which it does not import
    assert start(copy, cache) == [3.0, 1, 0, folder]
    assert compiled(cache) == before

    edit(copy / "robsim/kernels/formulas/image_moments.py", INDEX, "1 + " + INDEX)
    found, hits, _, other = start(copy, cache)
    assert (found, hits, other) == (9.0, 0, folder)
    assert compiled(cache).keys() > before.keys()
    assert start(copy, cache) == [9.0, 1, 0, folder]

    edit(copy / "robsim/kernels/formulas/image_moments.py", "1 + " + INDEX, INDEX)
    assert start(copy, cache) == [3.0, 1, 0, folder]  # the old code is still there


@pytest.mark.first_start
def test_a_kept_kernel_finds_the_stages_that_it_calls_by_symbol_kept_or_not(copy):
    cache = copy / "cache"
    assert start(copy, cache, SOLVE) == [[0.5, 0.5], 1, 0]
    before = compiled(cache)
    assert start(copy, cache, SOLVE) == [[0.5, 0.5], 1, 1]
    assert compiled(cache) == before
    for stage in ("pseudoinverse.by_triangle", "svd.truncate", "svd.rotate"):
        (file,) = cache.rglob(f"{stage}-*.nbc")
        file.unlink()
    assert start(copy, cache, SOLVE) == [[0.5, 0.5], 1, 1]
    assert compiled(cache).keys() == before.keys()


@pytest.mark.first_start
def test_an_edit_of_a_stage_that_is_called_by_symbol_is_seen(copy):
    cache = copy / "cache"
    assert start(copy, cache, SOLVE) == [[0.5, 0.5], 1, 0]
    rank = "    put(block, scratch, rank)\n"
    edit(copy / "robsim/kernels/linear_algebra/svd.py", rank, rank.replace("rank)", "7.0 + rank)"))
    assert start(copy, cache, SOLVE) == [[0.5, 0.5], 8, 0]
    assert start(copy, cache, SOLVE) == [[0.5, 0.5], 8, 1]


@pytest.mark.first_start
def test_kernels_of_a_user_are_kept_until_something_of_theirs_is_edited(copy):
    cache, mine = copy / "cache", copy / "mine"
    mine.mkdir()
    for name, text in FILES.items():
        (mine / f"{name}.py").write_text(text, encoding="utf-8")
    assert start(copy, cache, OWN) == [[2.0, 9.0], [0, 0, 0]]
    assert start(copy, cache, OWN) == [[2.0, 9.0], [1, 1, 1]]
    edit(mine / "factor.py", "3.0", "5.0")  # a constant
    assert start(copy, cache, OWN) == [[2.0, 15.0], [0, 1, 0]]
    edit(mine / "doubled.py", "2.0", "7.0")  # a free variable of `apply`, which does not import it
    assert start(copy, cache, OWN) == [[7.0, 40.0], [0, 0, 0]]
    assert start(copy, cache, OWN) == [[7.0, 40.0], [1, 1, 1]]


@pytest.mark.parametrize("module", ["lane_operations", "routines", "array_pointers", "fixed_size"])
def test_the_definitions_of_intrinsics_are_sources_of_each_kernel(module):
    """They are imported late, by name."""
    for kernel in ("robsim.kernels.formulas.se3", "robsim.kernels.linear_algebra.svd"):
        reached = sources.import_closure(kernel)
        assert f"robsim.kernels.machine.compiler.{module}" in reached


def kernels_in(path):
    """The number of entries, kernels and stages that a file defines."""
    found = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    named = (ast.unparse(each) for n in found for each in getattr(n, "decorator_list", ()))
    return sum(name.partition("(")[0] in {"entry", "kernel", "stage"} for name in named)


@pytest.mark.full
def test_an_edit_of_a_file_compiles_twelve_kernels_anew_in_the_median(copy):
    """From nothing but the sources: a comment at the end of each file in turn."""
    paths = {
        module: copy / "robsim" / path.relative_to(KERNELS.parent)
        for module, path in files_of_kernels().items()
    }
    count = {module: kernels_in(path) for module, path in paths.items()}
    given = json.dumps({module: str(path) for module, path in paths.items()})
    done = subprocess.run(
        [sys.executable, "-c", REACH, str(copy), given], capture_output=True, text=True, check=True
    )
    changed = json.loads(done.stdout)
    assert all(module in changed[module] for module in paths)
    again = [sum(count.get(name, 0) for name in each) for each in changed.values()]
    assert sum(count.values()) > 240 and statistics.median(again) <= 12


def files_of_kernels():
    """The files of kernels, by the names of their modules."""
    paths = [path for path in KERNELS.rglob("*.py") if path.name != "__init__.py"]
    parts = [path.relative_to(KERNELS.parent.parent).with_suffix("").parts for path in paths]
    return {".".join(each): path for each, path in zip(parts, paths, strict=True)}


def test_the_imports_of_a_kernel_file_are_those_that_python_reads():
    for module, path in files_of_kernels().items():
        tree, expected = list(ast.walk(ast.parse(path.read_text(encoding="utf-8")))), set()
        for each in tree:
            if isinstance(each, ast.ImportFrom):
                assert each.level == 0
                expected |= {each.module, *(f"{each.module}.{name.name}" for name in each.names)}
            elif isinstance(each, ast.Import):
                expected |= {name.name for name in each.names}
        assert sources.imported_modules(module) == expected & sources.SOURCES.keys(), module
        is_by_name = "import_module" in path.read_text(encoding="utf-8")
        assert is_by_name == (module == "robsim.kernels.machine.intrinsics")


def test_a_function_without_a_file_is_not_kept():
    assert sources.digest_of("no_such_module") == ""
    assert len(sources.digest_of("robsim.kernels.control.docking_law")) == 20


@pytest.mark.first_start
def test_without_a_place_to_write_kernels_are_compiled_anew(copy):
    (copy / "file").write_text("mine", encoding="utf-8")
    for _ in range(2):
        found, hits, *_ = start(copy, copy / "file" / "below")
        assert (found, hits) == (3.0, 0)
    assert (copy / "file").read_text(encoding="utf-8") == "mine"
    assert not list(copy.rglob("*.nbc"))


@pytest.mark.first_start
def test_every_kernel_source_and_its_name_count(copy):
    """The hash that stands in results, from nothing but the files: no compiling."""

    def name():
        code = f"import sys; sys.path.insert(0, {str(copy)!r})\n"
        code += "from robsim.kernels.machine.cache_files import KERNEL_HASH as name; print(name)"
        environment = {**os.environ, "ROBSIM_CACHE_DIR": str(copy / "cache")}
        done = subprocess.run(
            [sys.executable, "-c", code],
            capture_output=True,
            text=True,
            check=True,
            env=environment,
        )
        return done.stdout.strip()

    names = [name()]
    (copy / "robsim/kernels/more.py").write_text("# more", encoding="utf-8")
    names.append(name())
    (copy / "robsim/kernels/formulas/body_arrays.py").rename(copy / "robsim/kernels/trees.py")
    names.append(name())
    edit(copy / "robsim/kernels/trees.py", "\n", "\n\n")
    names.append(name())
    assert len(set(names)) == 4


def test_numba_keeps_its_own_cache_for_the_functions_of_a_user():
    assert os.environ.get("NUMBA_CACHE_DIR", "") == numba.config.CACHE_DIR
    assert cache_files.CACHE.parent == cache_files.USER_CACHE and len(cache_files.KERNEL_HASH) == 16


@pytest.mark.skipif(sys.platform == "win32", reason="the usual place is another one there")
def test_the_usual_place_is_the_users_cache_folder(monkeypatch, tmp_path):
    monkeypatch.delenv("ROBSIM_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_files._user_cache_folder() == tmp_path / "robsim"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_files._user_cache_folder() == tmp_path / ".cache" / "robsim"
