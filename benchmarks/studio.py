"""CPU of the studio for a change by hand, and the size of its messages (see README.md)."""

import sys
import time
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

import robsim as rs
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.session import Session
from robsim.studio.workbench import Workbench

REPEATS = 12
KINDS = {
    "gain": "task.gain",
    "goal": "task.goal.q",
    "focal": "belief.cameras.camera.focal",
    "noise": "sensing.noise",
}


def requests(bench: Workbench) -> Iterator[tuple[str, Any]]:
    """Yield a kind of change, and a function from a small number to its request."""
    controls = bench.controls
    paths = [(kind, path) for kind, path in KINDS.items() if path in controls]
    places = [p for p in controls if p.startswith("objects.") and p.endswith("position")]
    for kind, path in [*paths, *(("object", place) for place in places[:1])]:
        yield kind, partial(_set, path, controls[path].value)
    for handle in bench.handles[:1]:
        yield "drag", partial(_drag, handle.name, handle.pose)


def _set(path: str, value: Any, x: float) -> dict[str, Any]:
    return {"set": [path, _moved(value, x)]}


def _drag(name: str, pose: list[float], x: float) -> dict[str, Any]:
    return {"drag": [name, [pose[0] + x, *pose[1:]]]}


def _moved(value: Any, x: float) -> Any:
    return [value[0] + x, *value[1:]] if isinstance(value, list) else value + x


def measured(name: str) -> Iterator[tuple[str, float, int, list[str]]]:
    """Yield kind, seconds of CPU from message to answer, the largest answer, and refusals."""
    bench = Workbench(rs.load_scenario(rs.examples.path(name)))
    session = Session(bench, ScenarioShelf([]))
    news = lambda: list(session.outgoing.news(session, bench, session.shelf))  # noqa: E731
    news()
    for kind, request in requests(bench):
        seconds, largest, refusals = [], 0, []
        for k in range(REPEATS):
            bench.step()
            news()
            start = time.process_time()
            refusals += filter(None, [session.do(request(0.001 * (k + 1)))])
            messages = news()
            seconds.append(time.process_time() - start)
            largest = max([largest, *map(len, messages)])
        yield kind, float(np.median(seconds)), largest, refusals


def main() -> None:
    """Print the table."""
    print(f"{'':28}{'change':8}{'ms of CPU':>10}{'largest message':>17}")
    for name in sys.argv[1:] or rs.examples.names():
        if isinstance(rs.load_scenario(rs.examples.path(name)).task, SelfSimulatingTask):
            continue  # a mission is simulated as a whole
        for kind, seconds, largest, refusals in measured(name):
            print(f"{name:28}{kind:8}{1e3 * seconds:10.1f}{largest:17}  {refusals[:1] or ''}")


if __name__ == "__main__":
    main()
