"""A registered task class of a user: its runs have a text, and replay, explain and resume."""

from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np
import pytest

import robsim as rs
from robsim.declare import DeclaredValue, Number, families, register

ONE = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=0.4)
GOAL = ONE.task.goal


class Inner:
    """The protocol of tasks by another task."""

    def columns(self, scene):
        return rs.IBVS(GOAL).columns(scene)

    def bind(self, scene, columns=None):
        return rs.IBVS(GOAL, gain=getattr(self, "factor", 1.0)).bind(scene, columns)


@dataclass(frozen=True, eq=False)
class Plain(rs.IBVS):
    """Image-based servoing with fields of plain types."""

    factor: float = 0.5
    count: int = 2
    off: bool = False
    mode: str = "slow"


@dataclass(frozen=True)
class Protocol(Inner):
    """A frozen dataclass with a plain field."""

    factor: float = 0.5


@dataclass(frozen=True)
class Checked(Inner, DeclaredValue):
    """A frozen dataclass with a declared field."""

    factor: Annotated[float, Number(above=0), "Gain."] = 0.5


class Bare(Inner):
    """A class without fields."""


class Derived(rs.PBVS):
    """A class that derives from a scheme and adds no field."""


class Holding(Inner):
    """A class with a value that no text declares."""

    def __init__(self, factor=0.5):
        self.factor = factor


class Starting(rs.IBVS):
    """A scheme with arguments of its own."""

    def __init__(self, goal=None, factor=2.0):
        super().__init__(goal, gain=2 * factor)


@dataclass(frozen=True)
class Listed(Inner):
    """A field whose type is no number and no text."""

    values: list = field(default_factory=list)


KINDS = Plain, Protocol, Checked, Bare, Derived, Holding, Listed


@pytest.fixture(autouse=True)
def registered():
    """The classes above as kinds of tasks, for one test."""
    for kind in KINDS:
        register("task", f"my_{kind.__name__.lower()}")(kind)
    yield
    for kind in KINDS:
        families()["task"].loaded.pop(f"my_{kind.__name__.lower()}")


WITH_TEXT = {
    "plain": lambda: Plain(GOAL, gain=0.8, factor=0.7, count=-3, off=True, mode="fast"),
    "defaults": lambda: Plain(GOAL),
    "protocol": lambda: Protocol(0.3),
    "checked": lambda: Checked(0.3),
    "bare": Bare,
    "derived": lambda: Derived(GOAL, gain=2.0),
    "listed": Listed,
}


@pytest.mark.parametrize("case", WITH_TEXT)
def test_a_run_of_a_registered_task_replays_explains_and_opens(case, tmp_path):
    task = WITH_TEXT[case]()
    experiment = ONE.with_(task=task)
    run = experiment.run()
    again = rs.Experiment.from_text(experiment.text)
    assert type(again.task) is type(task) and again.text == experiment.text
    rs.save_run(run, tmp_path / "own.nc")
    opened = rs.open_run(tmp_path / "own.nc")
    assert rs.replay(opened).identical(run)
    assert "After 0.4 s" in str(rs.explain(opened))


def test_plain_fields_are_read_changed_and_checked():
    task = WITH_TEXT["plain"]()
    text = ONE.with_(task=task).text
    for line in ("factor = 0.7", "count = -3", "off = true", 'mode = "fast"'):
        assert line in text
    changed = ONE.with_(task=task).at({"task.factor": 0.2, "task.mode": "slow"})
    assert (changed.task.factor, changed.task.mode, changed.task.count) == (0.2, "slow", -3)
    assert ONE.with_(task=task).vary({"task.gain": [0.5, 1.0]}).run().sizes["run"] == 2
    for name, wrong in (("factor", "much"), ("count", 1.5), ("off", 3), ("mode", 2)):
        with pytest.raises(rs.errors.InputError, match=f"task.{name}"):
            ONE.with_(task=task).at(f"task.{name}", wrong)
    with pytest.raises(rs.errors.InputError, match=r"Plain\.factor"):
        replace(task, factor=np.ones(3))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Holding(0.3), "Holding has a factor of its own"),
        (lambda: Listed([1]), "Listed has a values of its own"),
    ],
)
def test_values_that_no_field_declares_have_no_text_and_the_run_still_runs(make, words):
    """Before, a run of the first class ended with a TypeError of Python's own."""
    experiment = ONE.with_(task=make())
    run = experiment.run()
    for ask in (rs.replay, rs.explain):
        with pytest.raises(rs.errors.InputError, match=words) as error:
            ask(run)
        assert "fields of a frozen dataclass" in str(error.value)
    assert "After 0.4 s" in str(rs.explain(run, experiment))


def test_a_class_that_cannot_be_made_from_its_fields_is_not_registered():
    """Before, `replay` and `explain` of its runs ended with a TypeError."""
    with pytest.raises(rs.errors.InputError, match=r"Starting.__init__ does not take its fields"):
        register("task", "my_starting")(Starting)
    assert "my_starting" not in families()["task"].names
