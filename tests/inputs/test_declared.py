"""The promises of every declaration: wrong values are refused by name, defaults survive a file."""

import dataclasses
import math
import tomllib
from copy import deepcopy
from itertools import pairwise

import pytest
from refused import list_refused_values, spec_of_key

import robsim as rs
from robsim import robots
from robsim.declare import families, fields_of
from robsim.declare.quantities import Quantity
from robsim.declare.scalars import Integer, Number
from robsim.declare.tables import get_text_form
from robsim.files.toml import write_toml
from robsim.robot.dh_row import DHRow
from robsim.robot.joint import Steering
from robsim.robot.link_table import LinkTable
from robsim.robot.robot_table import RobotTable, ToolTable
from robsim.run.experiment import Experiment
from robsim.run.experiment_text import ExperimentTable, RunTable, StartTable
from robsim.servo.feature_block import FeatureBlock
from robsim.servo.goals.goal import GoalTable
from robsim.studies.study_text import StudyTable, read_plan
from robsim.trajectory import Straight

SOURCE = "bench.toml"
BASE = {
    "robots": [
        {
            "name": "arm",
            "links": [
                {"name": "base"},
                {"name": "upper", "joint": "revolute"},
                {"name": "fore", "joint": "revolute"},
            ],
            "tools": [{"name": "gripper", "links": [{"name": "palm"}]}],
        },
        {"name": "belt", "links": [{"name": "bed"}, {"name": "pallet", "joint": "prismatic"}]},
    ],
    "objects": [{"name": "dots", "marks": ["0, 0, 1 m", "1, 0, 1 m", "0, 1, 1 m"]}],
    "cameras": [{"name": "eye", "on": "arm.fore", "focal": 800, "size": [640, 480]}],
    "motions": [{"robot": "belt", "rates": ["1 cm/s"]}],
    "task": {"kind": "ibvs"},
    "start": {},
    "sensing": {"occlusions": [{"marks": [0], "start": "1 s", "end": "2 s"}]},
    "actuation": {},
    "run": {},
    "study": {"runs": 3, "vary": {}},
}
LINK = ("robots", 0, "links", 2)
FOLLOWED = [["0 deg", "0 deg"], ["10 deg", "20 deg"]]
LIMITS = {"speed": "1 rad/s", "acceleration": "1 rad/s^2"}
AVOIDED = {"kind": "avoid_limits"}
WAY = {"start": {}, "end": {"position": "1, 0, 0 m"}, "duration": "2 s"}

