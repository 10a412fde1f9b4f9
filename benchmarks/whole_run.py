"""The cost of a whole `simulate` besides its steps, from runs of 1 and of 250 (see README.md)."""

import time
from collections.abc import Callable

import numpy_baseline as baseline
from speed import DT, scene

import robsim as rs

STEPS = 250
REPEATS = {1: 500, STEPS: 60}
SETTINGS = {"goal": baseline.Q_GOAL, "gain": 0.05, "tolerance": 1e-300}

Task = Callable[[], rs.IBVS | rs.PBVS]


def measured(task: Task, read: Callable[[object], object], steps: int) -> float:
    """Least seconds of several runs of so many steps, with the quantities read from them."""
    q0, points, _ = baseline.scene(1, 0)
    where, times = scene(points), []
    for _ in range(REPEATS[steps]):
        one = task()
        start = time.perf_counter()
        read(rs.simulate(where, one, q0[0], dt=DT, duration=DT * steps))
        times.append(time.perf_counter() - start)
    return min(times)


def line(name: str, task: Task, read: Callable[[object], object]) -> None:
    """Print the fixed cost, the time of a step, and how many steps the fixed cost is worth."""
    one, many = (measured(task, read, steps) for steps in (1, STEPS))
    step = (many - one) / (STEPS - 1)
    fixed = one - step
    print(
        f"{name:28} {1e3 * fixed:8.3f} ms {1e6 * step:9.1f} us per step {fixed / step:9.0f} steps"
    )


def main() -> None:
    """Print the table."""
    points, poses = rs.IBVS(**SETTINGS), rs.PBVS(**SETTINGS)
    nothing, outcome = (lambda run: None), (lambda run: int(run.outcome))
    line("a task again", lambda: points, nothing)
    line("a new task", lambda: rs.IBVS(**SETTINGS), nothing)
    line("the outcome read", lambda: points, outcome)
    line("the text read, too", lambda: points, lambda run: (outcome(run), run.attrs))
    line("PBVS, a task again", lambda: poses, nothing)


if __name__ == "__main__":
    main()
