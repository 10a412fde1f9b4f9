"""Mesh files that would take hours or gigabytes, and the process that reads all meshes."""

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest
import trimesh
from hostile_meshes import HOSTILE

from robsim.base.errors import FileError
from robsim.geometry import mesh_process
from robsim.geometry.mesh_files import load_mesh
from robsim.geometry.mesh_parser import parse_mesh_file
from robsim.geometry.mesh_process import MESH_PROCESS, MeshProcess

REASONS = {
    "instances.dae": "needs more than",
    "many_instances.dae": "needs more than",
    "cycle.dae": "Dae",
    "deep.dae": "Dae",
    "empty_nodes.dae": "needs more than",
    "groups.obj": "needs more than",
    "nodes.glb": "needs more than",
    "deep.glb": "needs more than",
    "counts.glb": "memory",
    "huge_counts.glb": "memory",
    "copies.glb": "more than 1000000 triangles",
    "utf-7.dae": "encoding 'utf-7'",
    "padded.dae": "encoding 'utf-16-le'",
    "entities.dae": "a DOCTYPE is not allowed",
}
SLOW = [name for name, reason in REASONS.items() if "needs" in reason]
DEFAULT = ("instances.dae", "groups.obj", "nodes.glb")


@pytest.fixture
def ball(tmp_path):
    path = tmp_path / "ball.stl"
    trimesh.creation.icosphere(subdivisions=2, radius=0.1).export(path)
    return path


def read_hostile(folder, name):
    path = folder / name
    path.write_bytes(HOSTILE[name]())
    return load_mesh(path)


@pytest.mark.parametrize("name", [*DEFAULT, *(name for name in REASONS if name not in SLOW)])
def test_a_file_is_refused_within_its_limits(tmp_path, monkeypatch, name):
    for limit in ("SECONDS", "SECONDS_PER_MB") if name in DEFAULT else ():
        monkeypatch.setattr(mesh_process, limit, 0.2)  # seconds of processor time
    with pytest.raises(FileError, match=REASONS[name]):
        read_hostile(tmp_path, name)


@pytest.mark.full
@pytest.mark.parametrize("name", [name for name in SLOW if name not in DEFAULT])
def test_a_file_is_refused_after_some_seconds(tmp_path, monkeypatch, name):
    monkeypatch.setattr(mesh_process, "SECONDS", 2.0)
    before = os.times()
    with pytest.raises(FileError, match=REASONS[name]):
        read_hostile(tmp_path, name)
    used = os.times()
    children = used.children_user + used.children_system
    assert children - before.children_user - before.children_system < 8


def test_a_scene_of_nested_nodes_is_read(tmp_path):
    (mesh,) = read_hostile(tmp_path, "nested.glb")
    assert mesh.points.shape == (3, 3) and len(mesh.triangles) == 1


@pytest.mark.parametrize("kind", ["stl", "obj", "dae", "glb"])
def test_the_process_changes_no_bit(tmp_path, kind):
    path = tmp_path / f"torus.{kind}"
    torus = trimesh.creation.torus(0.3, 0.1, 90, 60)
    torus.visual.face_colors = [255, 128, 0, 255]
    torus.export(path)
    for found, wanted in zip(load_mesh(path), parse_mesh_file(path), strict=True):
        assert found.color == wanted.color
        for one, other in zip(found[:3], wanted[:3], strict=True):
            np.testing.assert_array_equal(one, other, strict=True)


def test_one_process_reads_all_meshes_and_another_one_replaces_it(ball):
    process = MeshProcess()
    first = process.read(ball, 1)
    number = process._process.pid
    assert process.read(ball, 1)[0].points.shape == first[0].points.shape
    assert process._process.pid == number
    process._process.stdin.close()  # as if it had been idle
    assert process._process.wait(10) == 0
    process.read(ball, 1)
    assert process._process.pid != number
    os.kill(process._process.pid, signal.SIGKILL)
    process._process.wait(10)
    assert len(process.read(ball, 1)) == 1
    process.close()


def test_a_process_that_dies_is_an_error_of_its_file(ball, monkeypatch):
    process = MeshProcess()
    process.read(ball, 1)
    monkeypatch.setattr(
        mesh_process, "_exchange", lambda each, _: os.kill(each.pid, signal.SIGSEGV)
    )
    with pytest.raises(FileError, match="its reader ends with status -11"):
        process.read(ball, 1)
    monkeypatch.undo()
    assert len(process.read(ball, 1)) == 1
    process.close()


def test_a_fork_starts_its_own_process(ball, monkeypatch):
    process = MeshProcess()
    process.read(ball, 1)
    parent = process._process
    monkeypatch.setattr(process, "_owner", -1)  # as in a fork
    assert len(process.read(ball, 1)) == 1
    assert process._process.pid != parent.pid and parent.poll() is None
    process.close()
    parent.kill()
    parent.communicate()


def test_threads_share_the_process(ball):
    process, found = MeshProcess(), []
    threads = [
        threading.Thread(target=lambda: found.append(process.read(ball, 1))) for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 4 and {len(each[0].triangles) for each in found} == {320}
    process.close()


def test_the_process_ends_with_its_owner(ball):
    code = (
        "import os; from pathlib import Path; from robsim.geometry.mesh_process import *;"
        f"MESH_PROCESS.read(Path({str(ball)!r}), 1); print(MESH_PROCESS._process.pid, flush=True);"
        "os.kill(os.getpid(), 9)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=False)
    number, end = int(done.stdout), time.monotonic() + 10
    while _is_running(number) and time.monotonic() < end:
        time.sleep(0.02)
    assert not _is_running(number)


def _is_running(number):
    """Return whether a process runs; a zombie does not."""
    try:
        with open(f"/proc/{number}/stat") as file:
            return file.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_without_a_process_it_is_an_error_of_the_file(ball, monkeypatch):
    MESH_PROCESS.close()
    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    with pytest.raises(FileError, match="not readable: no process to read it"):
        MESH_PROCESS.read(ball, 1)
