"""URDF files: refusals and their messages; elements that are read with a warning; the result."""

import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import robsim as rs

CORPUS = Path(__file__).parent / "urdf"
MOMENTS = '<inertia ixx="1" iyy="2" izz="2.5" ixy="0.1" ixz="0" iyz="0"/>'
INERTIAL = f'<inertial><origin xyz="0 0 0.1"/><mass value="2"/>{MOMENTS}</inertial>'
ARM = f"""<?xml version="1.0"?>
<robot name="arm">
  <material name="blue"><color rgba="0 0 1 1"/></material>
  <link name="base"/>
  <link name="upper">{INERTIAL}
    <visual name="tube">
      <origin xyz="0 0 0.2" rpy="0.1 0.2 0.3"/>
      <geometry><cylinder radius="0.05" length="0.4"/></geometry>
      <material name="blue"/>
    </visual>
    <collision><geometry><box size="1 1 1"/></geometry></collision>
  </link>
  <link name="lower">
    <collision>
      <geometry><mesh filename="package://arm/lower.stl" scale="1 1 2"/></geometry>
    </collision>
  </link>
  <link name="finger"/>
  <joint name="shoulder" type="revolute">
    <origin xyz="0 0 1" rpy="0 0 1.5"/>
    <parent link="base"/>
    <child link="upper"/>
    <axis xyz="0 1 0"/>
    <limit lower="-1.5" upper="2" effort="10" velocity="3"/>
    <dynamics damping="0.1"/>
  </joint>
  <joint name="elbow" type="continuous">
    <parent link="upper"/>
    <child link="lower"/>
    <axis xyz="0.6 0 0.8"/>
  </joint>
  <joint name="grip" type="prismatic">
    <parent link="lower"/>
    <child link="finger"/>
    <limit upper="0.04" effort="1" velocity="0"/>
    <mimic joint="elbow" multiplier="0.01" offset="0.02"/>
  </joint>
  <gazebo reference="upper"><mu1>0.2</mu1></gazebo>
</robot>
"""


@pytest.fixture
def read(tmp_path):
    """The robot of a text, changed here and there."""

    def made(text=ARM, old="", new="", **said):
        assert old in text
        path = tmp_path / "arm.urdf"
        changed = text.replace(old, new, 1)
        path.write_bytes(changed if isinstance(changed, bytes) else changed.encode())
        return rs.Robot.from_urdf(path, **said)

    return made


def get_refusal(read, *change, text=ARM):
    with pytest.raises(rs.errors.FileError) as caught:
        read(text, *change)
    return str(caught.value)


# refusals

CORPUS_SAYS = {
    "01_billion_laughs": "a DOCTYPE is not allowed, nor are the entities that it could define",
    "02_xxe_file": "a DOCTYPE is not allowed",
    "03_mesh_traversal": "<link 'a'> <visual> <geometry> <mesh>: mesh 'package://p/../",
    "03b_mesh_absolute": "mesh '/opt/outside/secret.obj': absolute, or not a file name",
    "04_cycle": "a loop: 'a' is its own ancestor",
    "05_two_roots": "<robot 'r'>: 2 links have no parent: 'a', 'b'; one is allowed",
    "06_two_parents": "<joint 'j2'>: 'c' is also the child of <joint 'j1'> in line 1",
    "07_dup_joint": "<joint 'j'>: line 1 has a joint of the same name",
    "08_dup_link": "<link 'b'>: line 1 has a link of the same name; one is allowed",
    "09_nan_origin": "<joint 'j'> <origin>: xyz = 'nan 0 0': every number must be finite",
    "10_inf_1e400": "<joint 'j'> <origin>: xyz = '1e400 0 0': every number must be finite",
    "11_zero_axis": "<joint 'j'> <axis>: the axis is zero; a revolute joint needs one",
    "13_no_limit": "<joint 'j'>: <limit> is missing; a revolute joint needs lower and upper",
    "14_lower_gt_upper": "<joint 'j'> <limit>: lower 1 is above upper -1; it must be below",
    "15_bad_type": "<joint 'j'>: no joint type 'revolut'; did you mean 'revolute'? types: fixed",
    "16_two_numbers": "<joint 'j'> <origin>: xyz = '0 1': expected 3 numbers, got 2",
    "17_comma_decimal": "xyz = '0,5 0 0': '0,5' is no number; a decimal point is allowed",
    "18_missing_parent": "<joint 'j'>: parent: no link 'zzz'",
    "19_self_mimic": "<joint 'j'>: mimics itself; follow another joint",
    "20_mimic_missing": "<joint 'j'>: mimic: no joint 'nope'",
    "21_self_joint": "<joint 'j'>: parent and child are both 'a'; join two links",
    "23_empty": "empty; expected a URDF file",
    "24_unknown_attr": "<origin>: unknown attribute 'xzy'; did you mean 'xyz'? xyz, rpy",
}