# the place of a kind of a family in a text, and the keys around it
PLACES = {
    "ending": (("endings", 0), {}),
    "trajectory": (("task", "trajectory"), {"kind": "follow_joints", "joints": ["upper", "fore"]}),
    "shape": (("objects", 0, "shapes", 0), {}),
    "feature": (("task", "features"), {"kind": "ibvs"}),
    "curve": ((*LINK, "curve"), {"joint": "rail"}),
    "joint kind": ((*LINK, "joint"), {}),
    "inverse": (("task", "inverse"), {"kind": "ibvs"}),
    "interaction matrix": (("task", "interaction"), {"kind": "ibvs"}),
    "depth": (("task", "depth"), {"kind": "ibvs"}),
    "feed-forward": (("task", "feed_forward"), {"kind": "ibvs"}),
    "gain": (("task", "gain"), {"kind": "ibvs"}),
    "law": (("task", "law"), {"kind": "ibvs"}),
    "constraint": (("task", "law", "constraints", 0), {"kind": "constrained"}),
    "secondary motion": (("task", "secondary"), {"kind": "ibvs"}),
    "projection": (("task", "projection"), {"kind": "ibvs", "secondary": AVOIDED}),
    "weighting": (("task", "weighting", 0), {"kind": "ibvs"}),
    "mark detector": (("task", "detector"), {"kind": "ibvs"}),
    "condition": (
        ("task", "when"),
        {"kind": "switch", "first": {"kind": "pbvs"}, "second": {"kind": "ibvs"}},
    ),
    "task": (("task",), {}),
    "image effect": (("sensing", "effects", 0), {}),
    "joint effect": (("actuation", "effects", 0), {}),
    "drive": (("actuation", "drive"), {}),
    "sampler": (("study", "vary", "task.gain"), {}),
    "start": (("study", "start"), {}),
}
JOINED = {
    "rail": {"curve": {"kind": "line", "length": "1 m"}},
    "car": {"steering": {"limit": "30 deg", "wheelbase": "30 cm"}},
}
COUPLED = {"ackermann": "car", "rolling": "car", "chord": "inspection_a", "mimic": "inspection_a"}
PHOTO = str(rs.examples.path("car").parent / "thumbnails" / "car.webp")
# what must be given of a kind
NEEDED = {
    "blends": {"points": FOLLOWED, **LIMITS},
    "quintic": {"start": FOLLOWED[0], "end": FOLLOWED[1], "duration": "2 s"},
    "trapezoid": {"start": FOLLOWED[0], "end": FOLLOWED[1], **LIMITS},
    "ball": {"radius": "1 cm"},
    "block": {"length": "1 cm", "width": "1 cm", "height": "1 cm"},
    "shape camera": {"length": "1 cm", "width": "1 cm", "height": "1 cm"},
    "capsule": {"radius": "1 cm", "length": "1 cm"},
    "tapered_cylinder": {"radius": "1 cm", "end_radius": "2 cm", "length": "1 cm"},
    "mesh": {"filename": "plate.stl"},
    "poster": {"picture": PHOTO, "width": "1 m"},
    "wheel": {"radius": "1 cm", "width": "1 cm"},
    "sphere": {"radius": "1 cm"},
    "arc": {"radius": "1 m", "angle": "1 rad"},
    "catenary": {"start": "0, 0 m", "end": "1, 0 m", "length": "2 m"},
    "line": {"length": "1 m"},
    "polyline": {"points": ["0, 0 m", "1, 0 m", "1, 1 m"], "radius": "10 cm"},
    "adaptive": {"at_zero": 4, "at_infinity": 0.4, "slope": 30},
    "law camera": {"length": "1 m"},
    "constrained": {"constraints": ["joint_limits"]},
    "joint_speeds": {"most": "1 rad/s"},
    "half_space": {"frame": "eye", "normal": [0, 0, 1]},
    "workspace_box": {"frame": "eye", "low": "-9, -9, -9 m", "high": "9, 9, 9 m"},
    "clearance": {"first": "eye", "second": "dots", "distance": "1 cm"},
    "line_of_sight": {"body": "pallet", "radius": "1 cm"},
    "joint_accelerations": {"most": "1 rad/s^2"},
    "error_below": {"value": 0.1},
    "near_border": {"margin": 20, "size": [640, 480]},
    "posture": {"q": ["0 deg", "0 deg"]},
    "region": {"frame": "eye", "low": "0, 0, 0 m", "high": "1, 1, 1 m"},
    "too_close": {"one": "eye", "other": "world", "distance": "1 m"},
    "filter": {"start": "1 m"},
    "occlusion": {"marks": [0], "start": "1 s", "end": "2 s"},
    "period": {"period": "80 ms"},
    "velocity": {"velocity": "1 rad/s"},
    "acceleration": {"acceleration": "1 rad/s^2"},
    "follow_joints": {"to": {"upper": "10 deg"}, "duration": "1 s"},
    "follow_path": {"to": {"position": "1, 0, 0 m"}, "duration": "1 s"},
    "parallel": {"tasks": [{"kind": "ibvs", "joints": "upper"}, {"kind": "ibvs"}]},
    "priorities": {"tasks": [{"kind": "ibvs"}, {"kind": "pbvs"}]},
    "mission": {"phases": [{"name": "look", "task": {"kind": "ibvs"}}]},
    "uniform": {"low": 1.0, "high": 2.0},
    "sobol": {"low": 1.0, "high": 2.0},
    "log_uniform": {"low": 1.0, "high": 2.0},
    "grid": {"low": 1.0, "high": 2.0},
    "normal": {"mean": 5.0, "std": 0.1},
    "plus": {"of": {"kind": "uniform", "low": 1.0, "high": 2.0}},
    "times": {"of": {"kind": "uniform", "low": 1.0, "high": 2.0}},
    "choice": {"values": [1.0, 2.0]},
    "given": {"values": [1.0, 2.0, 3.0]},
    "look_at": {"distance": ["1 m", "2 m"]},
    "shell": {"distance": ["1 m", "2 m"]},
    "within": {"radius": "1 m"},
    "switch": {**PLACES["condition"][1], "when": {"kind": "error_below", "value": 0.1}},
}
# {class: (its place, the keys that it requires, the keys around it)}
OTHERS = {
    ExperimentTable: ((), {}, {}),
    RobotTable: (("robots", 0), {}, {}),
    ToolTable: (("robots", 0, "tools", 0), {}, {}),
    LinkTable: (LINK, {}, {}),
    Steering: ((*LINK, "steering"), {"limit": "30 deg", "wheelbase": "30 cm"}, {"joint": "car"}),
    DHRow: ((*LINK, "dh"), {"theta": "0 deg", "d": "1 m", "a": "1 m", "alpha": "0 deg"}, {}),
    rs.shapes.Inertia: ((*LINK, "inertia"), {"mass": "1 kg", "moments": "1, 1, 1 kg m^2"}, {}),
    rs.shapes.BlockPictures: (
        ("objects", 0, "shapes", 0, "pictures"),
        {"top": PHOTO},
        {"kind": "block", "length": "1 cm", "width": "1 cm", "height": "1 cm"},
    ),
    rs.Object: (("objects", 0), {}, {}),
    rs.MountedCamera: (("cameras", 0), {}, {}),
    rs.Motion: (("motions", 0), {}, {}),
    rs.Sensing: (("sensing",), {}, {}),
    rs.imperfections.Occlusion: (("sensing", "occlusions", 0), {}, {}),
    rs.Actuation: (("actuation",), {}, {}),
    rs.drives.DriveModel: (("actuation", "drive", "model"), {}, {"kind": "velocity_loop"}),
    rs.drives.Payload: (("actuation", "payloads", 0), {"on": "arm.fore", "mass": "1 kg"}, {}),
    rs.laws.SpeedLimit: (("task", "limit"), {"joint": "1 rad/s"}, {"kind": "ibvs"}),
    FeatureBlock: (("task", "features"), {"kind": "points"}, {"kind": "ibvs"}),
    GoalTable: (("task", "goal"), {}, {"kind": "ibvs"}),
    Straight: (("task", "path"), WAY, {"kind": "follow_path"}),
    StartTable: (("start",), {}, {}),
    RunTable: (("run",), {}, {}),
    StudyTable: (("study",), {"runs": 3}, {}),
}


