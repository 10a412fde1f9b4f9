"""Scenario files: the meaning of each key, and one clear FileError for every fault."""

import math
import time
import tomllib
import warnings
from copy import deepcopy

import numpy as np
import pytest
import tomli_w
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import robsim as rs
from robsim.files.robot_library import read_robot
from robsim.run.experiment import Experiment, load_scenario
from robsim.servo.tasks.docking_task import Docking
from robsim.servo.tasks.placing_task import Placing

DEG = math.pi / 180
RHINO = """
schema = 1
title = "Rhino over a cube"

[[robots]]
model = "rhino_xr4"

[[objects]]
name = "cube"
position = "28, 0, 2.5 cm"
shapes = [{ kind = "block", length = "5 cm", width = "6 cm", height = "70 mm", color = "b" }]
marks = ["2.5, 2.5, 2.5 cm", "-2.5, 2.5, 2.5 cm", "-2.5, -2.5, 2.5 cm", "2.5, -2.5, 2.5 cm"]

[[cameras]]
name = "eye"
on = "rhino_xr4.tool"
position = "0, 5, -10 cm"
size = [640, 480]
focal = [800, 810]

[task]
kind = "ibvs"
gain = 1.5

[start]
q = ["1 deg", "-92 deg", "92 deg", "1 deg", "-90 deg"]

[run]
dt = "40 ms"
duration = "2 s"
"""

# every key of the format at least once
RICH = """
schema = 1
title = "Everything"
[[robots]]
name = "arm"
about = "an arm on a rail"
sources = ["made up"]
convention = "modified"
position = "1, 2, 3 cm"
rpy = "0, 0, 90 deg"
home = ["10 cm", "20 deg", "0.3 rad"]
[[robots.links]]
name = "base"
place = { position = "0, 0, 1 cm" }
shapes = [{ kind = "wheel", radius = "3 cm", width = "1 cm", n = 12, rotvec = "0, 0, 1 rad" }]
[[robots.links]]
name = "slide"
joint = "prismatic"
dh = { theta = "0 deg", d = "0 cm", a = "0 cm", alpha = "90 deg" }
limits = ["0 cm", "50 cm"]
[[robots.links]]
name = "turn"
joint = "revolute"
dh = { theta = "5 deg", d = "1 cm", a = "20 cm", alpha = "-90 deg" }
limits = ["-90 deg", "90 deg"]
[[robots.links]]
name = "nod"
parent = "turn"
joint = "revolute"
place = { position = "0, 0, 1 cm", rotvec = "0, 1, 0 rad" }
tail = { rotation = [[0, -1, 0], [1, 0, 0], [0, 0, 1]] }
[[robots.links]]
name = "plate"
shapes = [
  { kind = "ball", radius = "1 cm", n = 8, mass = "20 g" },
  { kind = "mesh", filename = "../plate.stl", scale = [1, 2, 3] },
]
[robots.links.inertia]
mass = "2 kg"
centre = "0, 0, 1 cm"
moments = "1, 2, 2.5 kg m^2"
products = "1, 0, 0 g cm^2"
[[robots]]
model = "free_camera"
name = "fly"
on = "arm.plate"
home = ["0 m", "0 m", "0 m", 0, 0, 0, "1"]
[[objects]]
name = "board"
on = "world"
position = "0, 0, 2 m"
shapes = [
  { kind = "block", length = "20 cm", width = "20 cm", height = "1 cm", density = "2.7 g/cm^3" },
  { kind = "camera", length = "9 cm", width = "4 cm", height = "3 cm", color = "tab:blue" },
]
[[cameras]]
name = "eye"
on = "fly.body"
K = [[500, 0.5, 320], [0, 510, 240], [0, 0, 1]]
size = [640, 480]
distortion = [-0.1, 0.01, 0.001, -0.001]
body = { length = "8 cm", width = "4 cm", height = "3 cm", color = "k" }
[[cameras]]
name = "other"
focal = 400
center = [100, 200]
skew = 0.1
[display]
rpy = "0, 0, 45 deg"
[task]
kind = "ibvs"
camera = "eye"
target = "board"
features = "pixels"
interaction = "mean"
depth = "30 cm"
depth_scale = 1.1
law = "camera"
length = "1 cm"
gain = 2
inverse = "damped"
damping = 0.02
tolerance = 0.05
goal = { computed = { position = "0, 0, 50 cm" } }
[belief]
display = { rpy = "0, 0, 46 deg" }
robots = [{ name = "arm", links = [{ name = "turn", dh = { a = "21 cm" } }] }]
objects = [{ name = "board", position = "0, 0, 2.1 m" }]
cameras = [{ name = "eye", focal = [550, 550] }]
[start]
q = ["10 cm", "20 deg", "0.3 rad", "0 m", "0 m", "0 m", "0", "0", "0", "1"]
[run]
dt = "20 ms"
duration = "1 s"
seed = 7
record = 2
[sensing]
noise = 0.5
"""


def read(text=RHINO, old="", new="", **changes):
    assert old in text
    return Experiment.from_text(text.replace(old, new, 1), "bench.toml", **changes)


def refusal(text=RHINO, old="", new="", **changes):
    """The message of the FileError, which hides pydantic's and tomllib's."""
    with pytest.raises(rs.errors.FileError) as caught:
        read(text, old, new, **changes)
    assert caught.value.__context__ is None or caught.value.__suppress_context__
    assert caught.value.__cause__ is None
    return str(caught.value)


# the meaning of the keys


def read_again(scenario):
    """The experiment of its own text, which is short, and of the complete one."""
    short, whole = scenario.text, scenario.to_toml(complete=True)
    assert 'model = "rhino_xr4"' in short and len(short.splitlines()) < 40
    made = Experiment.from_text(short)
    assert made == Experiment.from_text(whole)
    return made


def test_a_plain_scenario_has_the_values_of_its_file():
    scenario = read()
    assert scenario.title == "Rhino over a cube" and read_again(scenario) == scenario
    assert scenario.task.gain == 1.5 and scenario.task == rs.IBVS(gain=1.5)
    np.testing.assert_array_equal(scenario.start, np.array([1, -92, 92, 1, -90]) * DEG)
    cube = scenario.scene.object("cube")
    np.testing.assert_array_equal(cube.pose.position, [0.28, 0, 0.025])
    assert cube.shapes == (rs.Block(0.05, 0.06, 0.07, "b"),)
    np.testing.assert_array_equal(cube.marks[1], [-0.025, 0.025, 0.025])
    eye = scenario.scene.camera("eye")
    np.testing.assert_array_equal(eye.camera.K, [[800, 0, 319.5], [0, 810, 239.5], [0, 0, 1]])
    assert eye.camera.size == (640, 480) and eye.on == "rhino_xr4.tool"
    assert (scenario.dt, scenario.duration) == (0.04, 2.0)
    scenario.check()


def test_the_rich_scenario_has_the_values_of_its_file():
    scenario = read(RICH)
    arm, fly = scenario.scene.robots
    turned = rs.Pose.at(rotvec=(0, 0, 1))
    rows = [[0, 0, 0, np.pi / 2], [5 * DEG, 0.01, 0.2, -np.pi / 2]]
    dh = rs.Robot.from_dh(rows, "modified", "PR")
    for ours, theirs in zip(arm.links[1:3], dh.links[1:], strict=True):
        assert ours.joint.place == theirs.joint.place and ours.joint.tail == theirs.joint.tail
    assert arm.base == rs.Pose.at(0.01, 0.02, 0.03, rpy=(0, 0, np.pi / 2))
    assert arm.links[0].joint.place == rs.Pose.at(0, 0, 0.01)
    assert arm.links[0].shapes == (rs.Wheel(0.03, 0.01, 12, pose=turned),)
    assert arm.links[3].joint.place == rs.Pose.at(0, 0, 0.01, rotvec=(0, 1, 0))
    assert arm.links[3].joint.tail.matrix[:2, :2].tolist() == [[0, -1], [1, 0]]
    assert arm.links[4].parent == "nod" and arm.links[4].joint.kind == "fixed"
    np.testing.assert_array_equal(arm.home, [0.1, 20 * DEG, 0.3])
    np.testing.assert_array_equal(arm.limits[0], [0, 0.5])
    assert (fly.name, fly.on) == ("fly", "arm.plate")
    board = scenario.scene.object("board")
    assert board.shapes[1] == rs.CameraBody(0.09, 0.04, 0.03, "tab:blue")
    assert len(board.marks) == 8 + 12  # no marks given: all vertices
    eye, other = scenario.scene.cameras
    assert eye.camera.K.tolist() == [[500, 0.5, 320], [0, 510, 240], [0, 0, 1]]
    assert eye.camera.distortion == (-0.1, 0.01, 0.001, -0.001)
    assert eye.camera.body == rs.CameraBody(0.08, 0.04, 0.03, "k")
    assert other.camera.K.tolist() == [[400, 0.1, 100], [0, 400, 200], [0, 0, 1]]
    assert scenario.scene.display == rs.Pose.at(rpy=(0, 0, np.pi / 4))
    task = scenario.task
    assert (task.camera, task.target, task.interaction) == ("eye", "board", "mean")
    assert (task.depth, task.depth_scale, task.gain, task.tolerance) == (0.3, 1.1, 2.0, 0.05)
    assert (task.features, task.law) == (rs.features.PixelPoints(), rs.laws.CameraLaw(0.01))
    assert task.inverse == rs.laws.DampedInverse(0.02)
    assert task.goal == rs.GoalPose(rs.Pose.at(0, 0, 0.5))
    told = scenario
    assert (told.dt, told.duration, told.seed, told.sensing.noise, told.record) == (
        0.02,
        1.0,
        7,
        0.5,
        2,
    )