@pytest.mark.parametrize("name", CORPUS_SAYS)
def test_a_bad_file_is_refused_with_its_line_and_reason(name):
    path = CORPUS / f"{name}.urdf"
    with pytest.raises(rs.errors.FileError) as caught:
        rs.Robot.from_urdf(path)
    where, what = str(caught.value).split(".urdf", 1)
    assert where == str(path.with_suffix("")) and CORPUS_SAYS[name] in what
    assert what.startswith(":1: ") or name == "23_empty"


def test_the_rest_of_the_corpus_is_read():
    good = {path.stem for path in CORPUS.glob("*.urdf")} - set(CORPUS_SAYS)
    assert good == {"00_good", "12_nonunit_axis"}
    arm = rs.Robot.from_urdf(CORPUS / "00_good.urdf")
    with pytest.warns(
        rs.errors.FileWarning, match="<joint 'j'> <axis>: the axis has length 2, and is"
    ):
        other = rs.Robot.from_urdf(CORPUS / "12_nonunit_axis.urdf")
    assert arm == other and arm.coordinate_names == ("j",)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('rpy="0 0 1.5"', 'rpy="0 0 inf"', ":20: <joint 'shoulder'> <origin>: rpy = '0 0 inf'"),
        ('rpy="0 0 1.5"', 'rpy="0 0 1_5"', "'1_5' is no number"),
        ('rpy="0 0 1.5"', 'rpy="0 0 ${pi}"', "an expression of xacro; expand the file first"),
        (
            'rpy="0 0 1.5"',
            'quat_xyzw="0 0 0 1"',
            "unknown attribute 'quat_xyzw'; did you mean 'rpy'",
        ),
        ('xyz="0 0 1"', 'xyz="0 0 1e10"', "at most 1e+09 is allowed"),
        ('<axis xyz="0 1 0"/>', "<axis/>", "<joint 'shoulder'> <axis>: xyz is missing"),
        ('<axis xyz="0 1 0"/>', '<axi xyz="0 1 0"/>', "unknown element; did you mean 'axis'?"),
        ('<axis xyz="0 1 0"/>', '<axis xyz="0 1 0"/>' * 2, "there is one already"),
        ('lower="-1.5"', 'lower="2"', "lower and upper are both 2; write type 'fixed', or let it"),
        ('velocity="3"', 'velocty="3"', "unknown attribute 'velocty'; did you mean 'velocity'?"),
        ('velocity="3"', 'velocity="-3"', "velocity is -3; it must not be below 0"),
        ('velocity="3"', 'velocity="inf"', "velocity = 'inf': every number must be finite"),
        ('<parent link="base"/>', "", "<joint 'shoulder'>: <parent> is missing"),
        ('<parent link="base"/>', "<parent/>", "<joint 'shoulder'> <parent>: link is missing"),
        ('link="base"', 'link="bass"', "parent: no link 'bass'; did you mean 'base'?"),
        ('type="continuous"', "", "<joint 'elbow'>: type is missing"),
        ('type="continuous"', 'type="floating"', "mimic: 'elbow' is floating, and has no single"),
        ('type="prismatic"', 'type="planar"', "a planar joint cannot follow another"),
        ('joint="elbow"', 'joint="grip"', "<joint 'grip'>: mimics itself"),
        ('name="arm"', "", "<robot>: name is missing"),
        ('name="arm"', 'name=""', "<robot ''>: name is missing"),
        ('name="lower"', 'name="ba.e"', "parent: no link 'lower'"),
        ('value="2"', 'value="-2"', "<link 'upper'> <inertial> <mass>: value is -2"),
        ('ixx="1"', 'ixx="1 2"', "ixx = '1 2': expected one number, got more"),
        ('ixx="1"', "", "<inertia>: ixx is missing"),
        ('radius="0.05"', 'radius="-1"', "<cylinder>: radius is -1; it must be above 0"),
        ('size="1 1 1"', 'size="1 1 -1"', "size: three numbers above 0 are allowed"),
        ('<box size="1 1 1"/>', "", "<geometry> is missing or empty"),
        ('<box size="1 1 1"/>', '<sphere radius="1"/>' * 2, "2 shapes; only one is allowed"),
        ('scale="1 1 2"', 'scale="1 1 0"', "three numbers other than 0"),
        ("package://arm/lower.stl", "", "<mesh>: filename is missing"),
        ("package://arm/lower.stl", "package://arm/../lower.stl", "leaves its package by '..'"),
        ("package://arm/lower.stl", "/lower.stl", "'/lower.stl': absolute, or not a file name"),
        ("package://arm/lower.stl", "C:\\\\lower.stl", "absolute, or not a file name"),
        ('scale="1 1 2"', 'scale="1 1 x"', "scale = '1 1 x': 'x' is no number"),
        (
            "</robot>",
            '<robsim tip="fingr"/></robot>',
            "tip: no link 'fingr'; did you mean 'finger'?",
        ),
        ("</robot>", "<robsim/></robot>", ":39: <robsim>: tip is missing"),
        ('name="base"', 'name="${side}_base"', "name = '${side}_base': an expression of xacro"),
        ('link="base"', 'link="${side}_base"', "link = '${side}_base': an expression of xacro"),
        ('rgba="0 0 1 1"', 'rgba="0 0 255 1"', "rgba: four numbers from 0 to 1 are allowed"),
        ('<link name="base"/>', '<xacro:tool name="x"/>', "xacro is not read; expand it"),
        ("<robot", "<sdf", ":39: not valid XML: mismatched tag"),
        ("</gazebo>", "</gazeb>", ":38: not valid XML: mismatched tag"),
        (
            '<?xml version="1.0"?>',
            '<?xml version="1.0" encoding="UTF-33"?>',
            "encoding 'UTF-33'; expected",
        ),
        ('lower="-1.5" upper="2"', 'lower="1e18" upper="1e19"', "at most 1e+09 is allowed"),
        ('multiplier="0.01"', 'multiplier="0.01\u00a0"', "is no number"),
        ('<?xml version="1.0"?>', "<!DOCTYPE robot []>", ":1: a DOCTYPE is not allowed"),
    ],
)
def test_a_mistake_is_reported_with_its_line_its_element_and_valid_values(read, old, new, message):
    assert message in get_refusal(read, old, new)


