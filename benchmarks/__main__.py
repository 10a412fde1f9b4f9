"""All in one table, before and after: `python -m benchmarks` from the root of the repository.

The rows before are in before.json, measured by the same functions on the same machine. Peers are
measured by speed.py and kinematics.py, which need them installed.
"""

import json
import os
import sys
import warnings
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))  # the scripts of this folder know each other by name

import schemes  # noqa: E402
import startup  # noqa: E402
from kinematics import least  # noqa: E402

import robsim as rs  # noqa: E402


def calls():
    """Microseconds of single calls of a Puma 560, and of a whole simulation of one step."""
    robot = rs.robots.puma560()
    q = robot.home + 0.1
    T = robot.fk(q)
    scene, task = schemes.arm_with_a_camera("puma560"), rs.IBVS()
    found = {
        "fk": lambda: robot.fk(q),
        "jacobian": lambda: robot.jacobian(q),
        "ik near home": lambda: robot.ik(T),
        "closed_ik": lambda: robot.closed_ik(T),
        "simulate, one step": lambda: rs.simulate(scene, task, duration=0.04),
    }
    return {name: {"single": 1e6 * least(call)} for name, call in found.items()}


def starts():
    """Seconds of CPU of commands whose kernels are there."""
    took = startup.measured(startup.HELP, dict(os.environ))[1]
    return {"robsim --help, s": {"single": took}}


def main():
    """Print the table."""
    warnings.simplefilter("ignore")
    before = json.loads(schemes.BEFORE.read_text(encoding="utf-8"))
    found = schemes.measured() | calls() | starts()
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