def test_missing_keys_have_the_defaults_of_simulate_and_ibvs():
    import inspect

    scenario = read(RHINO[: RHINO.index("[start]")], "gain = 1.5", "")
    assert scenario.start is None and scenario.task == rs.IBVS()
    bare = rs.Experiment(scenario.scene, rs.IBVS(), title=scenario.title)
    assert scenario.settings == bare.settings
    defaults = inspect.signature(rs.simulate).parameters
    told = {name: v for name, v in scenario.settings.items() if name in defaults}
    told |= {"sensing": None, "actuation": None}
    assert told == {name: defaults[name].default for name in told} and len(told) == 10


FREE = """
schema = 1
robots = [{ model = "free_camera" }]
objects = [{ name = "dots", marks = ["0, 0, 1 m", "10, 0, 100 cm", "0, 10, 100 cm"] }]
cameras = [{ name = "eye", on = "free_camera.body", focal = 800, size = [640, 480] }]
"""


# every kind of task and every key of a task at least once, in the groups that kinds have
AIM = """
camera = ["eye", "wall"]
target = "dots"
tolerance = 0.01
joints = ["fly", "belt.belt"]
smooth_start = 3
limit = { joint = "30 deg/s", linear = "10 cm/s", angular = "20 deg/s" }
"""
REDUNDANT = """
secondary = { kind = "avoid_limits", gain = 2, margin = 0.2 }
projection = { low = 0.02, high = 0.2 }
"""
DEPTH = """
depth = { start = "50 cm", start_sigma = 0.4, noise = 2 }
depth_scale = 1.1
"""
LAW = """
interaction = "broyden"
broyden_start = [[1, 0], [0, 1]]
inverse = "pseudo_inverse"
rcond = 1e-3
feed_forward = "known"
"""
TRANSPOSED = """
inverse = "transpose"
law = "camera"
length = "1 cm"
"""
GIVEN = "goal = { s = [0.1, 0.2] }"
AHEAD = """
feed_forward = "estimated"
lag = "100 ms"
"""
BELT = """
schema = 1
robots = [{ model = "free_camera", name = "fly" }, { model = "conveyor", name = "belt" }]
objects = [{ name = "dots", marks = ["0, 0, 1 m", "10, 0, 100 cm", "0, 10, 100 cm"] }]
[[cameras]]
name = "eye"
on = "fly.body"
focal = 800
size = [640, 480]
[[cameras]]
name = "wall"
on = "belt.belt"
focal = 800
size = [640, 480]
[[motions]]
robot = "belt"
rates = ["-5 cm/s"]
[run]
hold = true
"""
STILL = BELT.replace('[[motions]]\nrobot = "belt"\nrates = ["-5 cm/s"]', "")
ONE_EYE = STILL.replace(
    """[[cameras]]
name = "wall"
on = "belt.belt"
focal = 800
size = [640, 480]
""",
    "",
)
AIMED = {
    "camera": ("eye", "wall"),
    "target": "dots",
    "tolerance": 0.01,
    "joints": ("fly", "belt.belt"),
    "smooth_start": 3,
    "limit": rs.laws.SpeedLimit(30 * DEG, 0.1, 20 * DEG),
}
AVOIDING = {
    "secondary": rs.laws.AvoidLimits(2, 0.2),
    "projection": rs.laws.LargeProjection(0.02, 0.2),
}
DEEP = {"depth": rs.laws.DepthFilter(0.5, 0.4, 2), "depth_scale": 1.1}
LEARNT = {
    "interaction": rs.laws.Broyden([[1, 0], [0, 1]]),
    "inverse": rs.laws.PseudoInverse(1e-3),
    "feed_forward": "known",
}
SEVEN = '["1 cm", "2 cm", "3 cm", "4 deg", "5 deg", "6 rad", "7 mm"]'
SEVEN_VALUES = [0.01, 0.02, 0.03, 4 * DEG, 5 * DEG, 6, 0.007]
RATES = '["1 cm/s", "2 cm/s", "3 cm/s", "4 deg/s", "5 deg/s", "6 rad/s", "7 mm/s"]'
PAIR = '"eye", "wall"'
TASKS = {
    'kind = "ibvs"\nfeatures = "lines"': rs.IBVS(features="lines"),
    'kind = "ibvs"\nfeatures = { kind = "sphere", radius = "5 cm", tolerance = 0.1 }': rs.IBVS(
        features=rs.features.Sphere(0.05, 0.1)
    ),
    'kind = "ibvs"\nfeatures = { kind = "decoupled_moments", of = "region" }': rs.IBVS(
        features=rs.features.DecoupledMoments("region")
    ),
    'kind = "ibvs"\nfeatures = { kind = "points", weight = 2 }': rs.IBVS(
        features=rs.features.FeatureBlock("points", weight=2)
    ),
    'kind = "ibvs"\ncamera = "eye"\nfeatures = ["points", { kind = "translation", form = "camera", '
    'camera = ["eye", "wall"], target = "dots", marks = [1, 0], components = [2] }]': rs.IBVS(
        camera="eye",
        features=[
            "points",
            rs.features.FeatureBlock(
                rs.features.Translation("camera"), ("eye", "wall"), "dots", [1, 0], [2]
            ),
        ],
    ),
    'kind = "ibvs"\ngain = { at_zero = 4, at_infinity = 0.4, slope = 30 }': rs.IBVS(
        gain=rs.laws.AdaptiveGain(4, 0.4, 30)
    ),
    'kind = "ibvs"\ninteraction = [[1, 2, 3, 4, 5, 6]]': rs.IBVS(interaction=[[1, 2, 3, 4, 5, 6]]),
    'kind = "ibvs"\ninteraction = "broyden"\nfeed_forward = "known"\njoints = "fly"': rs.IBVS(
        interaction=rs.laws.Broyden(), feed_forward="known", joints="fly"
    ),
    'kind = "ibvs"\nsecondary = { kind = "avoid_limits" }\nprojection = "large"\n'
    'limit = { joint = "1 m/s" }': rs.IBVS(
        secondary=rs.laws.AvoidLimits(), projection="large", limit=rs.laws.SpeedLimit(1.0)
    ),
    f'kind = "ibvs"\ncamera = [{PAIR}]\nsecondary = {{ kind = "posture", q = {SEVEN} }}': rs.IBVS(
        camera=("eye", "wall"), secondary=rs.laws.Posture(SEVEN_VALUES)
    ),
    f'kind = "ibvs"\ncamera = [{PAIR}]\nlimit = {{ joint = {RATES} }}': rs.IBVS(
        camera=("eye", "wall"), limit=rs.laws.SpeedLimit(SEVEN_VALUES)
    ),
    f'kind = "ibvs"\n{AIM}{REDUNDANT}{DEPTH}{LAW}': rs.IBVS(**AIMED, **AVOIDING, **DEEP, **LEARNT),
    f'kind = "ibvs"\n{GIVEN}\n{AIM}{TRANSPOSED}': rs.IBVS(
        rs.GoalFeatures([0.1, 0.2]), **AIMED, inverse="transpose", law=rs.laws.CameraLaw(0.01)
    ),
    f'kind = "pbvs"\nform = "camera"\nlaw = "camera"\n{AIM}{REDUNDANT}{AHEAD}': rs.PBVS(
        form="camera", law="camera", feed_forward=rs.laws.EstimatedMotion(0.1), **AIMED, **AVOIDING
    ),
    f'kind = "hybrid"\nmark = 2\ngain = 3\n{AIM}{REDUNDANT}{DEPTH}{LAW}': rs.Hybrid(
        mark=2, gain=3, **AIMED, **AVOIDING, **DEEP, **LEARNT
    ),
    'kind = "partitioned"\nsegment = [2, 0]\nroll = 2\nadvance = "30 cm/s"\nlength = "2 cm"\n'
    f'interaction = "mean"\ngain = 3\nrcond = 1e-3\n{AIM}{REDUNDANT}{DEPTH}': rs.Partitioned(
        segment=(2, 0),
        roll=2,
        advance=0.3,
        length=0.02,
        interaction="mean",
        gain=3,
        inverse=rs.laws.PseudoInverse(1e-3),
        **AIMED,
        **AVOIDING,
        **DEEP,
    ),
    'kind = "placing"\nvariant = "printed"\nmarks = [2, 0, 1]\nrotation = 2\ntranslation = 3\n'
    f'length = "2 cm"\n{AIM}{REDUNDANT}': Placing(
        variant="printed",
        marks=(2, 0, 1),
        rotation=2,
        translation=3,
        length=0.02,
        **AIMED,
        **AVOIDING,
    ),
    f'kind = "docking"\nturn = 4\nh = 5\ngain = 2\n{AIM}': Docking(turn=4, h=5, gain=2, **AIMED),
    'kind = "priorities"\nrcond = 0.1\nsmooth_start = 2\n[[task.tasks]]\nkind = "ibvs"\n'
    '[[task.tasks]]\nkind = "pbvs"\ngain = 2': rs.Priorities(
        [rs.IBVS(), rs.PBVS(gain=2)], 0.1, smooth_start=2
    ),
    'kind = "switch"\nfirst = { kind = "pbvs" }\nsecond = { kind = "ibvs", gain = 2 }\n'
    'when = { kind = "error_below", value = 0.1, of = "second" }\nlatch = false': rs.Switch(
        rs.PBVS(), rs.IBVS(gain=2), rs.tasks.ErrorBelow(0.1, "second"), False
    ),
    'kind = "switch"\nfirst = { kind = "ibvs" }\nsecond = { kind = "pbvs" }\n'
    'when = { kind = "near_border", margin = 20, size = [640, 480] }': rs.Switch(
        rs.IBVS(), rs.PBVS(), rs.tasks.NearBorder(20, (640, 480))
    ),
    'kind = "parallel"\n[[task.tasks]]\nkind = "ibvs"\ncamera = "eye"\n[[task.tasks]]\n'
    'kind = "pbvs"\ncamera = "wall"': rs.Parallel([rs.IBVS(camera="eye"), rs.PBVS(camera="wall")]),
}


