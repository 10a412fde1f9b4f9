"""The controls of an experiment: what a person may change of it by hand."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from robsim.declare.controls import Control, Place
from robsim.declare.problems import Problems
from robsim.declare.spec import Context, Raw
from robsim.declare.tables import controls_of, read_table
from robsim.robot.link_table import DHRow
from robsim.run.setup import Setup
from robsim.run.start_table import StartTable
from robsim.run.text import RUN, RunTable, TaskTable, beliefs, common_belief, robot_tables
from robsim.servo.goals.goal import started
from robsim.world.scene import Scene

PLACES = (".place.", ".tail.")  # of a joint, which its DH row says


def experiment_controls(of: Setup, tables: Mapping[str, Raw]) -> Iterator[Control]:
    """Yield the controls of task, start and settings, of the belief, and of the scene.

    Its tables say which joints have a DH row.
    """
    place = Place("", Context(Problems(of.source), facts={"scene": of.scene}))
    settings = of.settings
    run = RunTable(**{name: settings[name] for name in RUN})
    others = {name: settings[name] for name in ("sensing", "actuation", "safety", "endings")}
    start = StartTable(*started(of.start, of.scene))
    yield from controls_of(TaskTable(of.task, start=start, **others, run=run), place)
    if beliefs(of.task):
        belief = common_belief(of.task) or of.scene
        yield from _scene(belief, place.at("belief"), robot_tables(tables, of.source, True))
    yield from _scene(of.scene, place, robot_tables(tables, of.source, False))


def _scene(scene: Scene, place: Place, robots: Any) -> Iterator[Control]:
    """Yield the controls of a scene, in which joints with a DH row have those of the row."""
    c = place.c.knowing(scene=scene)
    rows = {
        place.at("robots").at(robot["name"]).at("links").at(link["name"]).path: link["dh"]
        for robot in robots
        for link in robot["links"]
        if "dh" in link
    }
    for path, row in rows.items():
        yield from controls_of(read_table(DHRow, row, c), Place(f"{path}.dh", c))
    for each in controls_of(scene, Place(place.path, c)):
        link = next((each.path.partition(key)[0] for key in PLACES if key in each.path), "")
        if link not in rows:
            yield each
