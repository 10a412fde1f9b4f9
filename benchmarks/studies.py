"""The cost of a study: a million runs of mixed parameters, time and memory (see README.md)."""

import resource
import sys
import tempfile
import time

import numpy as np

import robsim as rs
from robsim.units import deg

STEPS = 200


def experiment():
    """A camera that flies to a square for 200 periods, whether it has converged or not."""
    one = rs.load_scenario(rs.examples.path("visp_tutorial"))
    return one.with_(duration=STEPS * one.dt, hold=True)


def mixed(one):
    """A start, three numbers and a choice that are drawn, and two schemes in turn."""
    eye, goal = one.scene.camera().name, one.task.goal
    return {
        "start": rs.starts.LookAt(distance=(0.5, 1.2), roll=(-90, 90) * deg),
        "vary": {
            "task": [rs.IBVS(goal), rs.IBVS(goal, interaction="desired")],
            "task.gain": rs.samplers.LogUniform(0.2, 4.0),
            "sensing.noise": rs.samplers.Uniform(0.0, 1.0),
            f"belief.cameras.{eye}.focal": rs.samplers.Product(rs.samplers.Normal(1.0, 0.05)),
            f"cameras.{eye}.center": rs.samplers.Sum(rs.samplers.Normal(0.0, [5.0, 5.0])),
        },
    }


def peak():
    """The largest memory of this process, in MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3


def main() -> None:
    """Print how long so many runs take, and how much memory, in memory and in a store."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    one = experiment()
    rs.study(one, 500, **mixed(one))  # compiles
    print(f"{runs} runs of {STEPS} steps; {peak():.0f} MB before")
    for store in (False, True):
        with tempfile.TemporaryDirectory() as folder:
            begin = time.perf_counter()
            told = {"store": folder} if store else {}
            found = rs.study(one, runs // 2, seed=1, **mixed(one), **told)
            seconds = time.perf_counter() - begin
            where = "store " if store else "memory"
            each = 1e6 * seconds / runs / STEPS
            print(f"{where} {seconds:7.1f} s  {runs / seconds:7.0f} runs/s  {each:.2f} us a step")
            print(f"       peak {peak():.0f} MB", found.hash)
            if not store:
                outcomes, counts = np.unique(found._facts[1]["outcome"], return_counts=True)
                print({rs.Outcome(o).name: int(n) for o, n in zip(outcomes, counts, strict=True)})


if __name__ == "__main__":
    main()