@pytest.mark.parametrize("text", TASKS)
def test_a_task_has_the_values_of_its_file(text):
    base = STILL if "wall" in text else ONE_EYE
    assert read(f"{base}\n[task]\n{text}").task == TASKS[text]


def test_motions_and_hold_have_the_values_of_their_file():
    scenario = read(f'{BELT}\n[task]\nkind = "ibvs"\ncamera = "eye"')
    assert scenario.scene.motions == (rs.Motion("belt", [-0.05]),)
    assert scenario.hold is True and read().hold is False
    told = f'{BELT}\n[task]\nkind = "ibvs"\ncamera = "eye"\n[[belief.motions]]\nrobot = "belt"\n'
    assert read(f'{told}rates = ["0 m/s"]').task.belief.motions == (rs.Motion("belt", [0]),)


def test_tasks_within_a_task_share_the_belief_or_have_their_own():
    tasks = """
task = { kind = "parallel", tasks = [
    { kind = "ibvs" },
    { kind = "ibvs", belief = { cameras = [{ name = "eye", focal = 700 }] } },
] }
belief = { cameras = [{ name = "eye", focal = 900 }] }
"""
    scenario = read(tasks + ONE_EYE)
    focal = [each.belief.camera().camera.K[0, 0] for each in scenario.task.tasks]
    assert focal == [900, 700]


def test_a_flying_camera_starts_and_ends_at_poses():
    keys = '{ position = "1, 2, 3 cm", rpy = "0, 0, 90 deg" }'
    scenario = read(f'{FREE}start = {keys}\ntask = {{ kind = "ibvs", goal = {keys} }}')
    pose = rs.Pose.at(0.01, 0.02, 0.03, rpy=(0, 0, np.pi / 2))
    np.testing.assert_array_equal(scenario.start, pose.q)
    np.testing.assert_array_equal(scenario.task.goal.q, pose.q)


def test_a_byte_order_mark_and_windows_line_ends_are_read(tmp_path):
    path = tmp_path / "windows.toml"
    path.write_bytes(b"\xef\xbb\xbf" + RHINO.replace("\n", "\r\n").encode())
    assert load_scenario(path).task.gain == 1.5


# beliefs


def believed(changes, base=RHINO):
    return read(base + changes).task.belief


def test_no_belief_is_none():
    assert read().task.belief is None


def test_a_belief_changes_the_numbers_it_names_and_nothing_else():
    truth = read().scene
    belief = believed('[[belief.cameras]]\nname = "eye"\nfocal = [900, 900]')
    assert belief.camera().camera.K.tolist() == [[900, 0, 319.5], [0, 900, 239.5], [0, 0, 1]]
    assert belief.camera().pose == truth.camera().pose
    assert belief.camera().on == "rhino_xr4.tool"
    assert belief.object().shapes == truth.object().shapes
    places = (scene.robots[0].tree.joints.place for scene in (belief, truth))
    np.testing.assert_array_equal(*places)


def test_a_belief_may_change_one_number_of_a_library_robot():
    belief = believed(
        '[[belief.robots]]\nname = "rhino_xr4"\n'
        'links = [{ name = "forearm", dh = { a = "25 cm" } }]'
    )
    truth = read().scene.robot()
    for link, true in zip(belief.robot().links, truth.links, strict=True):
        expected = [0.25, 0, 0] if link.name == "forearm" else true.joint.tail.position
        np.testing.assert_array_equal(link.joint.tail.position, expected)


def test_a_focal_length_over_a_truth_in_K_keeps_its_centre_and_skew():
    K = "K = [[800, 0.5, 300], [0, 810, 250], [0, 0, 1]]"
    base = RHINO.replace("focal = [800, 810]", K)
    belief = believed('[[belief.cameras]]\nname = "eye"\nfocal = 900', base)
    assert belief.camera().camera.K.tolist() == [[900, 0.5, 300], [0, 900, 250], [0, 0, 1]]


@pytest.mark.parametrize(
    "true,over,expected",
    [
        ('rpy = "0, 0, 90 deg"', 'rotvec = "0, 0, 1 rad"', rs.Pose.at(rotvec=(0, 0, 1))),
        (
            'rotvec = "0, 0, 1 rad"',
            "rotation = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]",
            rs.Pose([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]),
        ),
        ("rotation = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]", 'rpy = "0, 0, 0 deg"', rs.Pose.at()),
    ],
)
def test_a_rotation_in_other_words_replaces_the_true_one(true, over, expected):
    base = RHINO.replace('position = "0, 5, -10 cm"', true)
    belief = believed(f'[[belief.cameras]]\nname = "eye"\n{over}', base)
    np.testing.assert_array_equal(belief.camera().pose, expected)


def test_a_complete_belief_is_a_scene_of_its_own():
    belief = believed(
        """
[belief]
complete = true
robots = [{ model = "rhino_xr4" }]
objects = [{ name = "cube", marks = ["0, 0, 1 cm"] }]
cameras = [{ name = "eye", on = "rhino_xr4.tool", focal = 700, size = [640, 480] }]
"""
    )
    assert belief.object().shapes == () and not belief.object().pose.position.any()
    assert not belief.camera().pose.position.any()


# changes from outside


def test_changes_reach_every_kind_of_path():
    scenario = read(
        set=[
            "task.gain=2",
            "run.dt=20 ms",
            "run.seed=3",
            "cameras.eye.size=[320, 240]",
            "robots.rhino_xr4.position='1, 0, 0 m'",
            'robots.rhino_xr4.home=["0 deg", "-80 deg", "90 deg", "0 deg", "-90 deg"]',
            "robots.rhino_xr4.links.forearm.dh.a=30 cm",
            "belief.cameras.eye.focal=[900, 900]",
            "objects.cube.position=30, 0, 2 cm",
            "title=Another",
        ]
    )
    assert scenario.task.gain == 2.0 and scenario.title == "Another"
    assert (scenario.dt, scenario.seed) == (0.02, 3)
    assert scenario.scene.camera().camera.size == (320, 240)
    robot = scenario.scene.robot()
    np.testing.assert_array_equal(robot.base.position, [1, 0, 0])
    assert robot.home[1] == -80 * DEG
    assert robot.links[3].joint.tail.position[0] == 0.3
    np.testing.assert_array_equal(scenario.scene.object().pose.position, [0.3, 0, 0.02])
    assert scenario.task.belief.camera().camera.K[0, 0] == 900
    assert scenario.task.belief.object().pose.position[0] == 0.3


def test_changes_are_in_the_text_and_the_text_gives_the_same_experiment():
    scenario = read(set={"task.gain": "2", "belief.cameras.eye.focal": "[900, 900]"})
    assert "gain = 2" in scenario.text
    again = Experiment.from_text(scenario.text)
    assert again.text == scenario.text and again.to_toml() == scenario.to_toml()


@pytest.mark.parametrize(
    "text,change,expected",
    [
        ('features = "lines"\nlaw = "camera"\nlength = "1 cm"', "task.kind=hybrid", rs.Hybrid),
        ('features = "lines"\nlaw = "camera"', "task.kind=partitioned", rs.Partitioned),
        ('inverse = "damped"\ndamping = 1', "task.inverse=transpose", rs.IBVS),
        ('feed_forward = "estimated"\nlag = "1 s"', "task.feed_forward=known", rs.IBVS),
        (
            'interaction = "broyden"\nbroyden_start = [[1]]',
            "task.interaction=[[1, 2, 3, 4, 5, 6]]",
            rs.IBVS,
        ),
        (
            'secondary = { kind = "avoid_limits", margin = 0.2 }',
            'task.secondary={ kind = "posture", q = [] }',
            None,
        ),
        ("goal = { s = [1] }", 'task.goal={ position = "1, 2, 3 m" }', None),
        ('depth = { start = "1 m" }', "task.depth=goal", rs.IBVS),
        ("gain = { at_zero = 3, at_infinity = 1, slope = 2 }", "task.gain.slope=3", rs.IBVS),
        ('features = { kind = "sphere", radius = "1 cm" }', "task.features.kind=points", rs.IBVS),
    ],
)
def test_a_change_of_a_task_leaves_nothing_behind_that_makes_no_sense(text, change, expected):
    base = f'{ONE_EYE}\n[task]\nkind = "ibvs"\n{text}'
    if expected:
        assert type(read(base, set=[change]).task) is expected
    else:
        message = refusal(base, set=[change])
        assert "margin" not in message and "give one of them only" not in message


