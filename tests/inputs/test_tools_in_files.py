"""Tools in scenario files: the effects of `Robot.with_tool`, and its refusals."""

import numpy as np
import pytest

import robsim as rs
from robsim.run.experiment import Experiment

TEXT = """
schema = 1
[[robots]]
model = "rhino_xr4"
position = "0, 0, 10 cm"
[[robots.tools]]
model = "rhino_gripper"
position = "0, 0, -10.83 cm"
bare = true
[[objects]]
name = "cup"
on = "rhino_xr4.tip"
marks = ["0, 0, 1 m"]
[[cameras]]
name = "eye"
focal = 500
size = [640, 480]
[task]
kind = "ibvs"
"""
SECOND = '[[robots.tools]]\nmodel = "rhino_gripper"\nname = "second"\non = "tip"\n'


def read(old="", new=""):
    assert old in TEXT
    return Experiment.from_text(TEXT.replace(old, new, 1), "bench.toml")


def joined():
    arm, gripper = rs.robots.rhino_xr4(), rs.robots.rhino_gripper()
    return arm.with_tool(gripper, rs.Pose.at(z=-0.1083), bare=True).at(rs.Pose.at(z=0.1))


def test_a_tool_in_a_file_agrees_with_python():
    scenario = read()
    assert scenario.scene.robot() == joined()
    again = Experiment.from_text(scenario.to_toml())
    assert again.scene.robot() == joined()


def test_a_second_tool_may_hang_on_the_first():
    two = read("[[objects]]", SECOND + "[[objects]]").scene.robot()
    assert two.coordinate_names[-2:] == ("opening", "second_opening")
    palm, tip = two.fk(two.home, "second_palm"), two.fk(two.home, "tip")
    np.testing.assert_array_equal(palm, tip)


def test_a_belief_may_have_the_tool_elsewhere():
    wrong = (
        '[{ name = "rhino_xr4", tools = [{ name = "rhino_gripper", position = "0, 0, -11 cm" }] }]'
    )
    scenario = Experiment.from_text(f"{TEXT}[belief]\nrobots = {wrong}\n")
    off = scenario.task.belief.pose("cup").position - scenario.scene.pose("cup").position
    np.testing.assert_allclose(off, [0, 0, 0.0017], rtol=0, atol=1e-15)  # it hangs down


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("true", "1", "tools.rhino_gripper.bare: must be true or false, got 1"),
        ("bare = true", 'on = "tol"', "tools.rhino_gripper: no frame 'tol' in robot 'rhino_xr4'"),
        (
            "rhino_gripper",
            "rhino_griper",
            "tools.rhino_griper.model: no robot 'rhino_griper' in the library",
        ),
        ("-10.83 cm", "-10.83", "tools.rhino_gripper.position: '0, 0, -10.83': expected a vector"),
        ("bare", "bar", "tools.rhino_gripper.bar: unknown key 'bar'; did you mean 'bare'"),
        ("bare = true", 'home = ["9 cm"]', "tools.rhino_gripper.home: rhino_gripper.home: joint"),
        ("[[objects]]", f"{SECOND}{SECOND}[[objects]]", "tools.second: two links or coordinates"),
        ("[[robots.tools]]", "[robots.tools]", "tools: must be a list of tables, [[tools]]"),
        ("rhino_xr4.tip", "rhino_xr4.tipp", "objects.cup.on: no frame 'rhino_xr4.tipp'; did you"),
    ],
)
def test_a_mistake_about_a_tool_is_one_line(old, new, told):
    with pytest.raises(rs.errors.FileError) as caught:
        read(old, new)
    assert told in str(caught.value) and "\n" not in str(caught.value)
