"""The cost of a step of `rs.Controller`, and whether it keeps pace at 1 kHz (see README.md)."""

import time
from collections.abc import Callable

import numpy as np
import numpy_baseline as baseline
from speed import DT, scene

import robsim as rs

STEPS, SECONDS = 20_000, 5.0
SHARES = (50, 90, 99, 99.9, 100)
SAFETY = rs.Safety(
    speed=1.0, acceleration=5.0, margin=0.02, ramp=0.2, watchdog=rs.control.Watchdog(0.2)
)


def measured(step: Callable[[int], object]) -> np.ndarray:
    """Seconds of each of many calls."""
    times = np.empty(STEPS)
    for i in range(STEPS):
        begin = time.perf_counter()
        step(i)
        times[i] = time.perf_counter() - begin
    return times


def line(name: str, seconds: np.ndarray) -> None:
    """Print the percentiles of some times in microseconds."""
    numbers = "".join(f"{x:9.1f}" for x in 1e6 * np.percentile(seconds, SHARES))
    print(f"{name:34}{numbers}")


def by_hand(q: np.ndarray, points: np.ndarray) -> Callable[[int], object]:
    """The bare law in plain NumPy, from pixels that are normalised already."""
    goal = baseline.features(baseline.Q_GOAL[None], points)

    def step(i: int) -> object:
        T = baseline.frames(q)
        x, y, Z = baseline.project(T, points)
        A = baseline.interaction_matrix(x, y, Z) @ baseline.camera_jacobian(T)
        return -baseline.pseudo_inverse(A, baseline.stack(x, y) - goal)

    return step


def late(controller: rs.Controller, pixels: np.ndarray, q: np.ndarray) -> np.ndarray:
    """How late each command is ready in a loop at 1 kHz, with an image at 30 Hz."""
    found = []
    start = time.perf_counter()
    for i in range(int(SECONDS * 1000)):
        due = start + i * 1e-3
        while time.perf_counter() < due:
            pass
        controller.step(pixels if i % 33 == 0 else None, q, i * 1e-3)
        found.append(time.perf_counter() - due)
    return np.array(found)


def main() -> None:
    """Print the percentiles: of a step, of the same law in NumPy, and of a loop at 1 kHz."""
    q0, points, _ = baseline.scene(1, 0)
    task = rs.IBVS(goal=baseline.Q_GOAL, gain=0.05)
    experiment = rs.Experiment(scene(points), task, q0[0], dt=DT)
    view = experiment.scene.view(q0[0]).pixels
    print(f"{'microseconds':34}" + "".join(f"{share:>8}%" for share in SHARES))
    for name, safety in (("a step", None), ("with a Safety", SAFETY)):
        controller = rs.Controller(experiment.with_(safety=safety))
        line(name, measured(lambda i, c=controller: c.step(view, q0[0], i * DT)))
    ours = rs.Controller(experiment)
    each = measured(lambda i: ours.step({"square": view}, q0[0], i * DT))
    line("marks by name", each)
    theirs = measured(by_hand(q0, points))
    line("the bare law in NumPy", theirs)
    print(f"NumPy takes {np.median(theirs) / np.median(each):.1f} times as long")
    fast = rs.Controller(experiment.with_(dt=1e-3, safety=SAFETY))
    line("ready after, at 1 kHz", late(fast, view, q0[0]))


if __name__ == "__main__":
    main()