def test_a_motion_is_changed_by_the_name_of_its_robot():
    text = f'{BELT}\n[task]\nkind = "ibvs"\ncamera = "eye"'
    motions = read(text, set=['motions.belt.rates=["1 cm/s"]']).scene.motions
    assert motions == (rs.Motion("belt", [0.01]),)
    assert "mean 'belt'" in refusal(text, set=['motions.bolt.rates=["1 cm/s"]'])
    assert "cannot be set" in refusal(text, set=["motions.belt.robot=fly"])


def test_a_change_removes_keys_that_make_no_sense_beside_it():
    task = read(RICH, set={"task.law": "joint", "task.inverse": "pseudo_inverse"}).task
    assert (task.law, task.inverse) == (rs.laws.JointLaw(), rs.laws.PseudoInverse())
    goal = read(
        RICH, set={"task.goal.q": '["10 cm", "20 deg", "0 deg", "0 m", "0 m", "0 m", 0, 0, 0, 1]'}
    )
    assert goal.task.goal.q[0] == 0.1


@pytest.mark.parametrize(
    "change,parts",
    [
        ("task.gian=2", ["task.gian", "did you mean 'gain'"]),
        ("tsak.gain=2", ["tsak.gain", "did you mean 'task.gain'"]),
        ("cameras.eyy.focal=3", ["cameras.eyy", "did you mean 'eye'"]),
        ("robots.rhino_xr4.links.forarm.dh.a=3 cm", ["links.forarm", "did you mean 'forearm'"]),
        ("task.gain=fast", ["task.gain", "number", "'fast'"]),
        ("task.gain=nan", ["task.gain", "finite", "nan"]),
        ("task.gain=1\nlaw='x'", ["task.gain", "number"]),
        ("cameras.eye={}", ["cameras.eye", "cameras.NAME.size"]),
        ("cameras.eye.name=ear", ["cameras.eye.name", "cannot be set"]),
        ("schema=2", ["schema", "cannot be set"]),
        ("run.dt.x=2", ["run.dt", "expected"]),
        (".=2", ["'.'", "cannot be set"]),
        ("task.gain", ["'task.gain'", "key=value"]),
        ("task.kind=[1]", ["task.kind", "no kind [1]"]),
        ("a." * 5000 + "a=1", ["cannot be set"]),
    ],
)
def test_a_change_that_cannot_be_made_names_the_nearest(change, parts):
    message = refusal(set=[change])
    assert all(part in message for part in parts), message


# faults in a file