def test_all_mistakes_are_reported_at_once(read):
    text = ARM.replace('lower="-1.5"', 'lower="3"').replace('"0.6 0 0.8"', '"0 0 0"')
    lines = get_refusal(read, 'link="finger"', 'link="fingr"', text=text).split("\n")
    assert [line.split("arm.urdf:")[1].split(":")[0] for line in lines] == ["24", "30", "32"]


def test_a_file_of_mistakes_is_not_read_to_its_end(read):
    many = '<link name="a"><visual/></link>\n' * 1000
    lines = get_refusal(read, text=f'<robot name="r">{many}</robot>').split("\n")
    assert len(lines) == 51 and "was not read further" in lines[-1]


def test_a_chain_that_only_looks_like_our_second_link_keeps_its_place(read):
    """A root that is called as those links are that a joint of ours takes to write."""
    tail = '<joint name="b.tail" type="fixed"><parent link="b.axis"/><child link="b"/>'
    text = f'<robot name="r"><link name="b.axis"/><link name="b"/>{tail}<origin xyz="1 2 3"/>'
    with pytest.warns(rs.errors.FileWarning, match="its name is read as 'b_axis'"):
        robot = read(f"{text}</joint></robot>")
    assert robot.fk([], "b")[:3, 3].tolist() == [1, 2, 3]


def test_a_joint_that_hardly_follows_another_does_not_hold_it(read):
    arm = read(ARM, 'multiplier="0.01"', 'multiplier="1e-320"')
    assert arm.limits[1].tolist() == [-np.inf, np.inf]


def test_loops_of_mimics_end(read):
    text = ARM.replace(
        '<axis xyz="0.6 0 0.8"/>', '<axis xyz="0.6 0 0.8"/><mimic joint="grip" multiplier="2"/>'
    )
    assert "mimics itself" in get_refusal(read, text=text)


def test_names_that_become_the_same_are_refused(read):
    text = ARM.replace('link="lower"', 'link="up/er"').replace('name="lower"', 'name="up/er"')
    text = text.replace('name="upper"', 'name="up_er"').replace('link="upper"', 'link="up_er"')
    assert "line 5 has the same converted name 'up_er'" in get_refusal(read, text=text)


@pytest.mark.parametrize("text", ["", "  \n", "robot", "<robot", "<a/>", "\0", "<robot name='r'/>"])
def test_an_invalid_robot_is_refused(read, text):
    assert "arm.urdf" in get_refusal(read, text=text)


def test_a_file_that_cannot_be_read_is_refused(tmp_path):
    for path in (tmp_path / "none.urdf", tmp_path, 3, "a\0b", None):
        with pytest.raises(rs.errors.FileError):
            rs.Robot.from_urdf(path)


def test_a_file_of_100_megabytes_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "large.urdf"
    with open(path, "wb") as file:
        file.truncate(100_000_000)
    with pytest.raises(rs.errors.FileError, match="urdf: larger than 4 MB"):
        rs.Robot.from_urdf(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<a>" * 100_000, "nested more than 64 deep"),
        ("<robot name='r'>" + "<gazebo/>" * 100_001 + "</robot>", "more than 100000 elements"),
        ("<robot name='r'>" + "<rumour/>" * 1001 + "</robot>", "more than 1000 oddities"),
        ("<robot name='r'>" + "<link name='a'/>" * 2049 + "</robot>", "from 1 to 2048 are allowed"),
    ],
)
def test_a_file_that_is_too_large_is_refused(read, text, message):
    assert message in get_refusal(read, text=text)


@pytest.mark.parametrize("digits", ["1" * 100_000, "1" * 1_000_000 + "e", "0." + "0" * 200_000])
def test_endless_numbers_are_refused_at_once(read, digits):
    start = time.perf_counter()
    assert "xyz = '" in get_refusal(read, 'xyz="0 0 1"', f'xyz="{digits} 0 0"')
    assert time.perf_counter() - start < 1.0


