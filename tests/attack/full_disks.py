"""Disks that are full, or files that may not grow, while results are written."""

import os
import resource
import shutil
import signal
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
from attack.harness import Lost, Wrong

import robsim as rs

NAME = "full disks"
PATIENCE = 90.0
BEFORE = b"what was here before"
TARGETS = {  # the names that are written, and the code or the arguments that write them
    "run": (("out/run.nc",), "rs.save_run(rs.open_run('given.nc'), 'out/run.nc')"),
    "twice": (("out/run.nc",), "try: rs.save_run(rs.open_run('given.nc'), 'out/run.nc')\n"
              "except rs.errors.FileError: rs.save_run(rs.open_run('given.nc'), 'out/run.nc')"),
    "urdf": (("out/arm.urdf",), "rs.robots.rhino_xr4().to_urdf('out/arm.urdf')"),
    "mjcf": (("out/arm.xml",), "rs.robots.rhino_xr4().to_mjcf('out/arm.xml')"),
    "figure": (("out/arm.png",), ["robots", "planar_2r", "-o", "out/arm.png", "--force"]),
    "scenario": (("out/a.toml",), ["examples", "visp_tutorial", "-o", "out/a.toml", "--force"]),
    "command": (("out/run.nc", "out/scenario.toml", "out/image.png", "out/scene.png"),
                ["run", "given.toml", "-o", "out", "--force"]),
    "compare": (("out/comparison.nc", "out/comparison.csv", "out/given.nc"),
                ["compare", "given.toml", "-o", "out", "--force", "--no-figures"]),
    "bench": (("out/bench.csv", "out/bench.tex", "out/runs.csv"),
              ["bench", "gallery", "-o", "out", "--force"]),
}  # fmt: skip


def case(seed):
    """Write to a disk with few free bytes; the old file stays, or the new one is complete."""
    random = np.random.default_rng(seed)
    name = list(TARGETS)[random.integers(len(TARGETS))]
    names, code = TARGETS[name]
    whole = write_given_files(name)
    sizes = [len(whole[each]) for each in names]
    room = int(max(sizes) * random.uniform(0.0, 1.2))
    mounted = random.random() < 0.5 and mount(room)
    try:
        for each in names:
            Path(each).parent.mkdir(exist_ok=True)
            Path(each).write_bytes(BEFORE)
        done = run(code, None if mounted else room)
        check(done, names, whole)
        return done.returncode == 0
    finally:
        if mounted:
            subprocess.run(["umount", "out"], check=True)


def check(done, names, whole):
    if done.returncode < 0:
        os.kill(os.getpid(), -done.returncode)  # a crash
    if done.returncode not in (0, 2):
        raise Wrong(f"status {done.returncode}: {done.stderr[-300:]}")
    for name in names:
        found = Path(name).read_bytes() if Path(name).exists() else None
        gone = found is None and done.returncode == 2 and name.endswith((".png", ".nc"))
        if not gone and found not in (BEFORE, whole[name]) and not same_run(name, found):
            raise Lost(f"{name} has {len(found or b'')} bytes of {len(whole[name])}")
        if done.returncode == 0 and found == BEFORE:
            raise Lost(f"{name} was not written, and nothing said so")
    left = [each.name for each in Path("out").iterdir() if each.name.startswith(".robsim")]
    if left:
        raise Wrong(f"left behind: {left}")


def same_run(name, found):
    """Whether a run file is whole, be it another one than before."""
    try:
        return name.endswith(".nc") and bool(rs.open_run(name))
    except rs.RobSimError:
        return False


def run(code, room):
    """Return the result of a process that may write so many bytes into a file."""
    start = f"import robsim as rs\n{code}" if isinstance(code, str) else "robsim.cli.main()"
    lines = "import sys, robsim, robsim.cli\n" if not isinstance(code, str) else ""
    catch = "import robsim\ntry:\n" + "".join(f"  {line}\n" for line in start.splitlines())
    catch += "except robsim.RobSimError as error:\n  print(error)\n  raise SystemExit(2)\n"

    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        if room is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (room, room))

    arguments = [] if isinstance(code, str) else code
    command = [sys.executable, "-B", "-c", lines + catch, *arguments]  # byte code would be cut
    return subprocess.run(command, capture_output=True, text=True, preexec_fn=limit,
                          timeout=PATIENCE, check=False)  # fmt: skip


def mount(room):
    """Mount a small disk on out, with space for the old files and some bytes more."""
    Path("out").mkdir(exist_ok=True)
    size = room + 6 * len(BEFORE) + 16384
    command = ["mount", "-t", "tmpfs", "-o", f"size={size}", "none", "out"]
    return subprocess.run(command, capture_output=True, check=False).returncode == 0


@cache
def write_given_files(name):
    """The files that a target writes on a disk with enough space."""
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial"), ["run.duration=0.4 s"])
    rs.save_run(experiment.run(), "given.nc")
    Path("given.toml").write_text(experiment.text)
    names, code = TARGETS[name]
    Path("out").mkdir(exist_ok=True)
    done = run(code, None)
    assert done.returncode == 0, done.stderr
    found = {each: Path(each).read_bytes() for each in names}
    shutil.rmtree("out")
    return found
