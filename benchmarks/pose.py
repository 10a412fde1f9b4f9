"""The cost of a pose without a guess in a batch of a thousand, beside OpenCV's solvers.

    python benchmarks/pose.py --peer /path/to/python-with-opencv

Both sides see the views of tests/oracles/_pnp_cases.py, with one pixel of noise. OpenCV has no
batches: it is called once for each view. Ours finds more than one minimum, and the covariance.
"""

import argparse
import json
import runpy
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

CASES = Path(__file__).parents[1] / "tests/oracles/_pnp_cases.py"
SIZES = (4, 8, 12)
VIEWS, REPEATS = 1000, 5


def views(kind, marks):
    """One target of so many marks in a thousand views."""
    cases = runpy.run_path(str(CASES), {"__name__": "cases"})
    make = cases["targets"].__globals__
    make["TARGETS"], make["VIEWS"] = marks - 3, VIEWS
    *_, (p, _, _, pixels) = cases["targets"](kind, 1.0)
    return cases["K"], p, pixels


def best(call):
    """Microseconds for each view; the best of several repeats, and the first one does not count."""
    times = []
    for _ in range(REPEATS + 1):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return 1e6 * min(times[1:]) / VIEWS


def ours(kind, marks):
    """One call for all views."""
    import robsim as rs

    K, p, pixels = views(kind, marks)
    return best(lambda: rs.vision.estimate_pose(p, pixels, rs.Camera(K)))


def theirs(kind, marks, refine):
    """A call for each view; `refine` adds the Levenberg-Marquardt steps that ours has too."""
    import cv2

    K, p, pixels = views(kind, marks)
    method = cv2.SOLVEPNP_IPPE if kind == "planar" else cv2.SOLVEPNP_SQPNP

    def solve():
        for view in pixels:
            found, turn, t = cv2.solvePnP(p, view, K, None, flags=method)
            if refine and found:
                cv2.solvePnPRefineLM(p, view, K, None, turn, t)

    cv2.setNumThreads(1)
    return best(solve)


def main():
    """Print a table, with ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peer", help="a Python that has OpenCV")
    parser.add_argument("--answer", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    rows = [(kind, marks) for kind in ("planar", "spatial") for marks in SIZES]
    if asked.answer:
        print(json.dumps([[theirs(*row, refine) for refine in (False, True)] for row in rows]))
        return
    peer = [[np.nan] * 2] * len(rows)
    if asked.peer:
        command = [asked.peer, __file__, "--answer"]
        peer = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
    print(f"{'us per pose':20}{'ours':>8}{'OpenCV':>8}{'ratio':>7}{'refined':>9}{'ratio':>7}")
    for row, (plain, refined) in zip(rows, peer, strict=True):
        mine = ours(*row)
        times = f"{mine:8.1f}{plain:8.1f}{mine / plain:7.2f}{refined:9.1f}{mine / refined:7.2f}"
        print(f"{row[0]}, {row[1]} marks".ljust(20) + times)


if __name__ == "__main__":
    sys.exit(main())
