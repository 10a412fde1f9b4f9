"""The teach pendant of three published arms with meshes; Pinocchio has the poses of the tool."""

import json
import warnings
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import robsim as rs
from robsim.studio.pendant.pendant_session import PendantSession

ARMS = {  # file, and an angle of each joint in degrees
    "panda": ("panda_description/urdf/panda.urdf", [0, -30, 0, -120, 0, 90, 45]),
    "ur5": ("ur_description/urdf/ur5_robot.urdf", [0, -90, -90, -90, 90, 0]),
    "kinova": ("kinova_description/robots/kinova.urdf", [180, 240, 90, 0, 90, 0]),
}
CORNERS = 0.1 * np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (-1, -1, 0)])


@pytest.fixture(params=ARMS)
def arm(request, published_folder):
    """The path of an arm, its pendant, and angles of its joints in rad."""
    name, degrees = ARMS[request.param]
    path = published_folder / name
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", rs.errors.FileWarning)
        return path, PendantSession(rs.Robot.from_urdf(path)), np.radians(degrees)


@pytest.fixture
def published_folder():
    import pinocchio

    folders = Path(pinocchio.__file__).parents
    return next(
        folder / "share/example-robot-data/robots"
        for folder in folders
        if (folder / "share/example-robot-data/robots").is_dir()
    )


def test_the_tool_of_a_published_arm_follows_a_square(arm, pinocchio_reads):
    path, session, q = arm
    pendant = session.pendant
    for i, value in enumerate(q):
        assert session.do({"joint": [i, value / pendant.fields[i].size, None]}) == ""
    peer, start = pinocchio_reads(path, pendant.robot), session._describe_pose()["handle"]
    for a, b in pairwise(CORNERS):
        for share in np.arange(1, 11) / 10:
            goal = [*(np.array(start[:3]) + a + share * (b - a)), *start[3:]]
            assert session.do({"drag": [goal, "hand"]}) == ""
            assert pendant.reach_text == ""
            now = peer.at(pendant.q)
            theirs = now.pose(now.frames()[pendant.link])
            wanted = rs.Pose.from_quaternion(goal[:3], goal[3:]).matrix
            assert np.linalg.norm(theirs[:3, 3] - wanted[:3, 3]) < 1e-5
            assert np.abs(theirs[:3, :3] - wanted[:3, :3]).max() < 1e-5


def test_the_page_shows_the_meshes_and_a_far_goal_in_words(arm):
    _, session, _ = arm
    told = []
    session.broadcast = told.append
    session.start()
    session.close()
    header = session._builder.entries["parts"]
    shapes = session._builder.shapes.arrays
    corners = sum(len(shapes[part["triangles"]]) for part in header if "triangles" in part)
    assert corners > 10_000 and session.remark == ""
    assert max(map(len, told)) < 20_000_000
    assert json.loads(told[0])["joints"][0]["unit"] == "deg"
    handle = session._describe_pose()["handle"]
    session.do({"drag": [[handle[0] + 3.0, *handle[1:]], "hand"]})
    assert session.pendant.reach_text.startswith("out of reach: ")
