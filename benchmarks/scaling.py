"""How the time per run and step changes with the size of the problem: a figure, scaling.png."""

import time
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from schemes import arm_with_a_camera, snake

import robsim as rs

HERE = Path(__file__).parent
K = np.array([[800, 0, 320], [0, 800, 240], [0, 0, 1.0]])


def flying(marks):
    """A free camera before so many marks in a plane."""
    side = np.linspace(-0.1, 0.1, round(marks**0.5))
    grid = np.array([[x, y, 0.0] for x in side for y in side])
    eye = rs.MountedCamera("eye", rs.Camera(K, size=(640, 480)), on="free_camera.body")
    plate = rs.Object("plate", marks=grid, pose=rs.Pose.at(0, 0, 0.6))
    return rs.Scene([rs.robots.free_camera()], [plate], [eye])


def microseconds(scene, runs, threads=1, task=None):
    """Per run and step, the better of two."""
    steps = max(25, min(2000, 2_000_000 // runs))
    starts = np.repeat(scene.home[None], runs, axis=0)
    settings = {"duration": steps * 0.04, "hold": True, "record": "summary"}
    times = []
    for _ in range(3):
        loop = rs.Experiment(scene, task or rs.IBVS(), starts, **settings)
        begin = time.perf_counter()
        loop.run(threads=threads)
        times.append(time.perf_counter() - begin)
    return 1e6 * min(times[1:]) / runs / (steps + 1)


def short(n):
    """A number as a label."""
    return f"{n / 1e6:g}M" if n >= 1e6 else f"{n / 1000:.0f}k" if n >= 1000 else str(n)


def main():
    """Measure, print, and draw."""
    warnings.simplefilter("ignore")
    runs = [1, 8, 64, 256, 4096, 32768, 262144, 1_000_000]
    puma, free = arm_with_a_camera("puma560"), flying(4)
    panels = {
        "runs": (runs, {"Puma 560": lambda n: microseconds(puma, n),
                        "Puma 560, two threads": lambda n: microseconds(puma, n, 2),
                        "free camera": lambda n: microseconds(free, n)}),
        "points": ([4, 16, 64, 256], {"free camera": lambda n: microseconds(flying(n), 1024)}),
        "joints": ([2, 4, 6, 7, 12, 20, 30], {
            "chain": lambda n: microseconds(arm_with_a_camera(snake(n)), 1024)}),
    }  # fmt: skip
    figure, axes = plt.subplots(1, 3, figsize=(10.5, 3.4), constrained_layout=True)
    for axis, (what, (sizes, lines)) in zip(axes, panels.items(), strict=True):
        for name, measure in lines.items():
            found = [measure(n) for n in sizes]
            print(
                f"{name:24}{what:8}", *(f"{n}: {t:.3f}" for n, t in zip(sizes, found, strict=True))
            )
            axis.loglog(sizes, found, marker="o", markersize=4, label=name)
        axis.set_xticks(sizes, [short(n) for n in sizes], fontsize=8)
        low, high = axis.get_ylim()
        ticks = [t for t in (0.1, 0.2, 0.5, 1, 2, 5, 10) if low <= t <= high]
        axis.set_yticks(ticks, [f"{t:g}" for t in ticks])
        axis.minorticks_off()
        axis.set_xlabel(what)
        axis.grid(alpha=0.3)
        axis.legend(frameon=False)
    axes[0].set_ylabel("us per run and step")
    figure.savefig(HERE / "scaling.png", dpi=110)


if __name__ == "__main__":
    main()
