"""Processes that start at the same time and write into the same place."""

import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
from attack.harness import Lost, Wrong

import robsim as rs

NAME, PATIENCE = "together", 90.0
READY = (
    "import sys, robsim.cli, robsim.run.experiment\n"
    "print(flush=True)\nsys.stdin.readline()\nrobsim.cli.main()"
)


def case(seed):
    """Start some commands together: each has a folder of its own, or one writes at a time."""
    random = np.random.default_rng(seed)
    count, named = int(random.integers(2, 5)), bool(random.integers(2))
    force = named and bool(random.integers(2))
    folder = f"work-{seed}"
    Path(folder).mkdir()
    command = ["run", make_scenario_text(), "--no-figures", *(["-o", "out"] if named else [])]
    ended = together([*command, *(["--force"] if force else [])], count, folder)
    (alone if named else apart)(Path(folder), ended, force)
    return True


def together(command, count, folder):
    """Let processes that have started begin their command at once; return how they ended."""
    code = [sys.executable, "-c", READY, *command]
    pipe = subprocess.PIPE
    begun = [
        subprocess.Popen(code, stdin=pipe, stdout=pipe, stderr=pipe, text=True, cwd=folder)
        for _ in range(count)
    ]
    for each in begun:
        each.stdout.readline()
    for each in begun:
        each.stdin.write("\n")
        each.stdin.flush()
    return [(*each.communicate(timeout=PATIENCE), each.returncode) for each in begun]


def alone(folder, ended, force):
    """The second process wrote after the first or was refused; without --force only one wrote."""
    codes = [code for *_, code in ended]
    if any(code not in (0, 2) for code in codes) or 0 not in codes:
        raise Wrong(f"status {codes}: {[err for _, err, _ in ended]!s:.300}")
    if codes.count(0) > 1 and not force:
        raise Lost(f"{codes.count(0)} of {len(codes)} wrote the same files")
    check_results(folder / "out")


def apart(folder, ended, force):
    """Each wrote a folder of its own."""
    said = [out.split("results ")[-1].strip() for out, _, _ in ended]
    if any(code for *_, code in ended):
        raise Wrong(f"{[err for _, err, _ in ended]!s:.300}")
    if len(set(said)) < len(said):
        raise Lost(f"{len(said)} runs wrote {len(set(said))} folders")
    for each in said:
        check_results(folder / each)


def check_results(folder):
    names = sorted(each.name for each in folder.iterdir())
    if names != ["run.nc", "scenario.toml"]:
        raise Wrong(f"{folder} has {names}")
    rs.open_run(folder / "run.nc")
    rs.load_scenario(folder / "scenario.toml")


@cache
def make_scenario_text():
    """A scenario that runs for a moment."""
    text = rs.load_scenario(rs.examples.path("visp_tutorial"), ["run.duration=0.4 s"]).text
    path = Path("given.toml").resolve()
    path.write_text(text)
    return str(path)