WRONG = [
    # the top of the file
    ("schema = 1", "", ["schema", "missing", "schema = 1"]),
    ("schema = 1", "schema = 2", ["schema", "2", "schema = 1"]),
    ("schema = 1", 'schema = "1"', ["schema", "'1'", "schema = 1"]),
    ("schema = 1", "schema = true", ["schema", "True", "schema = 1"]),
    ("[task]", "[taks]", ["taks", "did you mean 'task'"]),
    ("[task]", "[[task]]", ["task", "table"]),
    ("[[robots]]", "[robots]", ["robots", "[[robots]]"]),
    ('title = "Rhino over a cube"', "title = 3", ["title", "a text", "3"]),
    # unknown keys
    ("gain = 1.5", "gian = 1.5", ["task.gian", "did you mean 'gain'"]),
    ("focal =", "fokal =", ["cameras.eye.fokal", "did you mean 'focal'"]),
    ("length =", "lenght =", ["objects.cube.shapes[0].lenght", "did you mean 'length'"]),
    ("duration =", "duratoin =", ["run.duratoin", "did you mean 'duration'"]),
    ('model = "rhino_xr4"', 'model = "rhino_xr4"\nhoem = []', ["hoem", "did you mean 'home'"]),
    # wrong types
    ("gain = 1.5", 'gain = "1.5"', ["task.gain", "number", "'1.5'"]),
    ("gain = 1.5", "gain = true", ["task.gain", "number", "True"]),
    ("gain = 1.5", "gain = [1.5]", ["task.gain", "number", "[1.5]"]),
    ("gain = 1.5", "gain = 2020-01-01", ["task.gain", "number", "2020"]),
    ("gain = 1.5", f"gain = {'1' * 400}", ["task.gain", "number", "111"]),
    ("gain = 1.5", f"gain = {'1' * 5000}", ["not valid TOML", "5000 digits"]),
    ("size = [640, 480]", "size = [640.5, 480]", ["cameras.eye.size[0]", "whole number", "640.5"]),
    ("size = [640, 480]", "size = [640, 480, 3]", ["cameras.eye.size", "2 items", "480"]),
    ("size = [640, 480]", "size = 640", ["cameras.eye.size", "list", "640"]),
    ("size = [640, 480]", "size = [0, 480]", ["cameras.eye.size[0]", "1", "0"]),
    ('dt = "40 ms"', "seed = -1", ["run.seed", "0", "-1"]),
    ('dt = "40 ms"', "seed = 1.0", ["run.seed", "whole number", "1.0"]),
    ('dt = "40 ms"', f"seed = {2**64}", ["run.seed", str(2**64)]),
    ("[run]", "[sensing]\nnoise = -1\n[run]", ["sensing.noise", "0", "-1"]),
    ('dt = "40 ms"', "record = 0", ["run.record", "0", '"summary"']),
    ('dt = "40 ms"', 'record = "some"', ["run.record", "'some'", '"all"']),
    # faults of images and joints
    ("[run]", '[sensing]\nnoise = "1 px"\n[run]', ["sensing.noise", "number", "'1 px'"]),
    ("[run]", "[sensing]\nnose = 1\n[run]", ["sensing.nose", "did you mean 'noise'"]),
    ("[run]", "[sensing]\nlatency = 0.04\n[run]", ["sensing.latency", "unit of time", "0.04"]),
    ("[run]", "[sensing]\ndropped = 1.0\n[run]", ["sensing.dropped", "less than 1", "1.0"]),
    (
        "[run]",
        '[sensing]\nocclusions = [{ marks = [0], start = "0 s" }]\n[run]',
        ["sensing.occlusions[0].start", "greater than 0"],
    ),
    (
        "[run]",
        '[sensing]\nocclusions = [{ marks = [0], start = "2 s", end = "1 s" }]\n[run]',
        ["sensing.occlusions[0]", "must end later"],
    ),
    ("[run]", '[actuation]\nlag = "1 m"\n[run]', ["actuation.lag", "unit of time"]),
    (
        "[run]",
        '[actuation]\nvelocity = "1 m/s"\n[run]',
        ["actuation.velocity", "unit of turn rate", "'1 m/s'"],
    ),
    (
        "[run]",
        '[actuation]\nvelocity = ["1 deg/s", "2 deg/s"]\n[run]',
        ["actuation.velocity", "2 velocities, expected 5: shoulder"],
    ),
    (
        "[run]",
        '[actuation]\nvelocity = "1e12 deg/s"\n[run]',
        ["actuation.velocity", "at most 1e+09 in SI units"],
    ),
    (
        "[run]",
        '[actuation]\nacceleration = "1 rad/s"\n[run]',
        ["actuation.acceleration", "rad/s^2"],
    ),
    (
        "[run]",
        '[actuation]\nencoder = "-1 deg"\n[run]',
        ["actuation.encoder", "or equal to 0", "-1 deg"],
    ),
    # NaN, infinity, zero and below
    ("gain = 1.5", "gain = nan", ["task.gain", "finite", "nan"]),
    ("gain = 1.5", "gain = -inf", ["task.gain", "finite", "-inf"]),
    ("gain = 1.5", "gain = 0", ["task.gain", "greater than 0", "got 0"]),
    ("focal = [800, 810]", "focal = [nan, 810]", ["cameras.eye.focal[0]", "finite", "nan"]),
    ("focal = [800, 810]", "focal = -800", ["cameras.eye.focal", "greater than 0", "-800"]),
    ('"28, 0, 2.5 cm"', '"28, nan, 2.5 cm"', ["objects.cube.position", "nan", "(m, cm, mm, um)"]),
    ('"28, 0, 2.5 cm"', '"28, 0, 1e400 cm"', ["objects.cube.position", "1e400"]),
    ('"28, 0, 2.5 cm"', f'"28, 0, 1e{10**15} cm"', ["objects.cube.position", "a unit of length"]),
    ('"28, 0, 2.5 cm"', '"28, 0, 1e12 m"', ["objects.cube.position", "1e12", "1e+09"]),
    ('length = "5 cm"', 'length = "-5 cm"', ["cube.shapes[0].length", "greater than 0", "-5 cm"]),
    ('length = "5 cm"', 'length = "0 cm"', ["cube.shapes[0].length", "greater than 0", "0 cm"]),
    # units
    ('"28, 0, 2.5 cm"', '"28, 0, 2.5"', ["objects.cube.position", "28, 0, 2.5", "cm"]),
    ('"28, 0, 2.5 cm"', '"28, 0, 2.5 kg"', ["objects.cube.position", "2.5 kg", "cm"]),
    ('"28, 0, 2.5 cm"', '"28, 0 cm"', ["objects.cube.position", "2 numbers, not 3"]),
    ('"28, 0, 2.5 cm"', '["28 cm", "0 cm", "2.5 cm"]', ["cube.position", '"1, 2, 3 cm"']),
    ('"28, 0, 2.5 cm"', f'"28{" " * 900}!"', ["objects.cube.position", "..."]),
    ('length = "5 cm"', "length = 5", ["cube.shapes[0].length", "5:", "unit of length"]),
    ('length = "5 cm"', 'length = "5 deg"', ["cube.shapes[0].length", "5 deg", "unit of length"]),
    ('dt = "40 ms"', "dt = 0.04", ["run.dt", "0.04", "unit of time"]),
    ('dt = "40 ms"', 'dt = "40 cm"', ["run.dt", "40 cm", "unit of time"]),
    ('dt = "40 ms"', 'dt = "1e-300 s"', ["run", "1e-300", "10000000 steps"]),
    ('"92 deg"', '"92 cm"', ["start.q[2]", "92 cm", "unit of angle"]),
    ('"92 deg"', "92", ["start.q[2]", "92", "unit of angle"]),
    ('"92 deg"', "true", ["start.q[2]", "True"]),
    # counts
    ('"1 deg", ', "", ["start.q", "4 coordinates, expected 5", "shoulder, upper_arm"]),
    (
        'model = "rhino_xr4"',
        'model = "rhino_xr4"\nhome = ["0 deg"]',
        ["robots.rhino_xr4.home", "1 coordinates, expected 5"],
    ),
    # choices and names
    ('kind = "ibvs"', 'kind = "ivbs"', ["task.kind", "'ivbs'", "mean 'ibvs'", "parallel"]),
    ('kind = "ibvs"', "", ["task.kind", "missing"]),
    ('kind = "ibvs"', 'kind = "ibvs"\nfeatures = "ponts"', ["task.features", "'points'", "ponts"]),
    ('kind = "ibvs"', 'kind = "ibvs"\ninteraction = "x"', ["task.interaction", "'desired'", "'x'"]),
    ('kind = "ibvs"', 'kind = "ibvs"\nlaw = "camra"', ["task.law", "'camera'", "'camra'"]),
    ('kind = "ibvs"', 'kind = "ibvs"\ninverse = "svd"', ["task.inverse", "'damped'", "'svd'"]),
    ('kind = "ibvs"', 'kind = "ibvs"\ndepth = "gaol"', ["task.depth", "'gaol'", "mean 'goal'"]),
    ('kind = "ibvs"', 'kind = "ibvs"\ndepth = "-3 cm"', ["task.depth", "'-3 cm'", "above 0"]),
    ('kind = "ibvs"', 'kind = "ibvs"\ndepth = 0.3', ["task.depth", "0.3", "unit of length"]),
    ('kind = "ibvs"', 'kind = "ibvs"\ncamera = "eyy"', ["task.camera", "'eyy'", "mean 'eye'"]),
    ('kind = "ibvs"', 'kind = "ibvs"\ntarget = "cub"', ["task.target", "'cub'", "mean 'cube'"]),
    ('kind = "block"', 'kind = "blok"', ["cube.shapes[0].kind", "'block'", "'blok'"]),
    ('kind = "block", ', "", ["cube.shapes[0].kind", "missing", "'wheel'"]),
    ('color = "b"', 'mass = "2"', ["cube.shapes[0].mass", "unit of mass (kg, g)"]),
    ('color = "b"', 'density = "2 kg"', ["cube.shapes[0].density", "(kg/m^3, g/cm^3)"]),
    ('color = "b"', 'mass = "-2 kg"', ["cube.shapes[0].mass", "greater than 0"]),
    ('"b" }', '"b" }, { kind = "mesh", filename = "/a" }', ["cube.shapes[1]", "absolute"]),
    ('"b" }', '"b" }, { kind = "mesh", mass = "1 g" }', ["cube.shapes[1].mass", "unknown key"]),
    ('color = "b"', 'color = "$x^2$"', ["cube.shapes[0].color", "pattern", "$x^2$"]),
    ('"rhino_xr4.tool"', '"rhino_xr4.tol"', ["cameras.eye.on", "tol", "mean 'rhino_xr4.tool'"]),
    ('"rhino_xr4"', '"rino_xr4"', ["robots.rino_xr4.model", "'rino_xr4'", "mean 'rhino_xr4'"]),
    ('"rhino_xr4"', "3", ["robots[0].model", "library", "3"]),
    ('"rhino_xr4"', '"../puma560"', ["robots.../puma560.model", "'../puma560'", "puma560"]),
    ('name = "cube"', 'name = "the cube"', ["objects.the cube.name", "starts with a letter"]),
    ('name = "cube"', 'name = "a/b"', ["objects.a/b.name", "starts with a letter"]),
    ('name = "cube"', "", ["objects[0].name", "missing"]),
    ('name = "cube"', 'name = "eye"', ["two things", "'eye'"]),
    ('name = "cube"', 'name = "world"', ["two things", "'world'"]),
    # contradictory keys
    ("focal = [800, 810]", "", ["cameras.eye", "focal is missing", "K = [[fx"]),
    (
        "focal = [800, 810]",
        "focal = 3\nK = [[3, 0, 1], [0, 3, 1], [0, 0, 1]]",
        ["cameras.eye", "K and focal"],
    ),
    (
        "focal = [800, 810]",
        "K = [[3, 0, 1], [2, 3, 1], [0, 0, 1]]",
        ["cameras.eye.K", "[2.0, 3.0, 1.0]", "[0, fy, cy]"],
    ),
    ("focal = [800, 810]", "K = [[3, 0], [0, 3]]", ["cameras.eye.K", "3 items"]),
    ("size = [640, 480]", "", ["cameras.eye", "center is missing", "size"]),
    ("size = [640, 480]", "size = [640, 480]\ndistortion = [1]", ["cameras.eye.distortion", "4"]),
    (
        'position = "0, 5, -10 cm"',
        'rpy = "0, 0, 0 deg"\nrotvec = "0, 0, 0 deg"',
        ["cameras.eye", "rpy and rotvec: give one of them"],
    ),
    (
        'position = "0, 5, -10 cm"',
        "rotation = [[2, 0, 0], [0, 1, 0], [0, 0, 1]]",
        ["cameras.eye.rotation", "not a rotation"],
    ),
    (
        'position = "0, 5, -10 cm"',
        "rotation = [[-1, 0, 0], [0, 1, 0], [0, 0, 1]]",
        ["cameras.eye.rotation", "reflection"],
    ),
    ('kind = "ibvs"', 'kind = "ibvs"\nlength = "1 cm"', ["task", "length", 'law = "camera"']),
    ('kind = "ibvs"', 'kind = "ibvs"\ndamping = 0.1', ["task", "damping", '"damped"']),
    (
        'kind = "ibvs"',
        'kind = "ibvs"\ninverse = "damped"\nrcond = 0.1',
        ["task", "rcond", '"pseudo_inverse"'],
    ),
    ('kind = "ibvs"', 'kind = "ibvs"\nrcond = 1', ["task.rcond", "less than 1", "got 1"]),
    (
        'kind = "ibvs"',
        'kind = "ibvs"\ngoal = { position = "0, 0, 1 m" }',
        ["task.goal", "floats", "shoulder"],
    ),
    (
        'kind = "ibvs"',
        'kind = "ibvs"\ngoal = { q = [], computed = {} }',
        ["task.goal", "q and computed: give one"],
    ),
    ("[start]", '[start]\nposition = "0, 0, 1 m"', ["start", "q and position: give one"]),
    # limits
    ('"92 deg"', '"192 deg"', ["start.q", "'forearm'", "outside its limits"]),
    (
        'model = "rhino_xr4"',
        'model = "rhino_xr4"\nhome = ["0 deg", "0 deg", "0 deg", "0 deg", "0 deg"]',
        ["robots.rhino_xr4.home", "'upper_arm'", "outside its limits"],
    ),
    # belief
    ("[run]", "[[belief.cameras]]\nname = 'eyy'\n[run]", ["belief.cameras.eyy", "mean 'eye'"]),
    ("[run]", "[[belief.cameras]]\nfocal = 1\n[run]", ["belief.cameras[0]", "name"]),
    ("[run]", "[[belief.cameras]]\nname='eye'\nfokal = 1\n[run]", ["eye.fokal", "mean 'focal'"]),
    ("[run]", "[belief.camera]\nname = 'eye'\n[run]", ["belief.camera", "mean 'cameras'"]),
    ("[run]", "[belief]\ncomplete = 1\n[run]", ["belief.complete", "boolean"]),
    ("schema = 1", "schema = 1\nbelief = 3", ["belief", "[[belief.cameras]]", "3"]),
    (
        "[run]",
        "[[belief.robots]]\nname='rhino_xr4'\nlinks=[{name='wirst'}]\n[run]",
        ["belief.robots.rhino_xr4.links.wirst", "mean 'wrist'"],
    ),
    # TOML
    ("[run]", "[run", ["not valid TOML", "line 28, column 5"]),
    ("gain = 1.5", "gain = 1.5\ngain = 2", ["not valid TOML", "line", "column"]),
    ("gain = 1.5", f"gain = {'[' * 3000}", ["nested too deeply"]),
    ("gain = 1.5", f"gain = {'{a=' * 3000}", ["nested too deeply"]),
    ("gain = 1.5", f"gain = {'[' * 60}{']' * 60}", ["task.gain", "number", "[[["]),
    ("gain = 1.5", f"{'a.' * 20}a = 1", ["task.a", "unknown key"]),
    ("gain = 1.5", f"{'a.' * 100_000}a = 1", ["invalid key", "line 23"]),
    ("gain = 1.5", f"""{"'a' . " * 100_000}a = 1""", ["invalid key", "line 23"]),
    (RHINO, " \n", ["empty", "schema = 1"]),
]


