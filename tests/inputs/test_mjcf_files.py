"""MJCF files: their content, and robots that cannot be written. See tests/peers for MuJoCo."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

import robsim as rs


def write_mjcf(links, folder):
    rs.Robot("robot", links).to_mjcf(folder / "robot.xml")
    return ET.parse(folder / "robot.xml").getroot()


def test_bodies_stand_inside_each_other(tmp_path):
    turn = rs.joints.Joint("revolute", rs.Pose.at(0, 0, 1), limits=(-1.0, 2.0), effort=3.0)
    tied = rs.joints.Joint("prismatic", follows=rs.joints.Mimic("arm", 0.5, 0.1))
    ball = rs.shapes.Ball(0.2, color="r")
    links = [
        rs.joints.Link("base"),
        rs.joints.Link("arm", "base", turn, (ball,)),
        rs.joints.Link("tip", "arm", tied),
    ]
    root = write_mjcf(links, tmp_path)
    arm = root.find("worldbody/body/body")
    assert arm.attrib == {"name": "arm", "pos": "0.0 0.0 1.0"}
    assert arm.find("joint").attrib == {
        **{"name": "arm", "type": "hinge", "pos": "0.0 0.0 0.0", "axis": "0.0 0.0 1.0"},
        **{"range": "-1.0 2.0", "actuatorfrcrange": "-3.0 3.0"},
    }
    assert arm.find("geom").attrib == {"type": "sphere", "size": "0.2", "rgba": "1.0 0.0 0.0 1.0"}
    assert arm.find("inertial").get("mass") == "0.00100000001"
    assert arm.find("body/joint").get("type") == "slide"
    assert root.find("equality/joint").attrib == {
        **{"joint1": "tip", "joint2": "arm", "polycoef": "0.1 0.5 0.0 0.0 0.0"}
    }


def test_the_numbers_of_a_drive_are_attributes_of_its_joint(tmp_path):
    numbers = {"armature": 0.25, "damping": 0.5, "friction": 1.5, "effort": 3.0}
    links = [rs.joints.Link("base"), rs.joints.Link("arm", "base", rs.joints.Joint("prismatic"))]
    links[1] = replace(links[1], joint=replace(links[1].joint, **numbers))
    joint = write_mjcf(links, tmp_path).find("worldbody/body/body/joint").attrib
    expected = {"armature": "0.25", "damping": "0.5", "frictionloss": "1.5"}
    assert joint.items() >= {**expected, "actuatorfrcrange": "-3.0 3.0"}.items()


@pytest.mark.parametrize(
    ("mass", "moments", "written"),
    [
        (0.0, (0, 0.35, 0), (1e-9, 0.175, 0.35, 0.175)),
        (4.8, (0.066, 0.086, 0.0125), (4.8, 0.06975, 0.086, 0.01625)),
        (1.0, (-1, 2, 1), (1.0, 0.5, 2, 1.5)),
    ],
)
def test_moments_that_no_body_has_are_raised_with_a_warning(mass, moments, written, tmp_path):
    inertia = rs.shapes.Inertia(mass, tensor=np.diag(moments), strict=False)
    links = [rs.joints.Link("base"), rs.joints.Link("arm", "base", inertia=inertia)]
    with pytest.warns(rs.errors.FileWarning, match="inertias of arm are changed"):
        found = write_mjcf(links, tmp_path).find("worldbody/body/body/inertial")
    numbers = [float(x) for x in (found.get("mass"), *found.get("fullinertia").split())]
    np.testing.assert_allclose(numbers, [*written, 0, 0, 0], rtol=1e-9, atol=1e-15)


def test_a_chain_of_1000_links_is_written(tmp_path):
    turn = rs.joints.Joint("revolute")
    links = [
        rs.joints.Link("l0"),
        *(rs.joints.Link(f"l{i}", f"l{i - 1}", turn) for i in range(1, 1000)),
    ]
    rs.Robot("chain", links).to_mjcf(tmp_path / "chain.xml")
    text = (tmp_path / "chain.xml").read_text(encoding="utf-8")
    assert text.count("<body ") == 1000 == text.count("</body>")


def test_a_base_that_floats_on_a_moving_body_is_refused_with_all_other_faults(tmp_path):
    links = [
        rs.joints.Link("base"),
        rs.joints.Link("arm", "base", rs.joints.Joint("revolute")),
        rs.joints.Link("drone", "arm", rs.joints.Joint("floating")),
        rs.joints.Link("rover", "base", rs.joints.Joint("unicycle")),
    ]
    with pytest.raises(rs.errors.InputError) as caught:
        rs.Robot("robot", links).to_mjcf(tmp_path / "robot.xml")
    text = "robot 'robot' cannot be written as MJCF: 'rover' moves as a unicycle; 'drone' floats on"
    assert str(caught.value).startswith(text)
    assert not (tmp_path / "robot.xml").exists()


def test_meshes_are_left_out_and_that_is_reported(tmp_path):
    with pytest.warns(rs.errors.FileWarning, match="meshes of base are left out") as caught:
        root = write_mjcf(
            [rs.joints.Link("base", shapes=(rs.shapes.Mesh("a.stl"), rs.shapes.Ball(1)))], tmp_path
        )
    assert len(root.findall("worldbody/body/geom")) == 1
    assert caught[0].filename == __file__


def test_a_capsule_stays_one_and_a_tapered_cylinder_becomes_cylinders(tmp_path):
    shapes = rs.shapes.Capsule(0.1, 0.3, color="r"), rs.shapes.TaperedCylinder(0.2, 0.1, 0.4)
    root = write_mjcf([rs.joints.Link("base", shapes=shapes)], tmp_path)
    capsule, *slices = root.findall("worldbody/body/geom")
    assert capsule.attrib == {"type": "capsule", "size": "0.1 0.15", "rgba": "1.0 0.0 0.0 1.0"}
    assert [each.get("type") for each in slices] == ["cylinder"] * 4
    heights = [float(each.get("pos").split()[2]) for each in slices]
    assert heights == pytest.approx([-0.15, -0.05, 0.05, 0.15])


def test_quaternions_are_w_first(tmp_path):
    turned = rs.joints.Joint("fixed", rs.Pose.at(rotvec=(0, 0, np.pi / 2)))
    root = write_mjcf([rs.joints.Link("base"), rs.joints.Link("a", "base", turned)], tmp_path)
    w, x, y, z = map(float, root.find("worldbody/body/body").get("quat").split())
    assert (x, y) == (0, 0) and w == pytest.approx(z) == pytest.approx(np.sqrt(0.5))