def kinds():
    """(class, place, table, keys around it) of all declared classes."""
    for noun, family in families().items():
        own = {name: kind for name, kind in family.kinds.items() if _ours(kind)}
        for name, kind in own.items():
            needed = {"kind": name, **NEEDED.get(f"{noun} {name}", NEEDED.get(name, {}))}
            path, around = PLACES[noun] if noun != "coupling" else ((), {})
            around = {**around, **(JOINED.get(name, {}) if noun == "joint kind" else {})}
            yield pytest.param(kind, name, path, needed, around, id=f"{noun}-{name}")
    for kind, (path, needed, around) in OTHERS.items():
        yield pytest.param(kind, None, path, needed, around, id=kind.__name__)


def _ours(kind):
    return kind.__module__.startswith("robsim.")


def make_tables(kind, name, path, table, around):
    """The tables of a text, and the table in it that is meant."""
    tables = deepcopy(BASE)
    if name in COUPLED:
        robot = tomllib.loads(robots.file(COUPLED[name]).read_text(encoding="utf-8"))
        del robot["schema"]
        tables["robots"].append(robot)
        found = (link["follows"] for link in robot["links"] if "follows" in link)
        return tables, next(each for each in found if each["kind"] == name)
    inside = tables
    holder = inside
    for key, following in pairwise(path):
        if isinstance(inside, dict):
            holder = inside
            inside.setdefault(key, [] if isinstance(following, int) else {})
        elif len(inside) == key:
            inside.append({})
        inside = inside[key]
    if isinstance(inside, list) and len(inside) == path[-1]:
        inside.append({})
    if not path:
        return tables, tables
    if path[-1] == "task":
        inside["task"] = {}
    if around:
        (inside if isinstance(inside, dict) else holder).update(deepcopy(around))
    own = inside.setdefault(path[-1], {}) if isinstance(inside, dict) else inside[path[-1]]
    if not isinstance(own, dict):
        own = inside[path[-1]] = {}
    own |= deepcopy(table)
    return tables, own


