"""The controls of an experiment: what a person may change of it by hand."""

from __future__ import annotations

from collections.abc import Iterator

from robsim.declare.controls import Control, Place
from robsim.declare.problems import Problems
from robsim.declare.spec import Context
from robsim.declare.tables import controls_of
from robsim.run.setup import Setup
from robsim.run.start_table import StartTable
from robsim.run.text import RUN, RunTable, TaskTable, beliefs, common_belief
from robsim.servo.goals.goal import started
from robsim.world.scene import Scene


def experiment_controls(of: Setup) -> Iterator[Control]:
    """Yield the controls of task, start and settings, of the belief, and of the scene."""
    place = Place("", Context(Problems(of.source), facts={"scene": of.scene}))
    settings = of.settings
    run = RunTable(**{name: settings[name] for name in RUN})
    others = {name: settings[name] for name in ("sensing", "actuation", "safety", "endings")}
    start = StartTable(*started(of.start, of.scene))
    yield from controls_of(TaskTable(of.task, start=start, **others, run=run), place)
    if beliefs(of.task):
        belief = common_belief(of.task) or of.scene
        yield from _scene(belief, place.at("belief"))
    yield from _scene(of.scene, place)


def _scene(scene: Scene, place: Place) -> Iterator[Control]:
    """Yield the controls of a scene."""
    yield from controls_of(scene, Place(place.path, place.c.knowing(scene=scene)))
