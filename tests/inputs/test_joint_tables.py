"""The keys of joints in a file: each mistake gives one line with its place and a valid value."""

import numpy as np
import pytest

import robsim as rs
from robsim.run.experiment import Experiment

CABLE = 'kind = "catenary", start = "0, 0 m", end = "9, 1 m", length = "10 m"'
OF = 'kind = "chord", of = "rear"'
TEXT = f"""
schema = 1
[[robots]]
name = "train"
[[robots.links]]
name = "floor"
[[robots.links]]
name = "car"
joint = "car"
joint_name = "drive"
steering = {{ wheelbase = "30 cm", limit = "24 deg", rate = "90 deg/s" }}
[[robots.links]]
name = "pivot"
parent = "car"
joint = "revolute"
place = {{ position = "30, 10, 5 cm" }}
follows = {{ kind = "ackermann", of = "drive.steering" }}
[[robots.links]]
name = "wheel"
parent = "pivot"
joint = "revolute"
place = {{ rpy = "-90, 0, 0 deg" }}
follows = {{ kind = "rolling", radius = "5 cm" }}
[[robots.links]]
name = "finger"
parent = "car"
joint = "prismatic"
speed = "10 cm/s"
effort = 20
limits = ["0 cm", "4 cm"]
[[robots.links]]
name = "other"
parent = "car"
joint = "prismatic"
follows = {{ kind = "mimic", of = "finger", ratio = -0.5, offset = "1 mm" }}
[[robots.links]]
name = "rear"
parent = "floor"
joint = "rail"
curve = {{ {CABLE} }}
[[robots.links]]
name = "body"
joint = "revolute"
follows = {{ {OF}, length = "50 cm", radius = "4 cm", at = "20 cm", gives = "angle" }}
[[objects]]
name = "dot"
marks = ["0, 0, 1 m"]
[[cameras]]
name = "eye"
on = "train.car"
focal = 500
size = [640, 480]
[task]
kind = "ibvs"
"""


def read(old="", new=""):
    assert old in TEXT
    return Experiment.from_text(TEXT.replace(old, new, 1), "train.toml").scene.robot()


def test_all_keys_have_the_values_of_the_file():
    joints = {link.name: link.joint for link in read().links}
    assert joints["car"].steering == rs.joints.Steering(0.3, np.radians(24), np.radians(90))
    assert joints["car"].name == "drive" and joints["pivot"].follows.of == "drive.steering"
    assert joints["wheel"].follows == rs.joints.Rolling(0.05)
    assert (joints["finger"].speed, joints["finger"].effort) == (0.1, 20.0)
    assert joints["other"].follows == rs.joints.Mimic("finger", -0.5, 0.001)
    assert joints["rear"].curve == rs.shapes.curves.Catenary((0, 0), (9, 1), 10)
    assert joints["rear"].limits == (0.0, 10.0)
    assert joints["body"].follows == rs.joints.Chord("rear", 0.5, 0.04, 0.2, "angle")
    names = ["drive.x", "drive.y", "drive.theta", "drive.steering", "wheel", "finger", "rear"]
    assert list(read().coordinate_names) == names


@pytest.mark.parametrize(
    ("table", "curve"),
    [
        ('kind = "line", length = "2 m"', rs.shapes.curves.Line(2.0)),
        ('kind = "arc", radius = "2 m", angle = "-90 deg"', rs.shapes.curves.Arc(2.0, -np.pi / 2)),
        (
            'kind = "polyline", points = ["0, 0 cm", "1, 0 m", "1, 1 m"], radius = "20 cm"',
            rs.shapes.curves.Polyline([(0, 0), (1, 0), (1, 1)], 0.2),
        ),
    ],
)
def test_a_rail_may_follow_other_curves(table, curve):
    assert read(CABLE, table).links[-2].joint.curve == curve


