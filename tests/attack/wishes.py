"""Odd requests of pages: a studio refuses them by a message, changes nothing, and continues."""

import json
import random
from functools import cache

import numpy as np
from attack.harness import Wrong

from robsim import examples, load_scenario
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.session import _REQUESTS, Session
from robsim.studio.workbench import Workbench

NAME = "wishes"
FILES = ("adaptive_gain", "calibration_errors", "eye_in_hand", "unicycle_docking", "visp_tutorial")
ODD = [
    *(None, True, False, 0, -1, 1, 0.0, -0.0, 1e-300, 1e300, -1e9, 2**63, 2**64, 10**30),
    *("", "x", "../../etc/passwd", "<script>", "\0", "nan", "inf", "1 m", "a" * 70_000, "\ud800"),
    *([], {}, [[]], [1, 2], [0.0] * 7, [1e9] * 7, ["a"] * 7, {"a": 1}, [None] * 7, ["task.gain"]),
]


@cache
def session(name):
    """A session without a thread: its requests are handled here, one by one."""
    return Session(Workbench(load_scenario(examples.path(name))), ScenarioShelf.shipped())


def case(seed):
    draw = random.Random(seed)
    here = session(draw.choice(FILES))
    bench = here.bench
    for _ in range(draw.randint(1, 4)):
        before = bench.edit, bench.pair, bench.builder
        note = here.do(wish_of(draw, bench))
        if "internal error" in note:
            raise Wrong(note)
        after = bench.edit, bench.pair, bench.builder
        if note and any(x is not y for x, y in zip(before, after, strict=True)):
            raise Wrong(f"it was refused, and something changed: {note[:200]}")
        for message in here.outgoing.news(here, bench, here.shelf):
            json.loads(message)
    if note := here.do({"reset": True}) or here.do({"step": True}):
        raise Wrong(f"it does not go on: {note[:300]}")
    if bench.pair is not None and not np.isfinite(bench.pair.live.now.q).all():
        raise Wrong("coordinates that are not finite")
    return True


def wish_of(draw, bench):
    """One request of a page, most often a wrong one."""
    name = draw.choice([*_REQUESTS, "set", "set", "drag", "second", "change", "quit"])
    if name in ("set", "second"):
        return {
            name: draw.choice([[path_of(draw, bench), value_of(draw, bench)], draw.choice(ODD)])
        }
    if name == "change":
        values = {
            str(path_of(draw, bench)): value_of(draw, bench) for _ in range(draw.randint(1, 3))
        }
        return {name: draw.choice([values, draw.choice(ODD)])}
    if name == "show_goal":
        return {name: draw.choice(["anew", "here", draw.choice(ODD)])}
    if name == "drag":
        handles = [each.name for each in bench.handles] or ["none"]
        pose = [draw.choice([0.0, 0.3, -1.0, 50.0]) for _ in range(3)]
        turn = draw.choice([[0.0, 0.0, 0.0, 1.0], [0.0] * 4, [9.0] * 4])
        return {name: draw.choice([[draw.choice(handles), [*pose, *turn]], draw.choice(ODD)])}
    return {name: draw.choice([True, False, 1.0, 0.0, draw.choice(ODD), "visp_tutorial"])}


def path_of(draw, bench):
    return draw.choice([draw.choice(list(bench.controls)), draw.choice(ODD), "task.gain.x"])


def value_of(draw, bench):
    control = draw.choice(list(bench.controls.values()))
    return draw.choice([control.value, draw.uniform(-3, 3), draw.randint(-3, 3), draw.choice(ODD)])
