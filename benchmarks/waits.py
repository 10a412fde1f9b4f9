"""What a person waits for beside the loop: short runs, figures, pages and files (see README.md).

A row has a name, a unit, the aim, and a function that measures it. Times are CPU times of all
threads, the least of several calls.
"""

import json
import tempfile
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import film
import numpy as np
import numpy_baseline as baseline
import schemes
from ik import busy
from speed import DT, scene

import robsim as rs

STEPS = 250
INSTANTS = 10_001
LAW = {"goal": baseline.Q_GOAL, "gain": 0.05, "tolerance": 1e-300}
RATES = ("MB/s",)  # units of rows in which more is better


@dataclass(frozen=True)
class Row:
    """A measured quantity and its aim."""

    unit: str
    aim: float | None
    measure: Callable[[], float]

    def improvement(self, before: float, now: float) -> float:
        """Return how many times better a value is."""
        return now / before if self.unit in RATES else before / now


def least(call: Callable[[], object], repeats: int = 20) -> float:
    """Least seconds of CPU of some calls, after one that compiles."""
    call()
    return busy(call, repeats)


def read_outcome(run: Any) -> int:
    """Read the outcome of a run."""
    return int(run.outcome)


def read_all(run: Any) -> list[Any]:
    """Read every variable of a run."""
    return [each.values for each in run.variables.values()]


def short_run(new_task: bool = False, read: Callable[[Any], object] = read_outcome) -> float:
    """A run of 250 steps that is read, in ms."""
    q0, points, _ = baseline.scene(1, 0)
    where, task = scene(points), rs.IBVS(**LAW)

    def call() -> object:
        one = rs.IBVS(**LAW) if new_task else task
        return read(rs.simulate(where, one, q0[0], dt=DT, duration=DT * STEPS))

    return 1e3 * least(call, 60)


def changed_run() -> float:
    """`experiment.at("task.gain", value).run()` of 250 steps with a new value each time, in ms."""
    q0, points, _ = baseline.scene(1, 0)
    experiment = rs.Experiment(
        scene(points), rs.IBVS(**LAW), q0[0], dt=DT, duration=DT * STEPS, hold=True
    )
    gains = iter(np.linspace(0.04, 0.06, 100))
    return 1e3 * least(lambda: int(experiment.at("task.gain", next(gains)).run().outcome), 60)


def larger_run() -> float:
    """A run of 2,010 steps beside a run of 1,990, in ms: 0 but for what a size limit adds."""
    q0, points, _ = baseline.scene(1, 0)
    where, task = scene(points), rs.IBVS(**LAW)

    def seconds(steps: int) -> float:
        told = {"dt": DT, "duration": DT * steps, "record": "summary", "threads": 1}
        return least(lambda: rs.simulate(where, task, q0[0], **told), 40)

    return 1e3 * (seconds(2010) - seconds(1990))


def batch_step(robot: str) -> float:
    """A run and step of 1,024 runs of 250 steps, in ns."""
    return 1e3 * schemes.microseconds(schemes.arm_with_a_camera(robot), rs.IBVS(), 1024, 250)


def idle_robots() -> float:
    """A run and step of a Puma 560 beside seven Pumas at rest, in ns."""
    one = schemes.arm_with_a_camera("puma560")
    arm = rs.robots.load("puma560")
    others = [rs.Robot(f"idle{i}", arm.links) for i in range(7)]
    cell = rs.Scene([*one.robots, *others], one.objects, one.cameras)
    return 1e3 * schemes.microseconds(cell, rs.IBVS(), 1024, 100)


def whole_record() -> float:
    """A batch of 256 runs of 250 steps with all instants, beside one with a summary: a ratio."""
    found = schemes.arm_with_a_camera("puma560")
    starts = found.home + np.random.default_rng(0).uniform(-0.02, 0.02, (256, 6))

    def seconds(record: str) -> float:
        experiment = rs.Experiment(
            found, rs.IBVS(), starts, duration=10.0, hold=True, record=record
        )
        return least(lambda: experiment.run(threads=1).outcome.values, 10)

    return seconds("all") / seconds("summary")


@cache
def long_run() -> object:
    """A run of 10,001 instants."""
    example = rs.load_scenario(rs.examples.path("eye_in_hand"))
    return example.with_(dt=0.004, duration=0.004 * (INSTANTS - 1), hold=True).run()


def explained() -> float:
    """`explain` of 10,001 instants, in s."""
    return least(lambda: rs.explain(long_run()), 3)


def exported() -> float:
    """`export_html` of 10,001 instants, in s."""
    with tempfile.TemporaryDirectory() as folder:
        return least(lambda: rs.export_html(long_run(), Path(folder) / "run.html"), 3)


def stored() -> float:
    """`save_run` of 10,001 instants, in MB/s."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.nc"
        seconds = least(lambda: rs.save_run(long_run(), path), 5)
        return path.stat().st_size / 1e6 / seconds


def film_frame() -> float:
    """A frame of 1280 x 720 pixels of a film of `eye_in_hand`, drawn and encoded, in ms."""
    run = rs.load_scenario(rs.examples.path("eye_in_hand")).run()
    with tempfile.TemporaryDirectory() as folder:
        return 1e3 * min(film.time_frames(run, Path(folder) / "run.gif") for _ in range(3))


ROWS = {
    "250 steps, outcome read": Row("ms", 0.6, short_run),
    "and a new task": Row("ms", 1.2, partial(short_run, new_task=True)),
    "250 steps, every variable read": Row("ms", None, partial(short_run, read=read_all)),
    "at(...).run() of 250 steps": Row("ms", 1.0, changed_run),
    "2,010 steps beside 1,990": Row("ms", 0.0, larger_run),
    "batch, free camera": Row("ns", 68, partial(batch_step, "free_camera")),
    "batch, Puma 560": Row("ns", 75, partial(batch_step, "puma560")),
    "beside seven idle robots": Row("ns", None, idle_robots),
    "all instants to a summary": Row("ratio", None, whole_record),
    "explain, 10,001 instants": Row("s", 0.3, explained),
    "export_html, 10,001 instants": Row("s", 0.8, exported),
    "film, frame of 1280 x 720": Row("ms", 30, film_frame),
    "save_run": Row("MB/s", 150, stored),
}


def measured() -> dict[str, dict[str, float]]:
    """The number of each row, {name: {"value": number}}; NaN where this version cannot do it."""
    warnings.simplefilter("ignore")
    return {name: {"value": row.measure()} for name, row in ROWS.items()}


def main(before: dict[str, dict[str, float]], found: dict[str, dict[str, float]]) -> None:
    """Print the table: before, now, how many times better, and the aim."""
    print(f"\n{'':30}{'before':>10}{'now':>10}{'factor':>8}{'aim':>8}")
    for name, row in ROWS.items():
        old, now = before.get(name, {}).get("value", np.nan), found[name]["value"]
        aim = "" if row.aim is None else f"{row.aim:g}"
        better = row.improvement(old, now) if now else np.nan
        print(f"{name:30}{old:10.3g}{now:10.3g}{better:8.1f}{aim:>8}  {row.unit}", flush=True)


if __name__ == "__main__":
    main(json.loads(schemes.BEFORE.read_text(encoding="utf-8")), measured())
