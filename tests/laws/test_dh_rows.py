"""A joint that is made from a Denavit-Hartenberg row keeps the row; a robot keeps its origin."""

from dataclasses import replace

import numpy as np
import pytest

import robsim as rs

ROW = rs.joints.DHRow(0.3, 0.1, 0.5, -1.2)
K = [[800, 0, 320], [0, 800, 240], [0, 0, 1]]
TEXT = """
schema = 1
[[robots]]
model = "puma560"
name = "arm"
links = [{ name = "upper_arm", dh = { a = "43.2 cm" } }]
[[objects]]
name = "dots"
marks = ["40, 0, 0 cm", "50, 0, 0 cm", "50, 10, 0 cm", "40, 10, 0 cm"]
[[cameras]]
name = "eye"
on = "arm.flange"
focal = 800
size = [640, 480]
[task]
kind = "ibvs"
goal = { q = ["0 deg", "0 deg", "0 deg", "0 deg", "0 deg", "0 deg"] }
"""


@pytest.mark.parametrize("kind", ["fixed", "revolute", "prismatic"])
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_the_constants_of_a_joint_agree_with_its_row(kind, convention):
    row = replace(ROW, convention=convention)
    joint = rs.joints.Joint(kind, dh=row)
    place, tail = row.constants(kind == "revolute")
    assert joint.dh == row
    assert joint.place.matrix.tobytes() == place.matrix.tobytes()
    assert joint.tail.matrix.tobytes() == tail.matrix.tobytes()
    again = replace(joint, name="other")  # with the row and its poses, which agree
    assert (again.place, again.tail, again.dh) == (place, tail, row)


def test_a_row_and_the_poses_that_it_gives_are_two_joints():
    rowed = rs.joints.Joint("revolute", dh=ROW)
    posed = rs.joints.Joint("revolute", rowed.place, rowed.tail)
    assert rowed != posed and posed == rowed.with_constants(rowed.place, rowed.tail)
    arms = [
        rs.Robot("arm", [rs.joints.Link("base"), rs.joints.Link("tip", "base", j)])
        for j in (rowed, posed)
    ]
    assert arms[0] != arms[1]
    np.testing.assert_array_equal(*[arm.fk([0.4]) for arm in arms])


def test_a_row_is_replaced_with_the_constants():
    joint = rs.joints.Joint("revolute", dh=ROW, limits=(-1.0, 1.0))
    longer = joint.with_constants(dh=replace(ROW, a=0.6))
    assert longer.tail != joint.tail and longer.limits == joint.limits and longer.dh.a == 0.6
    moved = joint.with_constants(rs.Pose.at(1, 0, 0))
    assert moved.dh is None and moved.tail == rs.Pose.at() and moved.place.position[0] == 1.0


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"dh": [0, 0, 1, 0]}, "joint dh: expected a DHRow, got [0, 0, 1, 0]"),
        ({"kind": "floating", "dh": ROW}, "a floating joint has place and tail, not dh"),
        ({"dh": ROW, "tail": rs.Pose.at(1, 0, 0)}, "dh and place or tail: give one of the two"),
        ({"dh": ROW, "place": rs.joints.Joint(dh=ROW).place}, "dh and place or tail: give one"),
    ],
)
def test_an_invalid_row_is_refused(given, words):
    with pytest.raises(rs.errors.InputError) as caught:
        rs.joints.Joint(**{"kind": "revolute", **given})
    assert words in str(caught.value)


def test_a_row_holds_four_numbers_and_a_convention():
    with pytest.raises(rs.errors.InputError, match=r"DHRow\.a: expected a number"):
        rs.joints.DHRow(0, 0, "1", 0)
    with pytest.raises(rs.errors.InputError, match=r"no convention 'craig'; .*standard, modified"):
        rs.joints.DHRow(0, 0, 1, 0, "craig")


def test_robots_from_tables_keep_their_rows():
    arm = rs.Robot.from_dh([[0, 0, 1, 0], [0.1, 0.2, 0.3, 0.4]], "modified")
    assert [link.joint.dh for link in arm.links] == [
        None,
        rs.joints.DHRow(0, 0, 1, 0, "modified"),
        rs.joints.DHRow(0.1, 0.2, 0.3, 0.4, "modified"),
    ]
    assert rs.robots.panda().links[1].joint.dh.convention == "modified"


def test_the_rows_of_two_conventions_come_back_from_one_text():
    arm = rs.Robot.from_dh([[0, 0, 1, 0], [0.1, 0.2, 0.3, 0.4]], name="arm")
    tool = rs.Robot.from_dh([[0.5, 0.6, 0.7, 0.8]], "modified", name="tool")
    both = arm.with_tool(tool)
    scene = rs.Scene(
        robots=[both],
        objects=[rs.Object("dots", marks=np.eye(3))],
        cameras=[rs.MountedCamera("eye", rs.Camera(K, (640, 480)), "arm.link2")],
    )
    text = rs.Experiment(scene, rs.IBVS()).to_toml()
    (again,) = rs.Experiment.from_text(text).scene.robots
    assert again == both
    assert [link.joint.dh and link.joint.dh.convention for link in again.links] == [
        *(None, "standard", "standard"),
        *(None, "modified"),
    ]


def test_the_row_of_a_text_is_in_the_value():
    scenario = rs.Experiment.from_text(TEXT)
    row = scenario.scene.robot("arm").links[2].joint.dh
    assert row == replace(rs.robots.puma560().links[2].joint.dh, a=0.432)
    again = rs.Experiment.from_text(scenario.to_toml())
    assert again == scenario and again.scene.robot("arm").links[2].joint.dh == row
    named = {each.path for each in scenario.controls()}
    assert "robots.arm.links.upper_arm.dh.alpha" in named
    assert not any(".upper_arm.place" in path or ".upper_arm.tail" in path for path in named)


def test_a_wrong_row_is_believed_as_a_row():
    scene = rs.Experiment.from_text(TEXT).scene
    (believed,) = scene.believe(dh={"upper_arm": {"a": 0.001, "alpha": 0.01}}).robots
    true = scene.robot("arm").links[2].joint.dh
    wrong = believed.links[2].joint.dh
    assert wrong == replace(true, a=true.a + 0.001, alpha=true.alpha + 0.01)


def test_a_robot_keeps_where_it_was_read_from():
    arm = rs.robots.puma560()
    assert arm.origin.model == "puma560" and arm.origin.urdf is None
    assert replace(arm, origin=None) == arm
    scenario = rs.Experiment.from_text(TEXT)
    longer = scenario.at("robots.arm.links.upper_arm.dh.a", 0.5).with_(dt=0.01)
    for each in (arm.at(rs.Pose.at(1, 0, 0)), *scenario.scene.robots, *longer.scene.robots):
        assert each.origin == arm.origin
    assert rs.Robot.from_dh([[0, 0, 1, 0]]).origin is None


def test_a_robot_of_a_urdf_file_keeps_the_file(tmp_path):
    arm = rs.Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]], name="planar")
    arm.to_urdf(tmp_path / "planar.urdf")
    read = rs.Robot.from_urdf(tmp_path / "planar.urdf")
    assert read.origin.urdf == str(tmp_path / "planar.urdf")
    _, _, rest = TEXT.partition("[[objects]]")
    text = 'schema = 1\nrobots = [{ urdf = "planar.urdf", name = "arm" }]\n[[objects]]' + rest
    text = text.replace("flange", "link2").replace(', "0 deg"' * 4, "")
    scenario = rs.Experiment.from_text(text, str(tmp_path / "here.toml"))
    assert scenario.scene.robot("arm").origin == read.origin