MISTAKES = {
    "a length without unit": ('"30 cm"', '"30"', "car.steering.wheelbase: '30': expected one"),
    "a wheelbase below zero": ('"30 cm"', '"-30 cm"', "car.steering.wheelbase: must be greater"),
    "no wheelbase": ('wheelbase = "30 cm", ', "", "car.steering.wheelbase: missing"),
    "a right angle": ('"24 deg"', '"90 deg"', "car.steering: steering limit must be below a right"),
    "a length for an angle": ('"24 deg"', '"24 cm"', "car.steering.limit: '24 cm': expected one"),
    "an angle for a rate": ('"90 deg/s"', '"90 deg"', "car.steering.rate: '90 deg': expected one"),
    "no rate": ('"90 deg/s"', '"0 deg/s"', "car.steering.rate: must be greater than 0"),
    "an unknown key": ("rate =", "rat =", "car.steering.rat: unknown key 'rat'; did you mean 'ra"),
    "a car without steering": ("steering = {", "# {", "car: a car joint needs a steering"),
    "steering without a car": (
        '"car"\njoint_n',
        '"unicycle"\njoint_n',
        "has no steering; only a car",
    ),
    "no table": (
        "steering = { wheel",
        'steering = "30 cm" # { wheel',
        "must be a table, got '30 cm'",
    ),
    "a name with a space": ('"drive"', '"dri ve"', "car.joint_name: name 'dri ve': a name starts"),
    "a speed of a car": (
        'joint_name = "drive"',
        'speed = "1 m/s"',
        "car.speed: a car joint has no such number",
    ),
    "an effort of a car": ('joint_name = "drive"', "effort = 1", "a car joint has no effort; only"),
    "limits of a car": (
        'joint_name = "drive"',
        'limits = ["0 m", "1 m"]',
        "car.limits: a car joint",
    ),
    "an unknown kind": ("ackermann", "akermann", "pivot.follows.kind: no kind 'akermann'; did you"),
    "no such coordinate": (
        "drive.steering",
        "car.steering",
        "links: 'pivot' follows 'car.steering'",
    ),
    "no steering angle": (
        '"drive.steering"',
        '"finger"',
        "links: 'pivot' must follow the steering",
    ),
    "a knuckle that leans": (
        '"30, 10, 5 cm"',
        '"30, 10, 5 cm", rpy = "5, 0, 0 deg"',
        "links: 'wheel': its steering joint must turn about the vertical",
    ),
    "a wheel that lies": ('place = { rpy = "-90, 0, 0 deg" }', "", "links: 'wheel': its axis must"),
    "no radius": ('"rolling", radius = "5 cm"', '"rolling"', "wheel.follows.radius: missing"),
    "a wheel on the floor": (
        'parent = "pivot"',
        'parent = "floor"',
        "stands on no vehicle (unicycle",
    ),
    "a speed in metres": ('"10 cm/s"', '"10 cm"', "finger.speed: '10 cm': expected one number"),
    "a speed of another kind": ('"10 cm/s"', '"1 deg/s"', "finger.speed: '1 deg/s': expected one"),
    "a speed backwards": ('"10 cm/s"', '"-1 cm/s"', "finger.speed: must be greater than 0"),
    "no effort": ("effort = 20", "effort = 0", "finger.effort: must be greater than 0"),
    "friction that drives": (
        "effort = 20",
        "friction = -1",
        "finger.friction: must be greater than or equal to 0",
    ),
    "damping of a car": ('joint_name = "drive"', "damping = 1", "a car joint has no damping; only"),
    "nobody to mimic": (
        'of = "finger"',
        'of = "fingr"',
        "follows 'fingr', which does not exist; did",
    ),
    "itself to mimic": ('of = "finger"', 'of = "other"', "links: 'other' follows itself"),
    "a wheel to mimic": (
        'of = "finger"',
        'of = "wheel"',
        "links: 'other' must follow one coordinate",
    ),
    "a ratio in words": ("-0.5", '"half"', "other.follows.ratio: must be a valid number"),
    "a ratio that is none": ("-0.5", "nan", "other.follows.ratio: must be a finite number"),
    "an offset of another kind": ('"1 mm"', '"1 deg"', "other.follows.offset: '1 deg': expected"),
    "limits that exclude each other": (
        'follows = { kind = "mimic"',
        'limits = ["5 cm", "6 cm"]\nfollows = { kind = "mimic"',
        "links: joint 'finger' of 'train' and the joints that mimic it are never within their "
        "limits at once",
    ),
    "an unknown curve": ("catenary", "catenry", "rear.curve.kind: no kind 'catenry'; did you mean"),
    "a cable too short": ('"10 m"', '"9 m"', "rear.curve: a catenary of 9 m does not hang"),
    "a point in space": ('"0, 0 m"', '"0, 0, 0 m"', "rear.curve.start: '0, 0, 0 m' has 3 numbers"),
    "no curve": ("curve = {", "# {", "rear: a rail joint needs a curve"),
    "a curve without rail": ('"rail"', '"prismatic"', "rear: a prismatic joint has no curve"),
    "one point": (
        CABLE,
        'kind = "polyline", points = ["0, 0 m"], radius = "1 m"',
        "rear.curve.points: must have at least 2 items, not 1",
    ),
    "an arc without angle": (
        CABLE,
        'kind = "arc", radius = "1 m", angle = "0 deg"',
        "rear.curve: angle of an arc (radians) must not be 0",
    ),
    "a chord of no rail": (
        'of = "rear"',
        'of = "finger"',
        "'body' must follow a rail that follows no",
    ),
    "a place beyond the chord": (
        'at = "20 cm"',
        'at = "60 cm"',
        "at must not exceed its length 0.5",
    ),
    "an angle with a typo": ('"angle"', '"angel"', "body.follows.gives: must be 'angle', 'arc'"),
    "an arc that turns": (
        'gives = "angle"',
        'gives = "arc"',
        "Chord gives a length, which is no coordinate of a revolute",
    ),
    "a plane that follows": (
        'joint = "revolute"\nfollows = { kind = "chord"',
        'joint = "planar"\nfollows = { kind = "chord"',
        "body: a planar joint cannot follow others; prismatic, rail, revolute can",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_one_line_that_names_its_place(mistake):
    old, new, told = MISTAKES[mistake]
    with pytest.raises(rs.errors.FileError) as caught:
        read(old, new)
    message = str(caught.value)
    assert message.startswith("train.toml: robots.train.links") and told in message
    assert "\n" not in message
