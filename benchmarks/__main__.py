"""All in one table, before and after: `python -m benchmarks` from the root of the repository.

The rows before are in before.json, measured by the same functions on the same machine: `--write
FILE` writes such a file, with PYTHONPATH at the sources of the earlier commit. `--peer` names a
Python that has any of pin, roboticstoolbox-python, EAIK, machinevision-toolbox-python and jax: each
is measured in this run, too; so is rosbags if it is installed here. `--cold` adds a first start
with an empty kernel cache, and `--tests` the default tests.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))  # the scripts of this folder import each other by name

import detection  # noqa: E402
import kinematics  # noqa: E402
import numpy_baseline  # noqa: E402
import pictures  # noqa: E402
import schemes  # noqa: E402
import speed  # noqa: E402
import startup  # noqa: E402
import varied  # noqa: E402
import waits  # noqa: E402

import robsim as rs  # noqa: E402


def calls():
    """Microseconds of single calls of a Puma 560, and of a whole simulation of one step."""
    robot, least = rs.robots.puma560(), kinematics.least
    q = robot.home + 0.1
    T = robot.fk(q)
    scene, task = schemes.arm_with_a_camera("puma560"), rs.IBVS()
    found = {
        "fk": lambda: robot.fk(q),
        "jacobian": lambda: robot.jacobian(q),
        "ik near home": lambda: robot.ik(T),
        "closed_ik": lambda: robot.closed_ik(T),
        "simulate, one step": lambda: rs.simulate(scene, task, duration=0.04),
        "one step, a new task": lambda: rs.simulate(scene, rs.IBVS(), duration=0.04),
    }
    return {name: {"single": 1e6 * least(call)} for name, call in found.items()}


def starts(cold):
    """Seconds of CPU of commands with cached kernels, and of one without."""
    found = {"robsim --help, s": startup.measured(startup.HELP, dict(os.environ))[1]}
    with tempfile.TemporaryDirectory() as folder:
        demo = [*startup.DEMO, str(Path(folder) / "run")]
        if cold:
            empty = {**os.environ, "ROBSIM_CACHE_DIR": str(Path(folder) / "cache")}
            found["cold demo, s"] = startup.measured(demo, empty)[1]
        startup.measured(demo, dict(os.environ))
        found["warm demo, s"] = startup.measured(demo, dict(os.environ))[1]
    return {name: {"single": seconds} for name, seconds in found.items()}


def tests():
    """Seconds on the clock of the default tests, with the kernels that are there."""
    start = time.perf_counter()
    subprocess.run([sys.executable, "-m", "pytest", "-q"], cwd=HERE.parent, check=True)
    return {"default tests, s": {"single": time.perf_counter() - start}}


def peers(python):
    """(what, ours, who, theirs) in microseconds, one row for each peer that is there."""
    robot = rs.robots.puma560()
    ours = kinematics.singles(robot)
    for who, theirs in _tried(lambda: kinematics.peers(python, robot)).items():
        for what in theirs.keys() & ours.keys():
            yield f"{what} of a Puma 560", ours[what], who, theirs[what]
    step = speed.single_step()
    for seconds in _tried(lambda: {"": speed.peer_step(python)}).values():
        yield "a step of a single run", step, "machinevision-toolbox", seconds
    batch = speed.batch_step(1)[0]
    yield (
        "a run and step of a batch",
        batch,
        "NumPy",
        speed.numpy_step(numpy_baseline.pseudo_inverse),
    )
    solve = numpy_baseline.normal_equations
    yield "a run and step of a batch", batch, "NumPy, normal equations", speed.numpy_step(solve)
    for seconds in _tried(lambda: {"": jax_step(python)}).values():
        yield "a run and step of a batch", batch, "JAX, compiled", seconds


def jax_step(python):
    """Seconds per run and step of JAX, measured by its own Python on one core."""
    call = ["taskset", "-c", "0", python, HERE / "peer_jax.py"]
    done = subprocess.run(call, capture_output=True, check=True)
    return float(json.loads(done.stdout.splitlines()[-1])["seconds_per_step"])


def _tried(measure):
    """Return the requirements of a peer, or nothing if they are not installed."""
    try:
        return measure()
    except (subprocess.CalledProcessError, OSError, IndexError) as reason:
        print(f"a peer is left out: {reason!r:.100}", file=sys.stderr)
        return {}


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--peer", help="a Python that has other programs")
    parser.add_argument("--cold", action="store_true", help="a first start, too")
    parser.add_argument("--tests", action="store_true", help="the default tests, too")
    parser.add_argument("--write", type=Path, help="a file for the rows, instead of the tables")
    told = parser.parse_args()
    warnings.simplefilter("ignore")
    found = schemes.measured() | calls() | starts(told.cold) | (tests() if told.tests else {})
    waited = waits.measured()
    if told.write:
        told.write.write_text(json.dumps(found | waited, indent=1) + "\n", encoding="utf-8")
        return
    before = json.loads(schemes.BEFORE.read_text(encoding="utf-8"))
    print_rows(before, found)
    waits.main(before, waited)
    bags()
    print()
    varied.main()
    pictures.main(told.cold)
    detection.main()
    print(f"\n{'us':28}{'ours':>10}{'theirs':>10}{'factor':>8}")
    for what, ours, who, theirs in peers(told.peer) if told.peer else ():
        print(f"{what:28}{1e6 * ours:10.2f}{1e6 * theirs:10.2f}{theirs / ours:8.1f}  {who}")


def bags():
    """Print bags beside rosbags and mcap, if these are installed."""
    try:
        import logs
    except ImportError as reason:
        print(f"a peer is left out: {reason}", file=sys.stderr)
    else:
        print()
        logs.main()


def print_rows(before, found):
    """Print the rows of schemes, calls and starts, before and now."""
    print(f"\n{'us (per run and step)':22}" + "".join(f"{size:>27}" for size in schemes.SIZES))
    print(f"{'':22}" + f"{'before':>10}{'now':>9}{'factor':>8}" * len(schemes.SIZES))
    for name, now in found.items():
        row = ""
        for size in now:
            old = before.get(name, {}).get(size, np.nan)
            row += f"{old:10.2f}{now[size]:9.2f}{old / now[size]:8.1f}"
        print(f"{name:22}{row}", flush=True)


if __name__ == "__main__":
    main()
