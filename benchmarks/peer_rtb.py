"""How long the Robotics Toolbox for Python takes for inverse kinematics, its compiled `ik_LM`.

Run it with a Python of its own that holds the peer: `pip install roboticstoolbox-python`. Found
working together under Python 3.11: roboticstoolbox-python 1.5.0, spatialmath-python 1.1.18, NumPy
2.4.6.

Its argument is a file that benchmarks/ik.py wrote: an arm's constants and limits, and poses. The
arm is one elementary transform for each constant and each joint, which is as short as it can be.
The settings are the peer's own (30 iterations, 100 searches, joint limits), but for the start,
which is home. It stops where half the squared error is below its tolerance: by default 1e-6, which
is an error of 1.4e-3 m and rad, and here also 5e-17, which is 1e-8. It is processor time that
counts. Prints one line of JSON.
"""

import json
import sys
import time
from importlib.metadata import version

import numpy as np
from roboticstoolbox import ET, ETS

REPEATS = 3


def arm(constants: np.ndarray, limits: np.ndarray) -> ETS:
    """T = C0 Rz(q1) C1 Rz(q2) ... Cn."""
    parts = [ET.SE3(constants[0])]
    for C, span in zip(constants[1:], limits, strict=True):
        parts += [ET.Rz(qlim=span), ET.SE3(C)]
    return ETS(parts)


def main() -> None:
    given = np.load(sys.argv[1])
    chain, poses, home = arm(given["constants"], given["limits"]), given["poses"], given["home"]
    there = np.asarray(chain.eval(home))
    if np.abs(there - given["at_home"]).max() > 1e-12:
        raise SystemExit("the two programs do not have the same arm")
    report = {"version": version("roboticstoolbox-python")}
    for name, tolerance in {"default": 1e-6, "same": 5e-17}.items():
        times = []
        for _ in range(REPEATS):
            start = time.process_time()
            found = [chain.ik_LM(T, q0=home, tol=tolerance) for T in poses]
            times.append(time.process_time() - start)
        solved = float(np.mean([bool(f.success) for f in found]))
        report[name] = {"seconds_per_solve": min(times) / len(poses), "solved": solved}
    print(json.dumps(report))


if __name__ == "__main__":
    main()