@pytest.mark.parametrize("old,new,parts", WRONG)
def test_each_fault_is_reported_with_file_key_value_and_a_valid_value(old, new, parts):
    start = time.perf_counter()
    message = refusal(RHINO, old, new)
    assert time.perf_counter() - start < 5  # a file that is slow to refuse takes minutes
    assert message.startswith("bench.toml: ")
    assert all(part in message for part in parts), message
    assert all(len(line) <= 600 for line in message.splitlines())


WRONG_LINKS = [
    ('joint = "prismatic"', 'joint = "prism"', ["links.slide.joint", "'revolute'", "'prism'"]),
    ('"50 cm"', '"50 deg"', ["links.slide.limits[1]", "50 deg", "unit of length"]),
    ('["0 cm", "50 cm"]', '["50 cm", "0 cm"]', ["links.slide", "limits"]),
    ('["0 cm", "50 cm"]', '["0 cm"]', ["links.slide.limits", "expected 2: lowest, highest"]),
    ('name = "plate"', 'name = "plate"\nlimits = ["0 m", "1 m"]', ["plate.limits", "fixed"]),
    ('parent = "turn"', 'parent = "trun"', ["robots.arm.links", "'trun'", "mean 'turn'"]),
    ('parent = "turn"', 'parent = "plate"', ["robots.arm.links", "is its own ancestor"]),
    ('name = "plate"', 'name = "nod"', ["robots.arm.links", "two frames", "'nod'"]),
    ('name = "base"', 'name = "base"\njoint = "revolute"', ["links.base", "first link"]),
    ('name = "base"', 'name = "base"\nparent = "nod"', ["links.base", "first link"]),
    ('parent = "turn"', 'dh = { theta = "0 cm" }', ["links.nod.dh.theta", "0 cm"]),
    ("alpha = ", "alhpa = ", ["links.slide.dh.alhpa", "mean 'alpha'"]),
    (
        'parent = "turn"',
        'dh = { theta = "0 deg", d = "0 m", a = "0 m", alpha = "0 deg" }',
        ["links.nod", "dh and place or tail"],
    ),
    (
        "tail = { rotation",
        'tail = { rpy = "0, 0, 1 deg", rotation',
        ["nod.tail", "rpy and rotation: give one"],
    ),
    ('"modified"', '"craig"', ["robots.arm.convention", "'modified'", "'craig'"]),
    ("n = 12", "n = 2", ["links.base.shapes[0].n", "3", "2"]),
    ("n = 12", "n = 1000000000", ["links.base.shapes[0].n", "4096"]),
    ('0, 0, 0, "1"', '0, 0, 0, "2"', ["robots.fly.home", "quaternion"]),
    ('0, 0, 0, "1"', '0, 0, 0, "1 rad"', ["robots.fly.home[6]", "1 rad", "bare number"]),
    ('0, 0, 0, "1"', "0, 0, 0, nan", ["robots.fly.home[6]", "nan"]),
    ('on = "arm.plate"', 'on = "fly.body"', ["is its own ancestor"]),
]


@pytest.mark.parametrize("old,new,parts", WRONG_LINKS)
def test_a_fault_of_a_robot_is_reported_with_its_link(old, new, parts):
    message = refusal(RICH, old, new)
    assert message.startswith("bench.toml: ")
    assert all(part in message for part in parts), message


CART = """
schema = 1
objects = [{ name = "dots", marks = ["3, 0, 0 m", "3, 1, 0 m", "3, 0, 1 m"] }]
cameras = [{ name = "eye", on = "cart.body", focal = 800, size = [640, 480] }]
task = { kind = "ibvs" }
start = { q = ["1 m", "20 cm", "30 deg"] }
[[robots]]
name = "cart"
home = ["0 m", "0 m", "0 deg"]
[[robots.links]]
name = "base"
[[robots.links]]
name = "body"
joint = "planar"
place = { position = "0, 0, 1 m" }
"""
NAMES_IN_PLANE = "body.x, body.y, body.theta"


@pytest.mark.parametrize("kind", ["planar", "unicycle"])
def test_a_start_in_the_plane_is_two_lengths_and_an_angle(kind):
    scenario = read(CART, "planar", kind)
    np.testing.assert_allclose(scenario.start, [1, 0.2, np.pi / 6], rtol=0, atol=1e-16)
    assert scenario.scene.robots[0].links[1].joint.kind == kind


@pytest.mark.parametrize(
    "old,new,parts",
    [
        ('"1 m", "20 cm"', '"1 m"', ["start.q: 2 coordinates, expected 3", NAMES_IN_PLANE]),
        ('"0 m", "0 m"', '"0 m"', ["cart.home: 2 coordinates, expected 3", NAMES_IN_PLANE]),
        ('"30 deg"', '"30 cm"', ["start.q[2]", "30 cm", "angle"]),
        (
            'q = ["1 m", "20 cm", "30 deg"]',
            'position = "1, 0, 0 m"',
            ["start: ", "only joint floats", NAMES_IN_PLANE],
        ),
        ('joint = "planar"', 'joint = "planer"', ["body.joint", "'planar'", "'planer'"]),
        (
            'joint = "planar"',
            'joint = "planar"\nlimits = ["0 m", "1 m"]',
            ["body.limits", "planar"],
        ),
        (
            'place = { position = "0, 0, 1 m" }',
            'dh = { theta = "0 deg", d = "0 m", a = "0 m", alpha = "0 deg" }',
            ["links.body", "a planar joint has place and tail, not dh"],
        ),
    ],
)
def test_a_fault_of_a_joint_in_the_plane_is_reported(old, new, parts):
    message = refusal(CART, old, new)
    assert all(part in message for part in parts), message


def two(kind, first="", second=""):
    """A task of two tasks."""
    return f'kind = "{kind}"\ntasks = [{{ kind = "ibvs"{first} }}, {{ kind = "pbvs"{second} }}]'


def switch(when="", second=""):
    condition = when or 'kind = "error_below", value = 1'
    return (
        f'kind = "switch"\nfirst = {{ kind = "ibvs" }}\nsecond = {{ kind = "pbvs"{second} }}\n'
        f"when = {{ {condition} }}"
    )


