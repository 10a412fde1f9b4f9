"""What a step costs under each scheme and imperfection, beside the compiled loop of IBVS.

The compiled loop runs points and pixels with the built-in laws; everything else, and anybody's own
features and laws, takes the step-by-step loop.
"""

import time

import numpy as np

import robsim as rs

ARM = rs.load_scenario(rs.examples.path("eye_to_hand")).scene  # six joints
SCHEMES = {
    "IBVS, compiled loop": rs.IBVS(),
    "IBVS, step by step": rs.IBVS(gain=rs.AdaptiveGain(1.001, 1.0, 1.0)),
    "IBVS, DepthFilter": rs.IBVS(depth=rs.DepthFilter(0.5)),
    "IBVS, Broyden": rs.IBVS(interaction="broyden"),
    "IBVS, region moments": rs.IBVS(features="region_moments"),
    "PBVS": rs.PBVS(),
    "Hybrid": rs.Hybrid(),
    "Partitioned": rs.Partitioned(advance=0.5),
    "PBVS, secondary motion": rs.PBVS(secondary=rs.AvoidLimits()),
    "Priorities of two": rs.Priorities(
        [rs.IBVS(features=rs.FeatureBlock("points", marks=[0])), rs.PBVS()]
    ),
}
LATE = rs.Sensing(0.5, 0.25, 0.02, 5.0, [rs.Occlusion([1], 1.0, 2.0)], 0.1, 0.06, 0.08)
LAZY = rs.Actuation(lag=0.05, velocity=2.0, acceleration=20.0, encoder=1e-4)
IMPERFECT = {
    "IBVS, pixel noise": {"sensing": rs.Sensing(noise=0.5)},
    "IBVS, late images": {"sensing": rs.Sensing(latency=0.06)},
    "IBVS, joints that lag": {"actuation": rs.Actuation(lag=0.05)},
    "IBVS, everything wrong": {"sensing": LATE, "actuation": LAZY},
}


def microseconds(task, runs, steps, **imperfect):
    """Per run and step; the best of three, one thread, every run to the end of the time."""
    starts = ARM.home + np.random.default_rng(0).uniform(-0.02, 0.02, (runs, ARM.nq))
    kinds = {"duration": steps * 0.04, "hold": True, "record": "summary", "threads": 1}
    times = []
    for _ in range(4):  # the first compiles
        begin = time.perf_counter()
        rs.simulate(ARM, task, starts, **kinds, **imperfect)
        times.append(time.perf_counter() - begin)
    return 1e6 * min(times[1:]) / runs / steps


def main():
    """Print a table, with ratios to the compiled loop in the same run."""
    base = [microseconds(SCHEMES["IBVS, compiled loop"], *size) for size in ((1, 2000), (256, 200))]
    print(f"{'us per run and step':28}{'single':>8}{'ratio':>7}{'256 runs':>10}{'ratio':>7}")
    cases = {name: (task, {}) for name, task in SCHEMES.items()}
    cases |= {name: (rs.IBVS(), imperfect) for name, imperfect in IMPERFECT.items()}
    for name, (task, imperfect) in cases.items():
        one, many = (microseconds(task, *size, **imperfect) for size in ((1, 2000), (256, 200)))
        print(f"{name:28}{one:8.1f}{one / base[0]:7.1f}{many:10.2f}{many / base[1]:7.1f}")


if __name__ == "__main__":
    import warnings

    warnings.simplefilter("ignore", rs.RankWarning)
    main()