# elements that are read otherwise than written, with a warning


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name="tube"', 'name="tube" mood="calm"', "unknown attribute 'mood', left out"),
        ("</gazebo>", "</gazebo><rumour/>", ":38: <rumour>: unknown element, left out"),
        ('xyz="0 1 0"', 'xyz="0 5 0"', "the axis has length 5, and is read with length 1"),
        ('velocity="3"', "", "velocity is missing, which the specification requires"),
        ('lower="-1.5" upper="2"', "", "lower 0 and upper 0 are read as without limits"),
        ('lower="-1.5" upper="2"', 'lower="-1e16" upper="1e16"', "are read as without limits"),
        ('izz="2.5"', 'izz="9"', "none can exceed the sum of the other two; kept"),
        ('value="2"', 'value="0"', "without mass; only one can be above 0 then; kept"),
        ('name="arm"', 'name="2 arms"', "its name is read as 'robot_2_arms'"),
        ('<mass value="2"/>', "", ":5: <link 'upper'> <inertial>: without <mass>, left out"),
        (INERTIAL, "<inertial/>", "<inertial>: without <mass>, left out"),
        (MOMENTS, "", "<inertial>: without <inertia>, read as the mass of a point"),
        ('damping="0.1"', 'damping="-1"', "<dynamics>: damping is -1, which would drive the joint"),
        ('damping="0.1"', 'D="0.1"', "<dynamics>: unknown attribute 'D', left out"),
        ('ixy="0.1"', 'ixy="0.1" iyx="0.1"', "attribute 'iyx' repeats an entry of the tensor"),
        ('radius="0.05"', 'radius="0"', "<cylinder>: radius is 0, so nothing is visible"),
        ('length="0.4"', 'length="0"', "length is 0, so nothing is visible; left out"),
        ("package://arm/lower.stl", "../../lower.stl", "leaves its package by '..'"),
        ("package://arm/", "file://../../", "leaves its package by '..'"),
        ("package://arm/", "$(find arm)/", ":15: <link 'lower'> <collision> <geometry> <mesh>:"),
        ("package://arm/", "$(find arm)/", "'$(find arm)/lower.stl': an expression of xacro"),
        ('scale="1 1 2"', 'scale="1 1 2 1"', "scale = '1 1 2 1': expected 3 numbers; left out"),
    ],
)
def test_oddities_are_reported_in_one_warning(read, old, new, message):
    with pytest.warns(rs.errors.FileWarning) as caught:
        read(ARM, old, new)
    assert len(caught) == 1 and message in str(caught[0].message)
    assert caught[0].filename == __file__


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('<geometry><box size="1 1 1"/></geometry>', '<geometry><box size="0 1 1"/></geometry>'),
        ("package://arm/lower.stl", "../../../lower.stl"),
        (' ixy="0.1"', ' ixy="0.1" iyx="0.1" izx="0" izy="0"'),
        (INERTIAL, "<inertial/>"),
    ],
)
def test_left_out_elements_change_no_pose(read, old, new):
    arm, q = read(), [0.3, 1.2]
    with pytest.warns(rs.errors.FileWarning, match="left out"):
        other = read(ARM, old, new)
    np.testing.assert_array_equal(other.frames(q), arm.frames(q))
    kept = [(len(k.shapes), k.inertia is not None) for k in other.links]
    assert kept[1:3] == [(1, old != INERTIAL), (int("lower.stl" not in old), False)]


def test_collision_shapes_are_shown_if_the_visual_ones_are_left_out(read):
    with pytest.warns(rs.errors.FileWarning, match="radius is 0"):
        arm = read(ARM, 'radius="0.05"', 'radius="0"')
    assert arm.links[1].shapes == (rs.Block(1, 1, 1),)


def test_a_long_name_is_shortened_and_stays_its_own(read):
    """Two names that begin alike, of a link and a joint that others name."""
    long = "upper_" * 20
    text = ARM.replace('name="upper"', f'name="{long}"').replace('link="upper"', f'link="{long}"')
    text = text.replace('"lower"', f'"{long}2"').replace('"elbow"', f'"{long}"')
    with pytest.warns(
        rs.errors.FileWarning,
        match=r"its name is read as 'upper_.*which is short enough .*in line 13",
    ):
        arm = read(text)
    first, second = arm.links[1].name, arm.links[2].name
    assert len(first) == len(second) == 64 and first[:55] == second[:55] == long[:55]
    assert first != second == arm.links[3].parent and arm.links[2].parent == first
    assert arm.links[3].joint.follows.of == arm.coordinate_names[1] == first
    np.testing.assert_array_equal(arm.frames([0.3, 1.2]), read().frames([0.3, 1.2]))


def test_a_warning_has_one_message_of_each_kind_and_the_lines_of_the_others(read):
    rumours = "\n".join(["<rumour/>"] * 3)
    with pytest.warns(rs.errors.FileWarning) as caught:
        read(ARM.replace('name="tube"', 'name="tube" mood=""'), "</gazebo>", f"</gazebo>{rumours}")
    rumour, mood = sorted(str(caught[0].message).split("\n"), key=lambda line: "mood" in line)
    assert rumour.endswith(
        "<rumour>: unknown element, left out (2 more of the kind, in lines 39, 40)"
    )
    assert mood.endswith("unknown attribute 'mood', left out")


