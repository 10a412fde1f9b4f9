"""What users do, each thing once: the one list by which kernels are compiled in advance.

Nothing here names a kernel: what the shipped scenarios, the examples in docstrings and each
feature and scheme need is found by running them.
"""

from __future__ import annotations

import doctest
import pkgutil
from contextlib import suppress
from importlib import import_module

import robsim
from robsim.base.errors import InputError

SCENARIO = "eye_in_hand"  # on which features, schemes and imperfections are tried
RUNS, STEPS = 9, 120  # of a batch that fills one register of eight runs, and begins another
CHANGES = (
    *(f"task.kind={kind}" for kind in ("pbvs", "hybrid", "partitioned")),
    *(f"task.inverse={inverse}" for inverse in ("damped", "transpose")),
    *(f"task.interaction={matrix}" for matrix in ("mean", "desired", "broyden")),
    'task.weighting=["tukey"]',
)
EFFECTS = {"image effect": "sensing.effects", "joint effect": "actuation.effects"}

WorkloadItem = tuple[str, str]  # what is done, and with what


def list_workload() -> list[WorkloadItem]:
    """Return all that is to be done once; each of them is for `run_workload_item`.

    >>> ("example", "car") in list_workload() and ("change", "task.features=sphere") in list_workload()
    True
    """
    from robsim.declare import families, fields_of

    modules = pkgutil.walk_packages(robsim.__path__, "robsim.")
    features = (f"task.features={name}" for name in families()["feature"].names)
    laws = (f"task.law={name}" for name in families()["law"].names)
    effects = (
        f'{where}=["{name}"]'
        for noun, where in EFFECTS.items()
        for name, kind in families()[noun].kinds.items()
        if not any(each.required for each in fields_of(kind))
    )
    return [
        *(("example", name) for name in robsim.examples.names()),
        *(("change", change) for change in (*CHANGES, *features, *laws, *effects)),
        *(("docstrings", module.name) for module in modules),
    ]


def run_workload_item(use: WorkloadItem) -> None:
    """Do one thing that users do, in the folder where one is."""
    kind, what = use
    if kind == "example":
        robsim.load_scenario(robsim.examples.path(what)).run()
    elif kind == "change":
        _simulate_change(what)
    else:
        runner = doctest.DocTestRunner(verbose=False)
        for test in doctest.DocTestFinder().find(import_module(what)):
            runner.run(test, out=lambda text: None)


def _simulate_change(change: str) -> None:
    """Simulate a scenario with a change from one start, and from several."""
    one = robsim.load_scenario(robsim.examples.path(SCENARIO), [change])
    with suppress(InputError):  # a feature that needs another target, or two cameras
        one.run()
        q0 = [one.scene.home] * RUNS
        robsim.simulate(
            *(one.scene, one.task, q0), dt=one.dt, duration=STEPS * one.dt, sensing=one.sensing
        )
