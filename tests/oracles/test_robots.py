"""Forward kinematics and Jacobians against Pinocchio (pinocchio_dh, _mobile and _library.json)."""

import json
from pathlib import Path

import numpy as np
import pytest

from robsim import Pose, robots
from robsim.joints import Joint, Link
from robsim.robot.robot import Robot

HERE = Path(__file__).parent
ROBOTS = json.loads((HERE / "pinocchio_dh.json").read_text())["robots"]
MOBILE = json.loads((HERE / "pinocchio_mobile.json").read_text())["robots"]
LIBRARY = json.loads((HERE / "pinocchio_library.json").read_text())


@pytest.mark.parametrize("spec", ROBOTS, ids=lambda spec: spec["name"])
def test_poses_and_jacobians_agree_with_pinocchio(spec):
    robot = Robot.from_dh(spec["rows"], spec["convention"], spec["joints"])
    q = np.array([case["q"] for case in spec["cases"]])
    middle = f"link{spec['middle_link']}"
    for ours, key in [
        (robot.frames(q)[:, 1:], "poses"),
        (robot.jacobian(q), "jacobian_last"),
        (robot.jacobian(q, middle), "jacobian_middle"),
    ]:
        expected = np.array([case[key] for case in spec["cases"]])
        np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-12)


def built(spec):
    """The robot that the links of the file describe."""
    links = [
        Link(k["name"], k["parent"], Joint(k["kind"], Pose(k["place"]), Pose(k["tail"])))
        for k in spec["links"]
    ]
    return Robot(spec["name"], [Link("base"), *links])


def agrees(robot, spec):
    """Poses and Jacobians of all links, to 1e-12."""
    cases = spec["cases"]
    q = np.array([case["q"] for case in cases])
    J = np.stack([robot.jacobian(q, k["name"]) for k in spec["links"]], axis=1)
    for ours, key in [(robot.frames(q)[:, 1:], "poses"), (J, "jacobians")]:
        np.testing.assert_allclose(ours, [case[key] for case in cases], rtol=0, atol=1e-12)


@pytest.mark.parametrize("spec", MOBILE, ids=lambda spec: spec["name"])
def test_trees_with_joints_in_the_plane_agree_with_pinocchio(spec):
    agrees(built(spec), spec)


@pytest.mark.parametrize("spec", MOBILE[1:], ids=lambda spec: spec["name"])
def test_robots_of_the_library_agree_with_pinocchio_and_their_published_constants(spec):
    robot = robots.load(spec["name"])
    assert [link.name for link in robot.links[1:]] == [k["name"] for k in spec["links"]]
    np.testing.assert_allclose(robot.home, spec["cases"][0]["q"], rtol=0, atol=1e-15)
    agrees(robot, spec)


@pytest.mark.parametrize("spec", LIBRARY["robots"], ids=lambda spec: spec["name"])
def test_arms_of_the_library_agree_with_their_published_tables(spec):
    robot, cases = robots.load(spec["name"]), spec["cases"]
    q = np.array([case["q"] for case in cases])
    assert [link.name for link in robot.links[1:]] == spec["links"]
    moving = [link.joint.kind for link in robot.links if link.joint.kind != "fixed"]
    assert moving == spec["kinds"]
    np.testing.assert_allclose(robot.home, q[0], rtol=0, atol=1e-15)
    for ours, key in [(robot.frames(q)[:, 1:], "poses"), (robot.jacobian(q), "jacobian")]:
        np.testing.assert_allclose(ours, [case[key] for case in cases], rtol=0, atol=1e-12)


# metres and radians between our flange and the flange of the maker's URDF: the file of the UR5e has
# right angles of nine digits, of the Gen3 of five, and its lengths are not rounded to 0.1 mm
APART = {
    "ur5e": (2e-10, 1e-9),
    "lbr_iiwa14": (1e-12, 1e-12),
    "panda": (1e-12, 1e-12),
    "kinova_gen3": (5e-4, 2e-5),
    "kinova_gen3 rounded": (1e-12, 1e-12),
}


@pytest.mark.parametrize("spec", LIBRARY["urdf"], ids=lambda spec: spec["name"])
def test_flanges_of_the_library_are_where_the_urdf_of_the_maker_has_them(spec):
    robot = robots.load(spec["name"].split()[0])
    theirs = np.array(spec["base"]) @ [case["pose"] for case in spec["cases"]]
    ours = robot.fk([case["q"] for case in spec["cases"]], "flange")
    metres, radians = APART[spec["name"]]
    np.testing.assert_allclose(ours[:, :3, 3], theirs[:, :3, 3], rtol=0, atol=metres)
    np.testing.assert_allclose(ours[:, :3, :3], theirs[:, :3, :3], rtol=0, atol=radians)