POSTURE = 'kind = "ibvs"\nsecondary = { kind = "posture", q = %s }'
ANGLES = '"1 deg", "1 deg", "1 deg", "1 deg"'
WRONG_TASKS = [
    # kinds and their keys
    ('kind = "Switch"', ["task.kind", "mean 'switch'", "docking"]),
    ("kind = 3", ["task.kind", "no kind 3", "ibvs"]),
    ("gain = 1", ["task.kind", "missing", "'ibvs'", "'parallel'"]),
    ('kind = "pbvs"\nfeatures = "points"', ["task.features", "unknown key", "form"]),
    ('kind = "pbvs"\nfrom = "camera"', ["task.from", "mean 'form'"]),
    ('kind = "hybrid"\nform = "goal"', ["task.form", "unknown key", "mark"]),
    ('kind = "hybrid"\nmark = -1', ["task.mark", "whole number from 0 to 9999", "-1"]),
    ('kind = "partitioned"\nadvance = "3 cm"', ["task.advance", "3 cm", "unit of speed (m/s"]),
    ('kind = "partitioned"\nadvance = "3 deg/s"', ["task.advance", "3 deg/s", "unit of speed"]),
    ('kind = "partitioned"\nlaw = "camera"', ["task.law", "unknown key", "roll"]),
    ('kind = "partitioned"\nsegment = [1]', ["task.segment", "2 items", "[1]"]),
    ('kind = "placing"\ngain = 2', ["task.gain", "unknown key", "rotation"]),
    ('kind = "placing"\nvariant = "x"', ["task.variant", "'printed'", "'x'"]),
    ('kind = "docking"\nturn = "3"', ["task.turn", "number", "'3'"]),
    # features
    ('kind = "ibvs"\nfeatures = ["points", "piont"]', ["task.features[1]", "mean 'points'"]),
    ('kind = "ibvs"\nfeatures = []', ["task.features", "at least 1 item"]),
    ('kind = "ibvs"\nfeatures = [3]', ["task.features[0]", "a name", "got 3"]),
    ('kind = "ibvs"\nfeatures = {}', ["task.features.kind", "missing", "'sphere'"]),
    (
        'kind = "ibvs"\nfeatures = { kind = "sphere", raduis = "3 cm" }',
        ["task.features.raduis", "mean 'radius'"],
    ),
    (
        'kind = "ibvs"\nfeatures = [{ kind = "sphere", radius = "3 deg" }]',
        ["task.features[0].radius", "3 deg", "unit of length"],
    ),
    (
        'kind = "ibvs"\nfeatures = [{ kind = "points", radius = "3 cm" }]',
        ["task.features[0].radius", "unknown key", "marks"],
    ),
    (
        'kind = "ibvs"\nfeatures = [{ kind = "points", marks = [1, 1] }]',
        ["task.features[0]", "marks", "[1, 1]"],
    ),
    (
        'kind = "ibvs"\nfeatures = [{ kind = "points", camera = "eyy" }]',
        ["task.features[0].camera", "mean 'eye'"],
    ),
    ('kind = "ibvs"\ncamera = ["eye"]', ["task.camera", "2 items", "['eye']"]),
    ('kind = "ibvs"\ncamera = ["eye", "eyy"]', ["task.camera", "mean 'eye'"]),
    # interaction, depth, gain and their kin
    (
        'kind = "ibvs"\ninteraction = [[1, 2, 3, 4, 5]]',
        ["task.interaction", "matrix of 6 columns", "[[1, 2, 3, 4, 5]]"],
    ),
    ('kind = "ibvs"\ninteraction = { a = 1 }', ["task.interaction: must", "'mean'", "{'a': 1}"]),
    ('kind = "ibvs"\nbroyden_start = [[1]]', ["task", "broyden_start is for", '"broyden"']),
    (
        'kind = "ibvs"\ninteraction = "broyden"\nbroyden_start = [[1], [1, 2]]',
        ["task.broyden_start", "rows of one length", "[[1], [1, 2]]"],
    ),
    ('kind = "ibvs"\ndepth = { start = "3" }', ["task.depth.start", "unit of length"]),
    ('kind = "ibvs"\ndepth = { start = "3 mm" }', ["task.depth", "between 0.01 m"]),
    ('kind = "ibvs"\ndepth = { begin = "3 mm" }', ["task.depth.begin", "start_sigma"]),
    ('kind = "ibvs"\ngain = { at_zero = 1 }', ["task.gain.at_infinity", "missing"]),
    (
        'kind = "ibvs"\ngain = { at_zero = 1, at_infinity = 2, slope = 3 }',
        ["task.gain", "at_zero must be above"],
    ),
    ('kind = "ibvs"\ninverse = "transpose"\nrcond = 0.1', ["task", "rcond", '"pseudo_inverse"']),
    ('kind = "ibvs"\nlag = "3 s"', ["task", "lag", '"estimated"']),
    ('kind = "ibvs"\nfeed_forward = "estimated"\nlag = "3 m"', ["task.lag", "3 m", "unit of time"]),
    ('kind = "ibvs"\ngoal = { s = [] }', ["task.goal.s", "a list of one or more"]),
    ('kind = "ibvs"\ngoal = { s = [1], q = [] }', ["task.goal", "q and s: give one"]),
    # shaping of the command
    ('kind = "ibvs"\njoints = []', ["task.joints", "at least 1 item"]),
    ('kind = "ibvs"\nsecondary = {}', ["task.secondary.kind", "missing", "'posture'"]),
    (POSTURE % '["1 deg"]', ["task.secondary.q", "1 coordinates, expected 5", "upper_arm"]),
    (POSTURE % '["1 deg"]' + '\njoints = "wirst"', ["task.secondary.q", "mean 'wrist'"]),
    (POSTURE % f'[{ANGLES}, "1 cm"]', ["task.secondary.q[4]", "1 cm", "unit of angle"]),
    (POSTURE % f"[{ANGLES}, 1]", ["task.secondary.q[4]", "1:", '"90 deg" or "5 cm"']),
    (
        'kind = "ibvs"\nsecondary = { kind = "posture", q = [], margin = 1 }',
        ["task.secondary.margin", "unknown key", "gain"],
    ),
    ('kind = "ibvs"\nprojection = "big"', ["task.projection", "'large'", "'big'"]),
    ('kind = "ibvs"\nprojection = { low = 2 }', ["task.projection", "low must be below high"]),
    ('kind = "ibvs"\nlimit = {}', ["task.limit", "at least one of joint"]),
    ('kind = "ibvs"\nlimit = { joint = "3 deg" }', ["limit.joint", "3 deg", '"30 deg/s"']),
    ('kind = "ibvs"\nlimit = { joint = ["3 deg/s"] }', ["limit.joint", "1 velocities, expected 5"]),
    (
        f'kind = "ibvs"\nlimit = {{ joint = [{ANGLES.replace("deg", "deg/s")}, "1 cm/s"] }}',
        ["limit.joint[4]", "1 cm/s", "unit of turn rate (rad/s, deg/s)"],
    ),
    ('kind = "ibvs"\nlimit = { joint = ["-1 deg/s"] }', ["limit.joint[0]", "greater than 0"]),
    ('kind = "ibvs"\nlimit = { linear = "3 deg/s" }', ["limit.linear", "unit of speed"]),
    ('kind = "ibvs"\nlimit = { angular = "3 cm/s" }', ["limit.angular", "unit of turn rate"]),
    # tasks within tasks
    ('kind = "priorities"\ntasks = []', ["task.tasks", "2 items, not 0"]),
    ('kind = "parallel"', ["task.tasks", "missing"]),
    (two("priorities", ', law = "camera"'), ["task", "law='joint'"]),
    (two("priorities", second=", smooth_start = 1"), ["task", "Priorities(...) as a whole"]),
    (two("priorities", second=", gian = 1"), ["task.tasks[1].gian", "mean 'gain'"]),
    (two("priorities") + "\ngain = 1", ["task.gain", "unknown key", "rcond"]),
    (two("priorities").replace("pbvs", "switch"), ["task.tasks[1].kind", "'switch'", "hybrid"]),
    (two("parallel", second=', camera = "x"'), ["task.tasks[1].camera", "'x'", "eye"]),
    (two("parallel", second=", goal = { q = [] }"), ["task.tasks[1].goal.q", "expected 5"]),
    (two("parallel") + "\njoints = []", ["task.joints", "unknown key"]),
    (two("parallel", ", belief = 3"), ["task.tasks[0].belief", "[[belief.cameras]]", "3"]),
    ('kind = "switch"', ["task.first", "task.second", "task.when", "missing"]),
    (switch('kind = "errorbelow"'), ["task.when.kind", "mean 'error_below'", "near_border"]),
    (switch('kind = "near_border", margin = 3'), ["task.when.size", "missing"]),
    (switch() + "\nlatch = 1", ["task.latch", "true or false", "1"]),
    (
        switch(second=', secondary = { kind = "posture", q = ["1 m"] }'),
        ["task.second.secondary.q", "expected 5"],
    ),
    # motions
    (
        'kind = "ibvs"\n[[motions]]\nrobot = "rhino"\nrates = []',
        ["motions.rhino", "mean 'rhino_xr4"],
    ),
    ('kind = "ibvs"\n[[motions]]\nrobot = "rhino_xr4"', ["motions.rhino_xr4.rates", "missing"]),
    (
        'kind = "ibvs"\n[[motions]]\nrobot = "rhino_xr4"\nrates = ["1 rad/s"]',
        ["motions.rhino_xr4.rates", "1 velocities, expected 5", "upper_arm"],
    ),
    (
        f'kind = "ibvs"\n[[motions]]\nrobot = "rhino_xr4"\nrates = [{ANGLES}, "1 deg"]',
        ["motions.rhino_xr4.rates[0]", "1 deg", "unit of turn rate"],
    ),
]


@pytest.mark.parametrize("task,parts", WRONG_TASKS)
def test_a_fault_of_a_task_is_reported_with_its_key(task, parts):
    message = refusal(RHINO, 'kind = "ibvs"\ngain = 1.5', task)
    assert all(line.startswith("bench.toml: ") for line in message.splitlines())
    assert all(part in message for part in parts), message
    paths = [line.split(": ")[1] for line in message.splitlines()]
    assert len(set(paths)) == len(paths) <= 3, message


def test_two_tasks_for_one_joint_are_reported_when_they_are_bound():
    scenario = read(RHINO, 'kind = "ibvs"\ngain = 1.5', two("parallel"))
    with pytest.raises(
        rs.errors.FileError, match=r"^bench\.toml: task: two tasks command one joint: sh"
    ):
        scenario.check()


@pytest.mark.parametrize("levels", [70, 300])
def test_tasks_within_tasks_are_not_too_many(levels):
    task = '{ kind = "ibvs" }'
    for _ in range(levels):
        when = '{ kind = "error_below", value = 1 }'
        task = f'{{ kind = "switch", first = {{ kind = "ibvs" }}, second = {task}, when = {when} }}'
    start = time.perf_counter()
    assert "task.second.second" in refusal(f"task = {task}\n{FREE}")
    assert time.perf_counter() - start < 5