def test_a_warning_lists_ten_kinds_of_oddities_and_counts_the_others(read):
    with pytest.warns(rs.errors.FileWarning) as caught:
        read(ARM, "</gazebo>", "</gazebo>" + "".join(f"<rumour{c}/>" for c in "abcdefghijkl"))
    lines = str(caught[0].message).split("\n")
    assert len(lines) == 11 and lines[-1].endswith("and 2 more")


PAIR = """<robot name="pair"><link name="base"/><link name="a"/><link name="b"/><link name="c"/>
<joint name="one" type="prismatic"><parent link="base"/><child link="a"/>
<limit lower="0" upper="0.04" effort="1" velocity="1"/></joint>
<joint name="two" type="prismatic"><parent link="base"/><child link="b"/>
<limit lower="0" upper="0.03" effort="1" velocity="1"/><mimic joint="one"/></joint>
<joint name="three" type="prismatic"><parent link="base"/><child link="c"/>
<limit lower="0" upper="0.04" effort="1" velocity="1"/><mimic joint="two" multiplier="-1"/></joint>
</robot>"""


def test_limits_of_mimics_that_leave_no_room_are_left_out(read):
    """As the gripper of the PR2 has them: then its fingers could not move at all."""
    with pytest.warns(
        rs.errors.FileWarning, match=r":6: <joint 'three'>: its limits leave joint 'one'"
    ):
        pair = read(PAIR, tip="a")
    assert pair.limits.tolist() == [[0, 0.03]]
    assert [k.joint.limits for k in pair.links[1:]] == [(0, 0.04), (0, 0.03), None]
    with pytest.warns(rs.errors.FileWarning, match="no room"):
        pair = read(PAIR, 'joint="one"', 'joint="one" offset="9"', tip="a")
    assert pair.limits[0, 1] == 0.04


def test_a_link_called_world_gets_another_name(read):
    text = ARM.replace('name="base"', 'name="world"').replace('link="base"', 'link="world"')
    with pytest.warns(rs.errors.FileWarning, match="its name is read as 'world_link'"):
        arm = read(text)
    assert arm.links[0].name == "world_link" == arm.links[1].parent


# the tip, and home


def tree(*links):
    """A file of links: (name, parent, type of the joint)."""
    limit = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
    joints = "".join(
        f'<joint name="j_{name}" type="{kind}"><parent link="{parent}"/><child link="{name}"/>'
        f"{'' if kind == 'fixed' else limit}</joint>"
        for name, parent, kind in links
    )
    names = "".join(f'<link name="{name}"/>' for name in ["base_link", *(k[0] for k in links)])
    return f'<robot name="r">{names}{joints}</robot>'


TWO = [("upper", "base_link", "revolute"), ("lower", "upper", "revolute")]


@pytest.mark.parametrize(
    ("links", "tip"),
    [
        ([*TWO, ("tool0", "lower", "fixed"), ("base", "base_link", "fixed")], "tool0"),
        ([*TWO, ("base", "base_link", "fixed")], "lower"),
        ([*TWO, ("link1_cover", "upper", "fixed")], "lower"),
        ([*TWO, ("ee_link", "lower", "fixed"), ("tool0", "lower", "fixed")], "tool0"),
        ([*TWO, ("tool0", "lower", "fixed"), ("grip_tcp", "tool0", "fixed")], "grip_tcp"),
        ([*TWO, ("arm_link_ee", "lower", "fixed"), ("jaw", "lower", "revolute")], "arm_link_ee"),
        ([*TWO, ("knee", "lower", "fixed"), ("jaw", "lower", "revolute")], "jaw"),
        ([("tool0", "base_link", "fixed"), *TWO], "lower"),
        ([("a", "base_link", "fixed"), ("b", "a", "fixed"), ("c", "base_link", "fixed")], "c"),
    ],
)
def test_the_tip_is_the_tool_or_the_link_that_most_joints_move(read, links, tip):
    robot = read(tree(*links))
    assert robot.tip == tip
    q = np.full(robot.nq, 0.3)
    np.testing.assert_array_equal(robot.fk(q), robot.fk(q, tip))
    np.testing.assert_array_equal(robot.jacobian(q), robot.jacobian(q, tip))


FINGERS = [("left", "hand", "prismatic"), ("right", "hand", "prismatic")]
HAND = [*TWO, ("hand", "lower", "fixed"), *FINGERS]
ARMS = [(f"{side}_{link}", "base_link", "revolute") for link in ("ee", "arm") for side in "ab"]


