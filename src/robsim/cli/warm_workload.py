"""The workload of `robsim warm`: typical uses, which compile the kernels.

The workload consists of the shipped scenarios, the examples in docstrings, and each feature, law
and effect.
"""

from __future__ import annotations

import doctest
import pkgutil
from contextlib import suppress
from importlib import import_module

import robsim
from robsim.base.errors import InputError
from robsim.kernels.machine.machine_code import LINKED

SCENARIO = "eye_in_hand"  # for features, schemes and imperfections
RUNS, STEPS = 9, 120  # batch that fills a SIMD register of eight runs, and part of another
CHANGES = (
    *(f"task.kind={kind}" for kind in ("pbvs", "hybrid", "partitioned")),
    *(f"task.inverse={inverse}" for inverse in ("damped", "transpose")),
    *(f"task.interaction={matrix}" for matrix in ("mean", "desired", "broyden")),
    'task.weighting=["tukey"]',
    'task.law={kind="constrained",constraints=["joint_limits","field_of_view"]}',
)
EFFECTS = {"image effect": "sensing.effects", "joint effect": "actuation.effects"}

WorkloadItem = tuple[str, str]  # kind of use, and name of the used object


def list_workload() -> list[WorkloadItem]:
    """Return the items of the workload, which `run_workload_item` runs.

    >>> items = list_workload()
    >>> ("example", "car") in items and ("change", "task.features=sphere") in items
    True
    """
    from robsim.declare import families, fields_of
    from robsim.servo.laws.command_quantity import get_command_quantity

    modules = pkgutil.walk_packages(robsim.__path__, "robsim.")
    features = (f"task.features={name}" for name in families()["feature"].names)
    laws = (  # the examples have laws of torques, which need a drive
        f"task.law={name}"
        for name, kind in families()["law"].kinds.items()
        if not any(each.required for each in fields_of(kind))
        and get_command_quantity(kind) == "velocity"
    )
    effects = (
        f'{path}=["{name}"]'
        for noun, path in EFFECTS.items()
        for name, kind in families()[noun].kinds.items()
        if not any(each.required for each in fields_of(kind))
    )
    drives = (f"actuation.drive={name}" for name in families()["drive"].names)
    return [
        *(("example", name) for name in robsim.examples.names()),
        *(("change", change) for change in (*CHANGES, *features, *laws, *effects, *drives)),
        *(("docstrings", module.name) for module in modules),
        ("linked", "stages"),
    ]


def run_workload_item(item: WorkloadItem) -> None:
    """Run one item of the workload in the current folder."""
    kind, name = item
    if kind == "example":
        robsim.load_scenario(robsim.examples.path(name)).run()
    elif kind == "change":
        _simulate_change(name)
    elif kind == "linked":
        for stage in LINKED.values():  # the examples perform only some of them
            assert stage.address
    else:
        runner = doctest.DocTestRunner(verbose=False)
        for test in doctest.DocTestFinder().find(import_module(name)):
            runner.run(test, out=lambda text: None)


def _simulate_change(change: str) -> None:
    """Simulate a changed scenario from one start and from several starts."""
    one = robsim.load_scenario(robsim.examples.path(SCENARIO), [change])
    with suppress(InputError):  # the feature needs another target, or two cameras
        one.run()
        q0 = [one.scene.home] * RUNS
        robsim.simulate(
            *(one.scene, one.task, q0),
            dt=one.dt,
            duration=STEPS * one.dt,
            sensing=one.sensing,
            actuation=one.actuation,
        )
