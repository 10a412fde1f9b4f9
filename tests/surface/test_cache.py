"""Compiled kernels are kept between starts, and never when a source has changed."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import pytest

import robsim
from robsim.kernels import store

KERNELS = Path(robsim.__file__).parent / "kernels"
CALL = """
import json, sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from robsim.kernels import line_features, store
x, s = np.array([[[0.0], [0.0]], [[3.0], [0.0]]]), np.empty((4, 1))
line_features.segments(x, s)
stats = line_features.segments.stats
hits, misses = (sum(count.values()) for count in (stats.cache_hits, stats.cache_misses))
print(json.dumps([line_features.__file__, s[2:, 0].tolist(), hits, misses, str(store.CACHE)]))
"""
SOLVE = """
import json, sys
sys.path.insert(0, sys.argv[1])
import numpy as np
from robsim.kernels import solve
x, rank = np.empty((2, 1)), np.empty(1, np.int64)
solve.least_squares(np.ones((2, 2, 1)), np.ones((2, 1)), 0.0, 1e-9, x, rank)
hits = sum(solve.least_squares.stats.cache_hits.values())
print(json.dumps([solve.__file__, x[:, 0].round(14).tolist(), int(rank[0]), hits]))
"""
LENGTH = "math.sqrt(x * x + y * y), math.atan2(y, x)"  # of polar_of


@pytest.fixture
def copy(tmp_path):
    """A copy of the kernels, as a package robsim that has nothing else."""
    shutil.copytree(
        KERNELS, tmp_path / "robsim" / "kernels", ignore=shutil.ignore_patterns("__py*")
    )
    (tmp_path / "robsim" / "__init__.py").touch()
    return tmp_path


def start(copy, cache, code=CALL):
    """Run a kernel of the copy in a fresh Python: length and angle, hits, misses, cache folder."""
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
    assert (found, hits) == ([3.0, 0.0], 0) and misses == 1
    before = compiled(cache)
    assert before and Path(folder).parent == cache

    assert start(copy, cache) == [[3.0, 0.0], 1, 0, folder]
    assert compiled(cache) == before

    edit(copy / "robsim/kernels/point_features.py", LENGTH, "3.0 * " + LENGTH)
    found, hits, _, other = start(copy, cache)
    assert (found, hits) == ([9.0, 0.0], 0)
    assert other != folder and Path(other).parent == cache
    assert start(copy, cache) == [[9.0, 0.0], 1, 0, other]

    edit(copy / "robsim/kernels/point_features.py", "3.0 * " + LENGTH, LENGTH)
    assert start(copy, cache) == [[3.0, 0.0], 1, 0, folder]  # the old code is still there


@pytest.mark.first_start
def test_a_kept_kernel_finds_the_stages_that_it_calls_by_symbol_kept_or_not(copy):
    cache = copy / "cache"
    assert start(copy, cache, SOLVE) == [[0.5, 0.5], 1, 0]
    before = compiled(cache)
    assert start(copy, cache, SOLVE) == [[0.5, 0.5], 1, 1]
    assert compiled(cache) == before
    for stage in ("solve.by_triangle", "singular.truncate", "singular.rotate"):
        (file,) = cache.rglob(f"{stage}-*.nbc")
        file.unlink()
    assert start(copy, cache, SOLVE) == [[0.5, 0.5], 1, 1]
    assert compiled(cache).keys() == before.keys()


@pytest.mark.first_start
def test_without_a_place_to_write_kernels_are_compiled_anew(copy):
    (copy / "file").write_text("mine", encoding="utf-8")
    for _ in range(2):
        found, hits, *_ = start(copy, copy / "file" / "below")
        assert (found, hits) == ([3.0, 0.0], 0)
    assert (copy / "file").read_text(encoding="utf-8") == "mine"
    assert not list(copy.rglob("*.nbc"))


@pytest.mark.first_start
def test_every_kernel_source_and_its_name_count(copy):
    """The name of the folder, from nothing but the files: no compiling."""

    def name():
        code = f"import sys; sys.path.insert(0, {str(copy)!r})\n"
        code += "from robsim.kernels.store import KERNEL_HASH as name; print(name)"
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
    (copy / "robsim/kernels/tree.py").rename(copy / "robsim/kernels/trees.py")
    names.append(name())
    edit(copy / "robsim/kernels/trees.py", "\n", "\n\n")
    names.append(name())
    assert len(set(names)) == 4


def test_numba_keeps_its_own_cache_for_the_functions_of_a_user():
    assert os.environ.get("NUMBA_CACHE_DIR", "") == numba.config.CACHE_DIR
    assert store.CACHE.name == store.KERNEL_HASH and len(store.KERNEL_HASH) == 16


@pytest.mark.skipif(sys.platform == "win32", reason="the usual place is another one there")
def test_the_usual_place_is_the_users_cache_folder(monkeypatch, tmp_path):
    monkeypatch.delenv("ROBSIM_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert store._user_cache() == tmp_path / "robsim"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert store._user_cache() == tmp_path / ".cache" / "robsim"
