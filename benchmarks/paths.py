"""The cost of `experiment.at(path, value)` for every declared number of some shipped experiments.

    python benchmarks/paths.py [EXPERIMENT ...]

CPU time, the mean of a hundred changes with the first one included, and the best of three such.
"""

import sys
import time

import numpy as np

import robsim as rs

NAMES = "visp_tutorial", "eye_in_hand", "wrong_calibration", "wrong_dh"
CHANGES = 1.001, 0.999  # factors; the first that is valid


def seconds(change):
    """The mean of a hundred calls."""
    means = []
    for _ in range(3):
        begun = time.process_time()
        for _ in range(100):
            change()
        means.append((time.process_time() - begun) / 100)
    return min(means)


def measured(experiment):
    """Seconds of a change of each number, {path: seconds}."""
    found = {}
    for control in experiment.controls():
        if control.form not in ("number", "numbers"):
            continue
        for factor in CHANGES:
            value = (factor * np.asarray(control.value) + 1e-6).tolist()
            try:
                experiment.at(control.path, value)
            except rs.RobSimError:
                continue
            found[control.path] = seconds(lambda p=control.path, v=value: experiment.at(p, v))
            break
    return found


def main():
    """Print a line for each experiment: how many numbers, the median, and the slowest."""
    print(f"{'experiment':22}{'numbers':>8}{'median, us':>12}{'most, us':>10}  slowest")
    for name in sys.argv[1:] or NAMES:
        found = measured(rs.load_scenario(rs.examples.path(name)))
        slowest = max(found, key=found.get)
        middle, most = 1e6 * np.median(list(found.values())), 1e6 * found[slowest]
        print(f"{name:22}{len(found):8}{middle:12.0f}{most:10.0f}  {slowest}", flush=True)


if __name__ == "__main__":
    main()
