"""Signals at any moment of commands and scripts: nothing is lost, and --resume has all bits."""

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from functools import cache
from pathlib import Path

import numpy as np
from attack.harness import Lost, Wrong

import robsim as rs
from robsim.base import interrupt

NAME = "stops"
PATIENCE = 90.0  # seconds
EXIT = 20.0  # seconds after the last signal
STATUS = {128 + s for s in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
SCENE = """
schema = 1
title = "Long"
robots = [{ model = "free_camera" }]
objects = [{ name = "dots", marks = ["0, 0, 1 m", "10, 0, 100 cm", "0, 10, 100 cm"] }]
cameras = [{ name = "eye", on = "free_camera.body", focal = 800, center = [320, 240] }]
sensing = { noise = 1.0, latency = "3 ms" }
"""
RUN = (
    SCENE
    + """
task = { kind = "ibvs", tolerance = 1e-12 }
run = { dt = "1 ms", duration = "60 s", record = 20 }
"""
)
MISSION = (
    SCENE
    + """
run = { dt = "1 ms", duration = "20 s", record = 20 }
[task]
kind = "mission"
phases = [
    { name = "one", task = { kind = "ibvs", tolerance = 1e-12 }, expects = "time_limit" },
    { name = "two", task = { kind = "ibvs", tolerance = 1e-12 }, expects = "time_limit" },
    { name = "three", task = { kind = "ibvs", tolerance = 1e-12 }, expects = "time_limit" },
]
"""
)
OFTEN = """
import contextlib
with contextlib.suppress(ImportError):
    from robsim.run import checkpoint
    checkpoint.INTERVAL, checkpoint.SHARE = 0.1, 1.0
from robsim.cli import main
main()
"""
SCRIPT = """
import robsim as rs
experiment = rs.load_scenario("run.toml", ["run.duration=900 s"])
told = []
def tell(share):
    if share and not told:
        told.append(print("ready", flush=True))
try:
    rs.save_run(experiment.run(tell), "out/run.nc")
except rs.errors.Interrupted as stop:
    rs.save_run(stop.run, "out/run.nc")
"""
COMMANDS = {
    "run": ["run", "run.toml", "-o", "out", "--no-figures"],
    "mission": ["run", "mission.toml", "-o", "out", "--no-figures"],
    "compare": ["compare", "run.toml", "--vary", "task.gain=1,2,3", "-o", "out"],
    "explain": ["explain", "done/run.nc"],
    "demo": ["demo", "-o", "out"],
}
RESUMES = hasattr(interrupt, "SIGNALS")  # older versions do not
FILES = {"compare": "comparison.nc"}


def case(seed):
    """Send one to four signals to a command or a script; then continue from the files it left."""
    rng = np.random.default_rng(seed)
    what = str(rng.choice([*["run", "mission"] * 3, "compare", "explain", "demo", "script"]))
    before = Path.cwd()
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            Path("run.toml").write_text(RUN, encoding="utf-8")
            Path("mission.toml").write_text(MISSION, encoding="utf-8")
            if what == "explain":
                rs.save_run(
                    rs.load_scenario("run.toml", ["run.record=1"]).run(duration=2), "done/run.nc"
                )
            return stop_and_resume(rng, what)
        finally:
            os.chdir(before)


def stop_and_resume(rng, what):
    """Start, stop and take up a command; return whether it was stopped."""
    often = what in ("run", "mission") and rng.random() < 0.6
    command = ["-c", SCRIPT] if what == "script" else ["-m", "robsim", *COMMANDS[what]]
    if often:
        command = ["-c", OFTEN, *COMMANDS[what]]
    status, err = run_and_stop(rng, command, what)
    killed = status == -signal.SIGKILL
    if "Traceback" in err or "ignored" in err:
        raise Wrong(f"{what}: {re.sub(chr(10), ' | ', err)[-300:]}")
    if not killed and status not in {0, *STATUS}:
        raise Wrong(f"{what}: status {status}: {err[-200:]}")
    path = Path("out", FILES.get(what, "run.nc"))
    explanation = "what was simulated so far" in err or (
        status == 0 and what not in ("explain", "demo")
    )
    if not killed and explanation and not path.exists():
        raise Lost(f"{what}: no {path} after {err[-200:]!r}")
    if not killed and path.exists() and what != "mission":
        rs.open_run(path) if what != "compare" else rs.open_run("out/1.nc")
    if what in ("run", "mission"):
        taken_up(what, killed)
    return status != 0


def taken_up(what, killed):
    """Resume what left a checkpoint, and compare with a run that was not stopped."""
    if Path("out/checkpoint").exists():
        done = subprocess.run(
            [sys.executable, "-m", "robsim", *COMMANDS[what], "--resume"],
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            raise Lost(f"{what}: --resume ends with {done.returncode}: {done.stderr[-300:]}")
    elif killed or not Path("out/run.nc").exists() or not RESUMES:
        return
    if rs.open_run("out/run.nc").q.values.tobytes() != simulate_whole(what):
        raise Wrong(f"{what}: other bits, or a part without a checkpoint")


@cache
def simulate_whole(what):
    """The bits of a run that was not stopped."""
    run = rs.Experiment.from_text(RUN if what == "run" else MISSION).run()
    return (run if what == "run" else run.run).q.values.tobytes()


def run_and_stop(rng, command, what):
    """Start a command and send signals; return its status and its output."""
    child = subprocess.Popen(
        [sys.executable, *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        if what == "script":
            child.stdout.readline()
        else:
            until_it_listens(child)
        kinds = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]
        count = 1 if what == "script" else int(rng.integers(1, 5))
        waits = rng.uniform(0.0, 1.2, count) * rng.choice([1.0, 0.05], count)
        kill = rng.random() < 0.25 and what in ("run", "mission")
        for i, wait in enumerate(waits):
            time.sleep(wait)
            kind = signal.SIGKILL if kill and i == count - 1 else rng.choice(kinds)
            child.send_signal(signal.Signals(kind))
        _, err = child.communicate(timeout=EXIT)
    except subprocess.TimeoutExpired:
        raise Wrong(f"{what}: no end {EXIT:.0f} s after the last signal") from None
    finally:
        child.kill()
        child.communicate()
    return child.returncode, err


def until_it_listens(child):
    """Wait until SIGTERM is caught: before its first line nothing of ours can hear."""
    end = time.monotonic() + (EXIT if RESUMES else 1.0)
    while time.monotonic() < end and child.poll() is None:
        status = Path(f"/proc/{child.pid}/status").read_text(encoding="utf-8")
        if int(re.search(r"SigCgt:\s*(\w+)", status)[1], 16) >> (signal.SIGTERM - 1) & 1:
            return
        time.sleep(0.002)