def test_ten_problems_are_reported_and_the_others_counted():
    many = "\n".join(f"key{i} = {i}" for i in range(12))
    lines = refusal(RHINO, "gain = 1.5", many).splitlines()
    assert len(lines) == 11
    assert all(f"bench.toml: task.key{i}: " in line for i, line in enumerate(lines[:10]))
    assert lines[10] == "bench.toml: and 2 more"


def test_problems_in_several_tables_are_reported_together():
    text = RHINO.replace("gain = 1.5", "gain = -1").replace('dt = "40 ms"', "dt = 3")
    assert [line.split(": ")[1] for line in refusal(text).splitlines()] == ["task.gain", "run.dt"]


@pytest.mark.parametrize(
    "what,item,most",
    [
        ("robots", "{ model = 'planar_2r', name = 'r%d' }", 64),
        ("objects", "{ name = 'o%d' }", 64),
        ("cameras", "{ name = 'c%d', focal = 1, center = [0, 0] }", 64),
        ("links", "{ name = 'l%d' }", 256),
        ("marks", "'0, 0, %d m'", 10_000),
    ],
)
def test_there_are_not_too_many(what, item, most):
    def text(count):
        items = "[" + ",".join(item % i for i in range(count)) + "]"
        inside = {
            "links": "robots = [{ name = 'r', links = %s }]",
            "marks": "objects = [{ name = 'o', marks = %s }]",
        }
        return f"schema = 1\n{inside.get(what, what + ' = %s') % items}\n"

    assert f"at most {most} items, not {most + 1}" in refusal(text(most + 1))
    assert "at most" not in refusal(text(most))  # only the task is missing
    assert "task: missing" in refusal(text(most))


def test_vertices_as_marks_are_not_too_many_either():
    wheel = "{ kind = 'wheel', radius = '1 m', width = '1 m', n = 4096 }"
    text = f"{RHINO}[[objects]]\nname = 'wheels'\nshapes = [{wheel}, {wheel}]\n"
    assert "objects.wheels: 16384 marks; at most 10000" in refusal(text)


# files that are none


def test_files_that_cannot_be_read(tmp_path):
    binary, latin, empty, large = (
        tmp_path / name for name in ("b.toml", "l.toml", "e.toml", "x.toml")
    )
    binary.write_bytes(bytes(range(256)))
    latin.write_bytes(RHINO.replace("Rhino over", "Rhino über").encode("latin-1"))
    empty.write_bytes(b"")
    large.write_bytes(b"#" * 4_000_001)
    for path, parts in [
        (tmp_path / "none.toml", ["none.toml", "no such file"]),
        (tmp_path, [tmp_path.name, "folder"]),
        (binary, ["b.toml", "UTF-8"]),
        (latin, ["l.toml", "byte", "UTF-8"]),
        (empty, ["e.toml", "empty"]),
        (large, ["x.toml", "2 MB"]),
        (tmp_path / ("n" * 300), ["nnn", "cannot read"]),
        (None, ["None", "cannot read"]),
    ]:
        for reader in (load_scenario, read_robot):
            with pytest.raises(rs.errors.FileError) as caught:
                reader(path)
            assert all(part in str(caught.value) for part in parts), str(caught.value)


def test_a_long_file_is_refused_in_time():
    many = "\n".join(f"key{i} = {i}" for i in range(100_000))
    start = time.perf_counter()
    assert "and 99990 more" in refusal(RHINO, "gain = 1.5", many)
    assert time.perf_counter() - start < 20


# faults that a run would find


def test_a_goal_out_of_sight_keeps_its_kind_and_names_the_file():
    scenario = read(RHINO, '"28, 0, 2.5 cm"', '"28, 100, 2.5 cm"')
    with pytest.raises(rs.errors.GoalError, match=r"^bench\.toml: task\.goal: .*'cube' .*'eye'"):
        scenario.check()
    with pytest.raises(rs.errors.GoalError, match=r"^bench\.toml: task\.goal: "):
        scenario.run()


def test_a_scene_in_which_nothing_moves_is_reported_with_the_file():
    scenario = read(RHINO, 'on = "rhino_xr4.tool"', "")
    with pytest.raises(
        rs.errors.FileError, match=r"^bench\.toml: task: no joint moves camera 'eye'"
    ):
        scenario.check()


def test_marks_on_a_line_are_a_warning_and_not_an_error():
    scenario = read(RHINO, ', "-2.5, -2.5, 2.5 cm", "2.5, -2.5, 2.5 cm"', "")
    with pytest.warns(rs.errors.RankWarning):
        scenario.check()


# anything else


def all_finite(scenario):
    q = scenario.scene.home if scenario.start is None else scenario.start
    numbers = [scenario.scene.tree.joints.place, q, *(o.marks for o in scenario.scene.objects)]
    return all(np.isfinite(array).all() for array in numbers)


def is_sound(text):
    """A Scenario that can be checked, written and read again, or a RobSimError."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rs.errors.RankWarning)
        try:
            scenario = Experiment.from_text(text, "bench.toml")
        except rs.errors.FileError as error:
            assert str(error).startswith("bench.toml: ")
            return
        assert all_finite(scenario)
        assert Experiment.from_text(scenario.to_toml()).to_toml() == scenario.to_toml()
        try:
            scenario.check()
        except (rs.errors.FileError, rs.errors.GoalError) as error:
            assert str(error).startswith("bench.toml: ")


def places(tables, path=()):
    """All paths of a nest of tables and lists."""
    items = tables.items() if isinstance(tables, dict) else enumerate(tables)
    for key, value in items:
        yield (*path, key)
        if isinstance(value, dict | list):
            yield from places(value, (*path, key))


TEXTS = [
    "1 m",
    "0 deg",
    "-5 cm",
    "1e300 m",
    "1e-300 s",
    "1e-320 cm",
    "1e9 m",
    "true",
    "world",
    "fly.body",
    "arm.plate",
    "eye",
    "\n1, 2, 3 cm",
    "0, 0, 0 deg",
    "revolute",
    "floating",
    "planar",
    "unicycle",
    "pbvs",
    "switch",
    "points",
    "1 cm/s",
    "1 deg/s",
    "",
]
VALUES = st.one_of(
    st.sampled_from(TEXTS),
    st.sampled_from([0, -1, 1, 3, 10**30, 2**64, 1e-300, 1e9, 1e308, math.nan, math.inf, True]),
    st.sampled_from([[], {}, [[]], [{}], [1.0, 2.0], [[1, 0, 0], [0, 1, 0], [0, 0, 1]]]),
    st.text(max_size=8),
    st.floats(),
    st.integers(),
)
BASES = st.sampled_from(
    [
        *(RHINO, RICH, FREE + 'task = { kind = "ibvs" }'),
        *(f"{STILL if 'wall' in text else ONE_EYE}\n[task]\n{text}" for text in TASKS),
        f'{BELT}\n[task]\nkind = "ibvs"\ncamera = "eye"',
    ]
)
QUIET = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])


def tried_with(**strategies):
    """A property is tried with 60 examples by default and with 250 if all tests run."""

    def decorate(holds):
        @pytest.mark.parametrize("count", [60, pytest.param(250, marks=pytest.mark.full)])
        def test(count):
            settings(QUIET, max_examples=count)(given(**strategies)(holds))()

        return test

    return decorate


@pytest.mark.full
@tried_with(data=st.data())
def test_a_scenario_with_changed_tables_is_read_or_refused(data):
    tables = tomllib.loads(data.draw(BASES))
    for _ in range(data.draw(st.integers(1, 3))):
        *path, last = data.draw(st.sampled_from(list(places(tables))))
        inside = tables
        for key in path:
            inside = inside[key]
        change = data.draw(st.sampled_from(["delete", "replace", "rename", "double"]))
        if change == "delete":
            del inside[last]
        elif change == "replace":
            inside[last] = deepcopy(data.draw(VALUES))
        elif change == "rename" and isinstance(inside, dict):
            inside[data.draw(st.sampled_from([*inside, "x", "name", "rpy", "K"]))] = inside.pop(
                last
            )
        elif isinstance(inside, list):
            inside.append(deepcopy(inside[last]))
    is_sound(tomli_w.dumps(tables))


@tried_with(data=st.data())
def test_a_scenario_with_changed_text_is_read_or_refused(data):
    text = data.draw(BASES)
    for _ in range(data.draw(st.integers(1, 3))):
        i = data.draw(st.integers(0, len(text)))
        j = min(len(text), i + data.draw(st.integers(0, 30)))
        inserted = data.draw(st.one_of(st.text(max_size=5), st.just(text[i:j] * 2)))
        text = text[:i] + inserted + text[j:]
    is_sound(text)


@pytest.mark.full
@tried_with(
    path=st.one_of(
        st.text(max_size=20), st.sampled_from(["task.gain", "run.seed", "robots.arm.home"])
    ),
    value=st.text(max_size=10),
)
def test_a_scenario_with_any_change_from_outside_is_read_or_refused(path, value):
    try:
        scenario = Experiment.from_text(RICH, set={path: value})
    except rs.errors.InputError:
        return
    assert Experiment.from_text(scenario.text).to_toml() == scenario.to_toml()
