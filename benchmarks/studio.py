"""CPU of the studio for a change by hand, and the size of its messages (see README.md)."""

import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import robsim as rs
from robsim.declare.controls import Control
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.session import Session
from robsim.studio.workbench import Workbench

REPEATS = 5
STEPS = 100  # of the run to which a change is compared
KINDS = {
    "task.gain": "gain",
    "task.goal.q": "goal",
    "belief.cameras.camera.focal": "focal",
    "sensing.noise": "noise",
}
LIMIT = 25.0  # ms of CPU
Request = Callable[[int], dict[str, Any]]


def requests(bench: Workbench) -> Iterator[tuple[str, str, Request]]:
    """Yield kind, name, and a function from a number to a request, of each control and handle."""
    bench.step()
    for path, control in bench.controls.items():
        is_place = path.startswith("objects.") and path.endswith("position")
        yield KINDS.get(path, "object" if is_place else "other"), path, partial(_set, control)
    for handle in bench.handles:
        yield "push" if handle.carried else "drag", handle.name, partial(_drag, bench, handle.name)


def _set(control: Control, k: int) -> dict[str, Any]:
    value: Any = control.value
    if control.form == "choice":
        value = control.options[k % len(control.options)]
    elif control.form == "flag":
        value = bool(k % 2) != value
    elif control.form == "whole":
        value += k % 2
    elif control.form == "number":
        value = _moved(value, control.low, control.high, k)
    else:
        ends = control.low or [None], control.high or [None]
        value = [_moved(value[0], ends[0][0], ends[1][0], k), *value[1:]]
    return {"set": [control.path, value]}


def _moved(value: float, low: float | None, high: float | None, k: int) -> float:
    """Return a number that differs a little from a value, within its bounds."""
    step = 1e-3 * (k % 4 + 1) * min(max(abs(value), 1.0), (high or 1.0) - (low or 0.0))
    return value + step if high is None or value + step <= high else value - step


def _drag(bench: Workbench, name: str, k: int) -> dict[str, Any]:
    pose = next(each.pose for each in bench.handles if each.name == name)
    return {"drag": [name, [pose[0] + 1e-3 * (-1) ** k, *pose[1:]]]}


class Desk:
    """A session of an experiment without pages."""

    def __init__(self, name: str) -> None:
        self.bench = Workbench(rs.load_scenario(rs.examples.path(name)))
        self.session = Session(self.bench, ScenarioShelf([]))
        self.news()

    def news(self) -> list[str]:
        """Return the new messages."""
        return list(self.session.outgoing.news(self.session, self.bench, self.session.shelf))

    def measured(self, request: Request) -> tuple[float, int, list[str]]:
        """Return least ms of CPU from message to answer, the largest answer, and refusals."""
        seconds, largest, refusals = [], 0, []
        for k in range(REPEATS):
            self.bench.step()
            self.news()
            message = request(k)
            start = time.process_time()
            refusals += filter(None, [self.session.do(message)])
            messages = self.news()
            seconds.append(time.process_time() - start)
            largest = max([largest, *map(len, messages)])
        return 1e3 * min(seconds), largest, refusals


def run_cost(name: str) -> float:
    """Return the least ms of CPU of a run of `STEPS` steps."""
    experiment = rs.load_scenario(rs.examples.path(name))
    seconds = []
    for _ in range(REPEATS):
        start = time.process_time()
        experiment.with_(duration=STEPS * experiment.dt, hold=True).run()["q"].values  # noqa: B018
        seconds.append(time.process_time() - start)
    return 1e3 * min(seconds)


def table(name: str) -> None:
    """Print a line for each kind of change of an experiment, and for its slowest change."""
    desk, unit = Desk(name), run_cost(name)
    rows: dict[str, list[tuple[float, int, str]]] = {}
    refused = 0
    for kind, path, request in list(requests(desk.bench)):
        ms, size, refusals = desk.measured(request)
        refused += len(refusals) == REPEATS
        if len(refusals) < REPEATS:
            rows.setdefault(kind, []).append((ms, size, path))
        desk.session.do({"original": True})
    every = [row for each in rows.values() for row in each]
    late = [f"{path} {ms:.1f}" for ms, _, path in sorted(every, reverse=True) if ms > LIMIT]
    kinds = "  ".join(f"{kind} {max(rows[kind])[0]:.1f}" for kind in rows)
    ms, _, path = max(every)
    size = max(size for _, size, _ in every)
    print(f"{name:26}{len(every):4}{refused:4}{unit:7.1f}{ms:7.1f}{ms / unit:6.1f}{size:7}  {path}")
    print(f"{'':6}{kinds}{'  LATE ' if late else ''}{'; '.join(late)}", flush=True)


def main() -> None:
    """Print the table."""
    print(f"{'':26}{'done':>4}{'not':>4}{'run':>7}{'most':>7}{'ratio':>6}{'size':>7}  (ms of CPU)")
    for name in sys.argv[1:] or rs.examples.names():
        if not isinstance(rs.load_scenario(rs.examples.path(name)).task, SelfSimulatingTask):
            table(name)  # a mission is simulated as a whole


if __name__ == "__main__":
    main()
