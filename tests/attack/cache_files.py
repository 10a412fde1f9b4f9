"""Damaged files of compiled kernels, folders that cannot be written, and full disks."""

import json
import os
import pickle
import resource
import subprocess
import sys
import tempfile
from functools import cache
from io import BytesIO
from pathlib import Path

import numpy as np
from attack.harness import Lost, Wrong

from robsim.container import pack_container, unpack_container
from robsim.kernels.machine import cache_files

NAME = "cache_files"
PATIENCE = 120.0  # seconds: damaged kernels are compiled anew

SIMULATE = """
import json
from robsim.kernels.machine import cache_files
names, load = set(), cache_files.load_code
def noted(name, key):
    names.add(cache_files.code_file_name(name, key))
    return load(name, key)
cache_files.load_code = noted
import robsim as rs
scenario = rs.load_scenario(rs.examples.path("visp_tutorial"))
run = scenario.run(duration=0.4)
bits = run.q.values.tobytes() + run.s.values.tobytes() + run.camera_pose.values.tobytes()
print(json.dumps([sorted(names), bits.hex()]))
"""


def simulated(folder, limit=None):
    """The names of the kernels that a short simulation loads, and its bits, with a cache folder."""
    done = subprocess.run(
        [sys.executable, "-B", "-c", SIMULATE],  # -B: else byte code would be cut
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "ROBSIM_CACHE_DIR": str(folder), "ROBSIM_USE_NUMBA": "1"},
        preexec_fn=limit,
    )
    if done.returncode or done.stderr:
        raise Wrong(f"status {done.returncode}: {done.stderr[-300:]}")
    names, bits = json.loads(done.stdout)
    return names, bits


@cache
def expected():
    """The files that the simulation needs, {name: content}, and its bits."""
    simulated(cache_files.CACHE.parent)  # compiles the missing kernels
    names, bits = simulated(cache_files.CACHE.parent)
    paths = {name: cache_files.CACHE / name for name in names}
    return {n: path.read_bytes() for n, path in paths.items() if path.exists()}, bits


def case(seed):
    """Damage some files, simulate, and simulate again."""
    rng = np.random.default_rng(seed)
    files, bits = expected()
    with tempfile.TemporaryDirectory() as root:
        place = Path(root) / "cache"
        place.mkdir()
        folder = place / cache_files.CACHE.name
        folder.mkdir()
        for name, content in files.items():
            (folder / name).write_bytes(content)
        damage = DAMAGES[rng.integers(len(DAMAGES))]
        limit = damage(rng, place, folder, sorted(files))
        for _ in range(2):
            if simulated(place, limit)[1] != bits:
                raise Wrong(f"other numbers after {damage.__name__}")
        left = [path.name for path in place.rglob("*.tmp")]
        if left:
            raise Lost(f"drafts after {damage.__name__}: {left}")
    return True


def choose_names(rng, names):
    """One to three names."""
    return [str(name) for name in rng.choice(names, rng.integers(1, 4), replace=False)]


def cut(rng, place, folder, names):
    """Files end anywhere, or are empty."""
    for name in choose_names(rng, names):
        content = (folder / name).read_bytes()
        (folder / name).write_bytes(content[: rng.integers(len(content)) * rng.integers(2)])


def flipped(rng, place, folder, names):
    """Some bits are others."""
    for name in choose_names(rng, names):
        content = bytearray((folder / name).read_bytes())
        for at in rng.integers(len(content), size=rng.integers(1, 5)):
            content[at] ^= 1 << rng.integers(8)
        (folder / name).write_bytes(content)


def swapped(rng, place, folder, names):
    """Two kernels of one signature have each other's files."""
    kinds = {}
    for name in names:
        kinds.setdefault(name.split(".")[-2], []).append(name)
    group = max(kinds.values(), key=len)
    one, other = (folder / str(name) for name in rng.choice(group, 2, replace=False))
    contents = one.read_bytes(), other.read_bytes()
    other.write_bytes(contents[0])
    one.write_bytes(contents[1])


def pickled(rng, place, folder, names):
    """The digest is right, but the content is no kernel."""
    for name in choose_names(rng, names):
        key, _ = unpack_container(BytesIO((folder / name).read_bytes()))
        wrong = [None, ([], ()), (["robsim.none"], ()), ([], (1, 2, 3)), "text", b"\0"]
        data = np.frombuffer(pickle.dumps(wrong[rng.integers(len(wrong))]), np.uint8)
        odd = [(key, [data]), (key, []), (key[:1], [data]), (None, [data, data])]
        (folder / name).write_bytes(pack_container(*odd[rng.integers(4)]).getbuffer())


def folders(rng, place, folder, names):
    """Folders stand where files should."""
    for name in choose_names(rng, names):
        (folder / name).unlink()
        (folder / name).mkdir()


def fill_disk(rng, place, folder, names):
    """Some files are missing, and no file may be longer than some bytes."""
    for name in choose_names(rng, names):
        (folder / name).unlink()
    size = int(rng.integers(5000))
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


DAMAGES = [*[cut, flipped, swapped, pickled] * 3, *[folders, fill_disk] * 2]
