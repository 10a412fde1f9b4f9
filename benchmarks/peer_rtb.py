"""How long the Robotics Toolbox for Python takes for inverse kinematics, its compiled `ik_LM`.

Run it with a Python of its own that holds the peer: `pip install roboticstoolbox-python`. Found
working together under Python 3.11: roboticstoolbox-python 1.5.0, spatialmath-python 1.1.18, NumPy
2.4.6.

Its argument is a file that benchmarks/ik.py wrote: an arm's constants and limits, and poses. The
arm is one elementary transform for each constant and each joint, which is as short as it can be.
The settings are the peer's own (30 iterations, 100 searches, 0.5 |e|^2 below 1e-6, joint limits),
but for the start, which is home. It is processor time that counts. Prints one line of JSON.
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
    for T in poses[:100]:
        chain.ik_LM(T, q0=home)
    times = []
    for _ in range(REPEATS):
        start = time.process_time()
        found = [chain.ik_LM(T, q0=home) for T in poses]
        times.append(time.process_time() - start)
    report = {
        "version": version("roboticstoolbox-python"),
        "seconds_per_solve": min(times) / len(poses),
        "solved": float(np.mean([bool(f.success) for f in found])),
    }
    print(json.dumps(report))


if __name__ == "__main__":
    main()
