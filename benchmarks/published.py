"""All starts of ViT-500 with detectors in pictures, beside the published shares (see README.md).

    python benchmarks/published.py                      # exact marks and dots, all 1,000 runs
    python benchmarks/published.py --keypoints --every 10   # keypoints, of every tenth start

Prints the table of docs/bench/vit_500_images.md, and the time of each scheme.
"""

import argparse
import time
from dataclasses import replace

import numpy as np

import robsim as rs
from robsim.suites.published import vit_500_images

PUBLISHED = "published, SIFT: plain 89.6 %, perturbed 58.4 %"


def take_every(suite, step):
    """Return a suite with every start whose number is a multiple of `step`."""
    runs = np.arange(suite.runs)[np.asarray(suite.draws) % step == 0]
    return replace(
        suite,
        starts=suite.starts[runs],
        draws=suite.draws[runs],
        varied={name: values[runs] for name, values in suite.varied.items()},
        groups={name: [labels[i] for i in runs] for name, labels in suite.groups.items()},
    )


def main():
    """Print the table of success and the time of each scheme."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--keypoints", action="store_true", help="only the scheme with keypoints")
    parser.add_argument("--every", type=int, default=1, help="take every so many starts")
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    suite = take_every(vit_500_images.suite(), options.every)
    for name, task in suite.schemes.items():
        if ("keypoints" in name) != options.keypoints:
            continue
        began, cpu = time.perf_counter(), time.process_time()
        found = rs.bench(replace(suite, schemes={name: task}), threads=options.threads)
        cpu, wall = time.process_time() - cpu, time.perf_counter() - began
        steps = found.data["time"].sum() / suite.dt
        print(found)
        print(found.data.groupby("picture")["outcome"].value_counts().to_string())
        rate = f", {1e3 * cpu / steps:.2f} ms a step" if steps else ""
        print(f"{name}: {wall:.0f} s, {cpu:.0f} s of CPU{rate}; {PUBLISHED}\n", flush=True)


if __name__ == "__main__":
    main()