@pytest.mark.parametrize(
    ("links", "tip", "others"),
    [
        (HAND, "hand", "'left', 'right'; choose by tip='left'"),
        ([*TWO, *((k, "lower", "revolute") for k in ("left", "right"))], "left", "'right'"),
        (ARMS, "a_ee", "'b_ee'; choose by tip='b_ee'"),
        ([(f"leg{i}", "base_link", "revolute") for i in range(12)], "leg0", "'leg8' and 3 more"),
    ],
)
def test_where_several_could_be_the_tip_that_is_reported(read, links, tip, others):
    with pytest.warns(
        rs.errors.FileWarning, match=f"the tip is taken to be '{tip}', and could "
    ) as caught:
        assert read(tree(*links)).tip == tip
    assert len(caught) == 1 and caught[0].filename == __file__
    assert "arm.urdf: " in str(caught[0].message) and others in str(caught[0].message)


def test_the_tip_can_be_named(read):
    assert read(tree(*HAND), tip="right").tip == "right"
    assert read(tree(*HAND), tip="base_link").fk([0.1] * 4).tolist() == np.eye(4).tolist()
    with pytest.raises(
        rs.errors.FrameError, match=r"no frame 'hnd'.*did you mean 'hand'.* upper, lower"
    ):
        read(tree(*HAND), tip="hnd")


def test_home_can_be_set_whole_or_joint_by_joint(read):
    assert read(home=[0.1, 0.2]).home.tolist() == [0.1, 0.2]
    text = ARM.replace('lower="-1.5"', 'lower="0.5"')
    assert read(text, home={"elbow": 0.2}).home.tolist() == [0.5, 0.2]


@pytest.mark.parametrize(
    ("home", "message"),
    [
        (
            {"elbw": 1},
            "arm.home: no coordinate 'elbw'; did you mean 'elbow'? coordinates: shoulder",
        ),
        ({"grip": 0.1}, "arm.home: no coordinate 'grip'"),
        ({"shoulder": 3}, "arm.home: joint 'shoulder' of 'arm' is 3 rad, outside its limits"),
        ({"elbow": "a"}, "arm.home"),
        ({"elbow": np.nan}, "arm.home: nan at index (1,); every number must be finite"),
        ({3: 0.1}, "arm.home: no coordinate 3"),
        ([1.0], "arm.home: expected shape (..., 2), got (1,)"),
        ("zero", "arm.home"),
    ],
)
def test_a_home_that_does_not_fit_is_refused(read, home, message):
    with pytest.raises(rs.errors.InputError) as caught:
        read(home=home)
    assert message in str(caught.value)


# what comes out


def test_the_robot_agrees_with_the_file(read):
    arm = read()
    assert arm.name == "arm" and [k.name for k in arm.links] == ["base", "upper", "lower", "finger"]
    assert arm.coordinate_names == ("shoulder", "elbow") and arm.nv == 2
    np.testing.assert_array_equal(arm.limits[0], [-1.5, 2])
    shoulder, _, grip = (link.joint for link in arm.links[1:])
    assert (shoulder.speed, shoulder.effort, grip.speed, grip.effort) == (3.0, 10.0, None, 1.0)
    assert (shoulder.damping, shoulder.friction, grip.damping) == (0.1, 0.0, 0.0)
    assert grip.follows == rs.joints.Mimic("elbow", 0.01, 0.02) and grip.limits == (0.0, 0.04)
    q = [0.3, 1.2]
    upper = rs.Pose.at(0, 0, 1, rpy=(0, 0, 1.5)) @ rs.Pose.at(rotvec=(0, 0.3, 0))
    lower = upper @ rs.Pose.at(rotvec=np.array([0.6, 0, 0.8]) * 1.2)
    finger = lower @ rs.Pose.at(0.012 + 0.02)
    for name, pose in [("upper", upper), ("lower", lower), ("finger", finger)]:
        np.testing.assert_allclose(arm.fk(q, name), pose.matrix, rtol=0, atol=1e-15)


def test_inertia_and_shapes_agree_with_the_file(read):
    _, upper, lower, _ = read().links
    tensor = [[1, 0.1, 0], [0.1, 2, 0], [0, 0, 2.5]]
    assert upper.inertia == rs.shapes.Inertia(2.0, (0, 0, 0.1), tensor) and lower.inertia is None
    tube = rs.Wheel(0.05, 0.4, color="b").at(rs.Pose.at(0, 0, 0.2, rpy=(0.1, 0.2, 0.3)))
    assert upper.shapes == (tube,)
    assert lower.shapes == (rs.shapes.Mesh("package://arm/lower.stl", (1, 1, 2)),)


def test_a_capsule_is_written_as_a_cylinder_and_two_spheres(tmp_path):
    where = rs.Pose.at(0, 0, 0.5)
    capsule = rs.shapes.Capsule(0.1, 0.3, color="r", pose=where)
    rs.Robot("arm", [rs.joints.Link("base", shapes=(capsule,))]).to_urdf(tmp_path / "arm.urdf")
    tube, *ends = rs.Robot.from_urdf(tmp_path / "arm.urdf").links[0].shapes
    assert tube == rs.Wheel(0.1, 0.3, color="r").at(where)
    assert [end.pose.position[2] for end in ends] == pytest.approx([0.35, 0.65])
    assert {(type(end), end.radius, end.color) for end in ends} == {(rs.shapes.Ball, 0.1, "r")}


