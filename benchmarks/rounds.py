"""A step of every scheme beside another checkout: the median ratio of interleaved rounds.

    python benchmarks/rounds.py OTHER --rounds 10

Each round measures this checkout, the other one, and the other one again, each in a process of its
own, in CPU time of one thread. The ratio of the other checkout to itself is the noise of the
machine: a row is slower only if its ratio lies outside of that.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
CHILD = """
import json, sys, time, types
sys.path.insert(0, "benchmarks")
import schemes
schemes.time = types.SimpleNamespace(perf_counter=time.process_time)
only = json.loads(sys.argv[1])
found = schemes.measured(only)
json.dump(found, open(sys.argv[2], "w"))
"""


def measure(checkout, only, out):
    """Return microseconds per run and step of a checkout, {(row, size): number}."""
    environment = {**os.environ, "PYTHONPATH": str(checkout / "src")}
    call = [sys.executable, "-c", CHILD, json.dumps(only), str(out)]
    subprocess.run(call, cwd=checkout, env=environment, check=True, stdout=subprocess.DEVNULL)
    found = json.loads(out.read_text())
    return {(row, size): x for row, each in found.items() for size, x in each.items()}


def collect(other, rounds, only, out):
    """Return the ratios this / other and other again / other, {(row, size): numbers}."""
    ours, same = {}, {}
    for number in range(rounds):
        here, there, again = (measure(each, only, out) for each in (HERE.parent, other, other))
        for key in here.keys() & there.keys():
            ours.setdefault(key, []).append(here[key] / there[key])
            same.setdefault(key, []).append(again[key] / there[key])
        print(f"round {number + 1} of {rounds}", file=sys.stderr, flush=True)
    return ours, same


def main():
    """Print the median ratio of each row, and the range of the other checkout beside itself."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("other", type=Path, help="a checkout of another commit")
    parser.add_argument("--rounds", type=int, default=10)
    parser.add_argument("--only", nargs="*", help="names of rows; by default all")
    options = parser.parse_args()
    out = Path(os.environ.get("TMPDIR", "/tmp")) / f"robsim-rounds-{os.getpid()}.json"
    ours, same = collect(options.other.resolve(), options.rounds, options.only, out)
    out.unlink(missing_ok=True)
    print(f"{'row':26}{'runs':>8}{'ratio':>8}   the other beside itself: median, 10 %, 90 %")
    for key in sorted(ours):
        low, middle, high = np.quantile(same[key], [0.1, 0.5, 0.9])
        ratio = np.median(ours[key])
        mark = "  slower" if ratio > max(high, middle) else ""
        print(f"{key[0]:26}{key[1]:>8}{ratio:8.3f}{middle:10.3f}{low:8.3f}{high:8.3f}{mark}")
    every = [np.median(x) for x in ours.values()]
    print(f"median of all rows: {np.median(every):.3f}")


if __name__ == "__main__":
    main()
