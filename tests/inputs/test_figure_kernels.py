"""The kernels of figures are compiled by another process, while the first one simulates."""

import os
import subprocess
import time
from types import SimpleNamespace

import numpy as np
import pytest

import robsim as rs
from robsim.base import processors
from robsim.cli import figure_kernels
from robsim.cli.figure_kernels import COMMAND, FIGURE, PICTURES, compile_figure_kernels
from robsim.kernels.machine import cache_files, machine_code

LIMIT = 300.0  # seconds


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache, on a machine with two processors and without machine code."""
    folder = tmp_path / "kernels"
    monkeypatch.setenv("ROBSIM_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("ROBSIM_USE_NUMBA", "1")
    monkeypatch.setattr(cache_files, "CACHE", folder)
    monkeypatch.setattr(processors, "count_processors", lambda: 2)
    monkeypatch.setattr(machine_code, "PACKAGE_CODE", machine_code.PackageCode())
    return folder


@pytest.fixture
def started(monkeypatch):
    """The processes that are started."""
    found, start = [], subprocess.Popen
    monkeypatch.setattr(
        subprocess,
        "Popen",
        lambda *given, **options: found.append(start(*given, **options)) or found[-1],
    )
    return found


@pytest.fixture(scope="module")
def rhino():
    return rs.load_scenario(rs.examples.path("chapter_6_1"))


def stored(cache, kernel):
    return list(cache.glob(f"{kernel}-*.nbc"))


@pytest.mark.first_start
def test_they_are_stored_and_this_process_compiles_none(cache, started, rhino):
    before, limit = set(cache_files.SAVED), time.monotonic() + LIMIT
    with compile_figure_kernels(rhino, figures=True, page=True):
        while not all(stored(cache, each) for each in (FIGURE, PICTURES)):
            assert time.monotonic() < limit
            time.sleep(0.05)
    assert set(cache_files.SAVED) == before
    with compile_figure_kernels(rhino, figures=True, page=True):
        assert len(started) == 1


def test_the_other_process_ends_with_the_command_and_hears_no_ctrl_c(cache, started, rhino):
    with pytest.raises(KeyboardInterrupt), compile_figure_kernels(rhino, True, True):
        (process,) = started
        assert process.args == [*COMMAND, FIGURE, PICTURES] and process.poll() is None
        assert os.getsid(process.pid) == process.pid  # Ctrl-C reaches processes of one session
        raise KeyboardInterrupt
    assert process.returncode


@pytest.mark.parametrize(
    ("figures", "page", "count"),
    [(False, False, 0), (True, False, 0), (False, True, 1)],
    ids=["no figures", "a figure whose kernel is stored", "a page whose kernel is not"],
)
def test_a_process_starts_if_a_needed_kernel_is_not_stored(
    cache, started, rhino, figures, page, count
):
    cache.mkdir()
    (cache / f"{FIGURE}-21.0.nbc").touch()
    with compile_figure_kernels(rhino, figures, page):
        assert len(started) == count


def test_one_processor_compiles_in_one_process(cache, started, rhino, monkeypatch):
    monkeypatch.setattr(processors, "count_processors", lambda: 1)
    with compile_figure_kernels(rhino, True, True):
        assert not started


@pytest.mark.parametrize("distortion", [(0.0,) * 4, (-0.1, 0.0, 0.0, 0.0)])
@pytest.mark.parametrize("picture", [None, np.eye(4, dtype=np.uint8)])
def test_the_variant_of_the_scene_is_compiled(cache, monkeypatch, distortion, picture):
    commands = []
    start = SimpleNamespace(kill=bool, wait=bool)
    monkeypatch.setattr(
        figure_kernels, "_start_process", lambda names: commands.append(names) or start
    )
    K = np.array([[84.0, 0.0, 46.9], [0.0, 90.0, 36.7], [0.0, 0.0, 1.0]])
    eye = rs.MountedCamera("eye", rs.Camera(K, (96, 72), distortion=distortion))
    block = rs.shapes.Block(0.3, 0.3, 0.1, picture=picture)
    scene = rs.Scene(objects=rs.Object("block", block), cameras=eye)
    with compile_figure_kernels(SimpleNamespace(scene=scene), figures=False, page=True):
        pass
    number = (picture is not None) + 2 * (distortion[0] != 0.0)
    assert commands == [[f"{PICTURES}.{number}" if number else PICTURES]]