def test_home_is_zero_or_the_limit_next_to_it(read):
    assert read(ARM, 'lower="-1.5"', 'lower="0.5"').home.tolist() == [0.5, 0.0]


@pytest.mark.parametrize("axis", np.vstack([np.eye(3), -np.eye(3)]).tolist())
def test_along_an_axis_of_the_frame_no_digit_is_lost(read, axis):
    text = " ".join(map(str, axis))
    joint = read(ARM, 'xyz="0.6 0 0.8"', f'xyz="{text}"').links[2].joint
    R = joint.place.rotation
    assert set(np.unique(np.abs(R))) == {0.0, 1.0} and R[:, 2].tolist() == axis
    assert np.array_equal(joint.tail.matrix, joint.place.inv().matrix)
    assert axis != [0, 0, 1] or np.array_equal(R, np.eye(3))


def test_floating_and_planar_joints_are_read(read):
    text = ARM.replace("<mimic", "<!-- <mimic").replace('offset="0.02"/>', 'offset="0.02"/> -->')
    flying = read(text, 'type="continuous"', 'type="floating"')
    assert flying.nq == 9 and flying.coordinate_names[1] == "elbow.x"
    sliding = read(text, 'type="continuous"', 'type="planar"')
    q = [0.0, 0.3, -0.2, 0.5, 0.0]
    T = sliding.links[2].joint.place.matrix
    moved = sliding.fk([0.0] * 5, "lower")[:3, :3].T @ (
        sliding.fk(q, "lower")[:3, 3] - sliding.fk([0.0] * 5, "lower")[:3, 3]
    )
    np.testing.assert_allclose(moved @ [0.6, 0, 0.8], 0, atol=1e-15)
    np.testing.assert_allclose(moved, T[:3, :3] @ [0.3, -0.2, 0], atol=1e-15)


def chain(n):
    limit = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
    links = "".join(f'<link name="l{i}">{INERTIAL}</link>' for i in range(n))
    joints = "".join(
        f'<joint name="j{i}" type="revolute"><parent link="l{i}"/><child link="l{i + 1}"/>'
        f'<origin xyz="0 0 1"/>{limit}</joint>'
        for i in range(n - 1)
    )
    return f'<robot name="chain">{links}{joints}</robot>'


def test_a_chain_of_1000_links_is_read(read):
    start = time.perf_counter()
    robot = read(chain(1000))
    assert time.perf_counter() - start < 10.0  # it is half a second
    assert robot.nq == 999
    assert robot.fk(np.zeros(999))[:3, 3].tolist() == [0, 0, 999]


@pytest.mark.full
def test_the_time_that_a_chain_takes_is_linear_in_its_length(read):
    """Eight times as many links take about eight times as long, not 64 times."""

    def seconds(text):
        times = []
        for _ in range(3):
            start = time.process_time()
            read(text)
            times.append(time.process_time() - start)
        return min(times)

    short, long = (chain(n) for n in (128, 1024))
    read(short)
    assert seconds(long) < 24 * seconds(short)


# what nobody thought of

WORDS = ["0", "-1", "1e400", "nan", "x", "", "elbow", "upper", "base", "<", "/>", '"', "0 0 0"]


@settings(derandomize=True, deadline=None, max_examples=300)
@given(st.data())
def test_a_changed_file_gives_a_robot_or_a_file_error(tmp_path_factory, data):
    """Pieces of the file are dropped, doubled, moved, or replaced by others."""
    tokens = ARM.replace("=", " = ").replace("/>", " /> ").split(" ")
    for _ in range(data.draw(st.integers(1, 4))):
        i = data.draw(st.integers(0, len(tokens) - 1))
        j = data.draw(st.integers(0, len(tokens) - 1))
        match data.draw(st.integers(0, 3)):
            case 0:
                del tokens[i : i + 1 + j % 4]
            case 1:
                tokens[i:i] = tokens[j : j + 3]
            case 2:
                tokens[i], tokens[j] = tokens[j], tokens[i]
            case 3:
                tokens[i] = data.draw(st.sampled_from(WORDS) | st.text(max_size=4))
        tokens = tokens or [""]
    path = tmp_path_factory.mktemp("changed") / "arm.urdf"
    path.write_text(" ".join(tokens), encoding="utf-8", errors="replace")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rs.errors.FileWarning)
        try:
            robot = rs.Robot.from_urdf(path)
        except rs.errors.FileError as error:
            assert str(error).startswith(str(path))
            return
    assert np.isfinite(robot.frames(robot.home)).all()


