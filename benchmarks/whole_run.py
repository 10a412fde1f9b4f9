"""The cost of a whole `simulate` besides its steps, from runs of 1 and of 250 (see README.md)."""

import time
from collections.abc import Callable
from itertools import count

import numpy as np
import numpy_baseline as baseline
from speed import DT, best, scene

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


def short_run(read: Callable[[rs.Experiment, int], object]) -> float:
    """Milliseconds of a run of 250 steps, which `read` simulates and reads for the n-th time."""
    q0, points, _ = baseline.scene(1, 0)
    task = rs.IBVS(**SETTINGS)
    experiment = rs.Experiment(scene(points), task, q0[0], dt=DT, duration=DT * STEPS)
    numbers = count()
    return 1e3 * best(lambda: read(experiment, next(numbers)), REPEATS[STEPS])


def outcome_read() -> float:
    """Milliseconds of a run of 250 steps whose outcome is read."""
    return short_run(lambda experiment, n: int(experiment.run().outcome))


def every_variable_read() -> float:
    """Milliseconds of a run of 250 steps whose variables are all read."""
    return short_run(lambda experiment, n: experiment.run().load())


def new_task() -> float:
    """Milliseconds of a run of 250 steps with a new task."""
    return short_run(
        lambda experiment, n: int(experiment.with_(task=rs.IBVS(**SETTINGS)).run().outcome)
    )


def changed_gain() -> float:
    """Milliseconds of `at("task.gain", value).run()` with 250 steps."""
    return short_run(
        lambda experiment, n: int(experiment.at("task.gain", 0.05 + 1e-6 * n).run().outcome)
    )


def thread_pool(threads: int | None = None) -> float:
    """Milliseconds that a run of 20,010 steps takes more than one of 19,990, in this thread."""
    q0, points, _ = baseline.scene(1, 0)
    where, task = scene(points), rs.IBVS(**SETTINGS)
    below, above = (
        best(
            lambda steps=steps: rs.simulate(
                where, task, q0[0], dt=DT, duration=DT * steps, record="summary", threads=threads
            ),
            10,
        )
        for steps in (19_990, 20_010)
    )
    return 1e3 * (above - below)


def idle_arms(arms: int) -> float:
    """Nanoseconds per run and step of a batch beside so many arms that do not move."""
    q0, points, _ = baseline.scene(2000, 0)
    where = scene(points)
    idle = [
        rs.Robot.from_dh(baseline.PUMA560, name=f"idle{i}").at(rs.Pose.at(3.0 * i + 3.0, 0, 0))
        for i in range(arms)
    ]
    where = rs.Scene([*where.robots, *idle], where.objects, where.cameras)
    still = np.zeros(6 * arms)
    task = rs.IBVS(goal=np.concatenate([baseline.Q_GOAL, still]), gain=1.0, tolerance=1e-300)
    starts = np.column_stack([q0, np.tile(still, (len(q0), 1))])
    few, many = (
        best(
            lambda steps=steps: rs.simulate(
                where, task, starts, dt=DT, duration=DT * steps, record="summary", threads=1
            )
        )
        for steps in (5, 55)
    )
    return 1e9 * (many - few) / 50 / len(q0)


def record_of_batch(read: Callable[[object], object]) -> tuple[float, float]:
    """A batch with `record="all"` that is read, relative to a summary, and its MB per second."""
    q0, points, _ = baseline.scene(4000, 0)
    where, task = scene(points), rs.IBVS(goal=baseline.Q_GOAL, gain=1.0, tolerance=1e-300)
    settings = {"dt": DT, "duration": 4.0, "threads": 1}
    summary = best(
        lambda: int(rs.simulate(where, task, q0, record="summary", **settings).outcome[0])
    )
    whole = best(lambda: read(rs.simulate(where, task, q0, record="all", **settings)))
    size = rs.simulate(where, task, q0, record="all", **settings).nbytes
    return whole / summary, 1e-6 * size / (whole - summary)


def rows() -> None:
    """Print the numbers of short runs, idle arms and records."""
    for row in (outcome_read, every_variable_read, new_task, changed_gain, thread_pool):
        print(f"{row.__name__:28} {row():8.3f} ms")
    for arms in (0, 7):
        print(f"{f'{arms} idle arms':28} {idle_arms(arms):8.0f} ns per run and step")
    for name, read in (
        ("outcome", lambda run: run.outcome.values),
        ("all", lambda run: run.load()),
    ):
        ratio, speed = record_of_batch(read)
        print(f"{f'record of a batch, {name} read':28} {ratio:8.2f} summaries {speed:8.0f} MB/s")


def main() -> None:
    """Print the table."""
    points, poses = rs.IBVS(**SETTINGS), rs.PBVS(**SETTINGS)
    nothing, outcome = (lambda run: None), (lambda run: int(run.outcome))
    line("a task again", lambda: points, nothing)
    line("a new task", lambda: rs.IBVS(**SETTINGS), nothing)
    line("the outcome read", lambda: points, outcome)
    line("the text read, too", lambda: points, lambda run: (outcome(run), run.attrs))
    line("PBVS, a task again", lambda: poses, nothing)
    rows()


if __name__ == "__main__":
    main()