def read(tables):
    experiment = Experiment.from_text(write_toml(tables), SOURCE)
    if not isinstance(experiment.task, rs.Mission):
        read_plan(experiment)
    return experiment


every_kind = pytest.mark.parametrize(("kind", "name", "path", "table", "around"), list(kinds()))


@every_kind
@pytest.mark.parametrize("every", [3, pytest.param(1, marks=pytest.mark.full)])
@pytest.mark.few(15)
def test_a_wrong_value_is_refused_by_its_name(kind, name, path, table, around, every):
    tables, own = make_tables(kind, name, path, table, around)
    read(tables)
    before, reports = dict(own), []
    for key, wrong in wrong_values(kind)[::every]:
        own.clear()
        own |= {**before, key: wrong}
        reports += wrongly_told(tables, key, wrong)
    assert not reports, "\n".join(reports)


def wrong_values(kind):
    """Each key of a table with each of the values that it must not have."""
    return [
        (key, wrong)
        for each in fields_of(get_text_form(kind))
        for key in each.spec.keys(each.name)
        for wrong in list_refused_values(spec_of_key(each, key))
    ]


def wrongly_told(tables, key, wrong):
    """The fault of the refusal of a value, or None."""
    shown = f"{key} = {wrong!r:.60}"
    try:
        read(tables)
    except rs.errors.FileError as error:
        message = str(error)
        good = (line.startswith(f"{SOURCE}: ") and key in line for line in message.split("\n"))
        return [] if all(good) else [f"{shown}: {message}"]
    except Exception as error:  # noqa: BLE001 - the test looks for any error
        return [f"{shown}: {error!r}"]
    return [f"{shown} is taken"]


@every_kind
@pytest.mark.few(14)
def test_values_that_are_read_are_written_and_read_again(kind, name, path, table, around):
    made = read(make_tables(kind, name, path, table, around)[0])
    again = Experiment.from_text(made.to_toml(), SOURCE)
    assert again == made and again.to_toml() == made.to_toml()


def found_in(value, kind, depth=0):
    """The first object of a class within an experiment."""
    if type(value) is kind or depth > 8:
        return value if type(value) is kind else None
    parts = vars(value).values() if dataclasses.is_dataclass(value) else ()
    parts = value if isinstance(value, tuple | list) else parts
    found = (found_in(part, kind, depth + 1) for part in parts)
    return next((each for each in found if each is not None), None)


@every_kind
def test_a_number_out_of_bounds_is_refused_in_python_too(kind, name, path, table, around):
    if get_text_form(kind) is not kind:
        return  # its fields belong to a text
    made = found_in(read(make_tables(kind, name, path, table, around)[0]), kind)
    for each in fields_of(kind):
        for wrong in numbers_beyond(each.spec) if made is not None else ():
            with pytest.raises(rs.errors.InputError, match=each.name):
                dataclasses.replace(made, **{each.name: wrong})


def numbers_beyond(spec):
    if isinstance(spec, Integer):
        return [spec.least - 1, spec.least + 0.5, math.nan, "one", True]
    if not isinstance(spec, Number):
        return []
    steps = [(spec.above, 0), (spec.below, 0), (spec.least, -1), (spec.most, 1)]
    endless = [math.inf] if type(spec) in (Number, Quantity) else []  # some may be infinite
    return [math.nan, *endless, "fast", *(x + step for x, step in steps if x is not None)]


@every_kind
def test_a_meaning_is_a_sentence(kind, name, path, table, around):
    for each in fields_of(get_text_form(kind)):
        first, *_, last = each.meaning
        assert (first.isupper() or not first.isalpha()) and last == ".", (each.name, each.meaning)