@pytest.mark.filterwarnings("ignore::robsim.base.errors.UnitWarning")
@settings(derandomize=True, deadline=None, max_examples=100)
@given(
    st.sampled_from(["xyz", "rpy", "lower", "upper", "multiplier", "offset", "velocity", "ixx"]),
    st.floats() | st.integers(),
)
def test_any_number_gives_a_robot_or_a_file_error(tmp_path_factory, name, value):
    head, tail = ARM.split(f'{name}="', 1)
    rest = tail.split('"', 1)[1]
    text = (
        f'{head}{name}="{value} 0 0"{rest}' if len(name) == 3 else f'{head}{name}="{value}"{rest}'
    )
    path = tmp_path_factory.mktemp("number") / "arm.urdf"
    path.write_text(text, encoding="utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rs.errors.FileWarning)
        try:
            robot = rs.Robot.from_urdf(path)
        except rs.errors.FileError:
            return
    assert np.isfinite(robot.frames(robot.home)).all() and np.isfinite(robot.home).all()


def fingers(multiplier, count, limit=1):
    """Return fingers that each mimic the one before."""
    text = '<robot name="hand"><link name="palm"/>'
    for i in range(count):
        mimic = f'<mimic joint="j{i - 1}" multiplier="{multiplier}" offset="1"/>' if i else ""
        text += (
            f'<link name="l{i}"/><joint name="j{i}" type="revolute"><parent link="palm"/>'
            f'<child link="l{i}"/><axis xyz="0 0 1"/>{mimic}'
            f'<limit lower="-{limit}" upper="{limit}" effort="0" velocity="0"/></joint>'
        )
    return text + "</robot>"


def test_mimics_through_mimics_stay_finite(read):
    """1e9 to the power of 40 was infinite, and home no number; 1e18 could not be read again."""
    message = get_refusal(read, text=fingers(1e9, 41))
    assert "<joint 'j2'>: mimic: ratio 1e+18 and offset 1e+09 to 'j0', through others" in message
    assert np.isfinite(read(text=fingers(0.5, 9, 1e9), tip="l0").home).all()


def test_limits_without_bound_are_read_as_the_largest_number(read, tmp_path):
    with pytest.warns(rs.errors.FileWarning, match=r"upper 1e\+308 is read as 1e\+09"):
        arm = read(ARM, 'upper="2"', 'upper="1e308"')
    assert arm.limits[0].tolist() == [-1.5, 1e9]
    arm.to_urdf(tmp_path / "again.urdf")
    assert rs.Robot.from_urdf(tmp_path / "again.urdf").limits.tolist() == arm.limits.tolist()


def test_numbers_that_could_not_be_read_are_not_written(tmp_path):
    far = rs.Robot.from_dh([[0, 0, 1e10, 0]], name="far")
    with pytest.raises(
        rs.errors.InputError, match=r"'link1' has a number of 1e\+10, and at most 1e\+09"
    ):
        far.to_urdf(tmp_path / "far.urdf")


BESIDE = """<robot name="r"><link name="base"/>
<link name="arm.axis">{0}</link><link name="arm"/>
<joint name="arm" type="revolute"><parent link="base"/><child link="arm.axis"/>
<limit lower="-1" upper="1" effort="0" velocity="0"/></joint>
<joint name="arm.tail" type="fixed"><parent link="arm.axis"/><child link="arm"/></joint></robot>"""


@pytest.mark.filterwarnings("ignore::robsim.errors.FileWarning")  # of the name "arm.axis"
def test_the_mass_of_a_bare_link_is_kept(read):
    """Only the gram that our writer gives what moves is taken for one of ours."""
    gram = '<mass value="0.00100000001"/><inertia ixx="1e-6" iyy="1e-6" izz="1e-6"/>'
    ours = read(text=BESIDE.format(f"<inertial>{gram}</inertial>"))
    assert [link.name for link in ours.links] == ["base", "arm"]
    theirs = read(text=BESIDE.format(INERTIAL))
    assert [k.inertial and k.inertial.mass for k in theirs.links] == [None, 2.0, None]
    standing = read(
        ARM, '<link name="base"/>', f'<link name="base"><inertial>{gram}</inertial></link>'
    )
    assert standing.links[0].inertial.mass == 0.00100000001
    gram = gram.replace("0.00100000001", "0.001")
    moving = read(ARM, INERTIAL, f"<inertial>{gram}</inertial>")
    assert moving.links[1].inertial.mass == 0.001


def test_stray_text_is_reported(read):
    with pytest.warns(rs.errors.FileWarning, match="text 'axis 0 0 1' stands between the elements"):
        read(ARM, '<child link="lower"/>', '<child link="lower"/> axis 0 0 1')


@pytest.mark.parametrize("space", ["\u00a0", "\u2003", "\u3000", "\x85"])
def test_only_the_blanks_of_xml_separate_numbers(read, space):
    assert "is no number" in get_refusal(read, 'xyz="0 0 1"', f'xyz="0{space}0 1"')


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-32", "utf-7", "cp037", "koi8-r"])
def test_a_file_in_an_odd_encoding_is_refused(tmp_path, encoding):
    text = ARM.replace('version="1.0"', f'version="1.0" encoding="{encoding}"')
    path = tmp_path / "arm.urdf"
    path.write_bytes(text.encode(encoding))
    with pytest.raises(rs.errors.FileError, match=r"arm\.urdf:1: .*(?i:utf-8|well-formed)"):
        rs.Robot.from_urdf(path)
