"""Whether a declared field acts: its value in a text is changed, and the experiment runs."""

import re
import warnings
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from refused import spec_of_key

import robsim as rs
from robsim.declare import Role
from robsim.declare.context import MISSING, Context
from robsim.declare.problems import Problems
from robsim.declare.schema import SchemaDefinitions
from robsim.files.toml import write_toml
from robsim.plot.scene_content import build_scene_content
from robsim.rendering.development import Development
from robsim.rendering.rendered_face import find_shape_grey, list_shape_faces
from robsim.rendering.renderer import FULL_LIGHT, Renderer
from robsim.run.experiment import Experiment
from robsim.shapes import Block

NUMBER = re.compile(r"(?<![\w^.])-?\d+(\.\d+)?([eE][-+]?\d+)?")


@dataclass
class Case:
    """The tables of an experiment, the path to one of them, and other values for its keys."""

    tables: dict
    path: tuple = ()
    others: dict = field(default_factory=dict)
    _found: dict = field(default_factory=dict)

    def __post_init__(self):
        if self.path and isinstance(self.own(), str):  # the name of a kind alone
            inside = self._inside(self.tables, self.path[:-1])
            inside[self.path[-1]] = {"kind": self.own()}

    def own(self) -> dict:
        """Return the table that the path leads to."""
        return self._inside(self.tables, self.path)

    def effect(self, each) -> tuple[str, list]:
        """Return whether a field "acts", is "refused" or is "dead", and the values tried."""
        tried, probe = [], PROBES[each.role]
        before = self._before(probe)
        keys = self.others.get("keys", {})  # keys of fields with another form in a text
        for key in keys.get(each.name, each.spec.keys(each.name)):
            for value, given in self._values(each, key):
                tables = self._with(key, value)
                try:
                    found = probe(tables)
                except rs.errors.InputError as error:
                    tried += [(key, value, str(error))] if given else []
                    continue
                if not same(before, found):
                    return "acts", [(key, value, "")]
                if not self._means(tables):
                    tried.append((key, value, "same"))
        refused = bool(tried) and all(told != "same" for _, _, told in tried)
        return "refused" if refused else "dead", tried

    def _before(self, probe):
        """Return the result of a probe without a change."""
        if probe not in self._found:
            self._found[probe] = probe(self.tables)
        return self._found[probe]

    @cached_property
    def _experiment(self):
        return Experiment.from_text(write_toml(self.tables), "case.toml")

    def _means(self, tables) -> bool:
        """Return whether other tables are the same experiment in other words."""
        other = Experiment.from_text(write_toml(tables), "case.toml")
        return other == self._experiment and self.tables.get("study") == tables.get("study")

    def _with(self, key, value) -> dict:
        tables = deepcopy(self.tables)
        own = self._inside(tables, self.path)
        own.pop(key, None)
        if value is not MISSING:
            own[key] = value
        return tables

    def _values(self, each, key) -> Iterator[tuple[Any, bool]]:
        """Yield other values of a key, and whether they are given, not guessed from its own."""
        spec, own = each.spec, self.own().get(key, MISSING)
        spec = spec_of_key(each, key) if key in spec.keys(each.name) else spec
        plain = own if own is not MISSING else write_value(spec, each.default)
        words = words_in(each.spec.properties(each.name, SchemaDefinitions()).get(key, {}), plain)
        yield from ((value, True) for value in (*self.others.get(key, ()), *words))
        yield from ((value, False) for value in near(plain))
        if own is not MISSING and not each.required:
            yield MISSING, False

    @staticmethod
    def _inside(tables, path):
        for key in path:
            tables = tables[key]
        return tables


def write_value(spec, value):
    """Return the text of a value; MISSING if it needs more than the value."""
    try:
        return MISSING if value is None else spec.write(value, Context(Problems("text")))
    except Exception:  # noqa: BLE001 - for example a scene, which does not exist here
        return MISSING


def words_in(schema, but) -> Iterator[Any]:
    """Yield the words and truth values that a JSON Schema allows, but for one."""
    allowed = (True, False) if schema.get("type") == "boolean" else schema.get("enum", ())
    yield from (x for x in allowed if x is not but and x != but)
    for each in schema.get("anyOf", ()):
        yield from words_in(each, but)


def near(raw) -> Iterator[Any]:
    """Yield values of the same form with other numbers in them."""
    if isinstance(raw, bool):
        yield not raw
    elif isinstance(raw, int):
        yield from (raw + 1, raw - 1, 2 * raw + 2)
    elif isinstance(raw, float):
        yield from (factor * raw for factor in (1.25, 0.8, 3.0, 0.3)) if raw else (0.1, 1.0)
    elif isinstance(raw, str):
        for factor in (1.25, 0.8, 3.0, 0.3):
            other = NUMBER.sub(lambda x, by=factor: f"{by * (float(x[0]) or 0.1):.9g}", raw)
            if other != raw:
                yield other
    elif isinstance(raw, list):
        yield from ([*raw[:i], x, *raw[i + 1 :]] for i, each in enumerate(raw) for x in near(each))
        if len(raw) > 1:
            yield raw[:-1]
    elif isinstance(raw, dict):
        yield from ({**raw, key: x} for key, each in raw.items() for x in near(each))


def results(tables) -> dict:
    """Return all numbers of the run of an experiment, or of its study if it has one."""
    experiment = Experiment.from_text(write_toml(tables), "case.toml")
    if "study" in tables:
        return {name: np.asarray(each) for name, each in rs.study(experiment).table.items()}
    run = experiment.run()
    parts = enumerate(
        [leg.run for leg in run.legs] if isinstance(run, rs.tasks.MissionRun) else [run]
    )
    return {(i, name): x.values for i, part in parts for name, x in part.variables.items()}


def same(one, other) -> bool:
    """Return whether results are the same to the last bit."""
    return one.keys() == other.keys() and all(
        x.dtype == other[name].dtype
        and np.array_equal(x, other[name], equal_nan=x.dtype.kind == "f")
        for name, x in one.items()
    )


def pictures(tables) -> dict:
    """Return all points of a figure of the scene, its frame, its tags and boards, the grey
    values of all faces in pictures, and pictures of cameras with optics."""
    scene = Experiment.from_text(write_toml(tables), "case.toml").scene
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rs.errors.FileWarning)  # a mesh whose file does not exist
        solids = build_scene_content(scene, None, None).solids
    found = dict(enumerate(wire.points for wire in solids))
    targets = {each.name: np.array(repr(each.target)) for each in scene.objects}
    parts = [link.shapes for robot in scene.robots for link in robot.links]
    parts += [each.shapes for each in scene.objects]
    parts += [(each.camera.body,) for each in scene.cameras if each.camera.body]
    shapes = [shape for some in parts for shape in some]
    faces = [face for shape in shapes for face in list_shape_faces(shape)]
    greys = [find_shape_grey(shape) for shape in shapes]
    greys += [face.picture.mean() for face in faces if face.picture is not None]
    developed = {("eye", eye.name): draw_moving_shape(eye) for eye in scene.cameras if eye.optics}
    greys = np.array(greys)
    developed |= {("light", name): scene.picture(camera=name, exact=True) for _, name in developed}
    return {**found, **targets, **developed, "display": scene.display.matrix, "greys": greys}


def draw_moving_shape(eye) -> np.ndarray:
    """Return the picture of a block that moves before a camera with optics."""
    renderer = Renderer(eye.camera, [list_shape_faces(Block(0.2, 0.2, 0.1))])
    development = Development(renderer, eye.optics, eye.camera)
    poses = [rs.Pose.at(0.1 - 3.0 * each, 0, 1).matrix[None] for each in development.offsets]
    light = [FULL_LIGHT] * len(poses)
    return development.draw(np.array(poses), light, seed=0, run=0, step=0)


def files(tables) -> dict:
    """Return the files of all robots, as URDF and MJCF can hold them."""
    scene = Experiment.from_text(write_toml(tables), "case.toml").scene
    found = {}
    with TemporaryDirectory() as folder:
        for robot in scene.robots:
            for write in (robot.to_urdf, robot.to_mjcf):
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", rs.errors.FileWarning)  # meshes of MJCF
                    write(Path(folder, "robot.xml"))
                text = Path(folder, "robot.xml").read_text(encoding="utf-8")
                found[robot.name, write.__name__] = np.array(text)
    return found


def commands(tables) -> dict:
    """Return commands of the controller on its own, at a start that it sees, and after a pause."""
    experiment = Experiment.from_text(write_toml(tables), "case.toml")
    now, controller = next(experiment.steps()), rs.Controller(experiment)
    times = [*(i * experiment.dt for i in range(3)), 10.0]
    steps = (controller.step(now.pixels, now.q, time) for time in times)
    return {i: np.asarray(command.velocities) for i, command in enumerate(steps)}


def messages(tables) -> dict:
    """Return the topics, the times, and the names in messages of an experiment."""
    experiment = Experiment.from_text(write_toml(tables), "case.toml")
    told = experiment.ros2 or rs.control.RosConnection()
    names, ids = dict(told.names), dict(told.ids)
    frames, order = dict(told.frames), list(told.order) or None
    controller = rs.Controller(experiment)
    ros = rs.control.RosMessages(controller, names=names, marks=ids, frames=frames, order=order)
    fields = ("joints", "marks", "images", "commands", "odometry", "run")
    topics = [told.name_topic(field, camera="eye", robot="arm") for field in fields]
    kinds, times = (told.command_type, told.marks_type), (told.patience, told.timeout)
    parts = *kinds, *times, names, ids, frames, ros.order
    return {"messages": np.array([repr(each) for each in (*topics, *parts)])}


PROBES = {
    Role.RUN: results,
    Role.FIGURE: pictures,
    Role.FILE: files,
    Role.DRIVE: results,
    Role.ROBOT: commands,
    Role.MESSAGE: messages,
}
