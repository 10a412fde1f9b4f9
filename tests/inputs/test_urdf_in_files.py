"""A robot of a scenario file that is `urdf = "arm.urdf"`: it is read, changed, run and repeated."""

import numpy as np
import pytest

import robsim as rs

ARM = """
<robot name="arm">
  <link name="base"/> <link name="upper"/> <link name="fore"/> <link name="tool0"/>
  <link name="gripper"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/> <child link="upper"/> <axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/> <child link="fore"/> <origin xyz="1 0 0"/> <axis xyz="0 0 1"/>
    <limit lower="-2" upper="2" effort="1" velocity="1"/>
  </joint>
  <joint name="flange" type="fixed">
    <parent link="fore"/> <child link="tool0"/> <origin xyz="1 0 0"/>
  </joint>
  <joint name="grip" type="fixed">
    <parent link="fore"/> <child link="gripper"/> <origin xyz="0.5 0 0"/>
  </joint>
</robot>
"""
TEXT = """
schema = 1
[[robots]]
urdf = "robots/arm.urdf"
name = "mine"
position = "0, 0, 1 m"
[task]
kind = "follow_joints"
to = { shoulder = "10 deg", elbow = "0.2 rad" }
duration = "400 ms"
[run]
duration = "600 ms"
"""


@pytest.fixture
def bench(tmp_path):
    """Load the scenario file, changed."""
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots" / "arm.urdf").write_text(ARM)

    def load(old="", new="", changes=()):
        assert old in TEXT
        (tmp_path / "bench.toml").write_text(TEXT.replace(old, new, 1))
        return rs.load_scenario(tmp_path / "bench.toml", changes)

    load.urdf = tmp_path / "robots" / "arm.urdf"
    return load


def test_it_is_the_robot_of_the_file_where_the_scenario_puts_it(bench):
    robot, plain = bench().scene.robot("mine"), rs.Robot.from_urdf(bench.urdf)
    assert (robot.links, robot.tip) == (plain.links, "tool0")
    assert robot.base == rs.Pose.at(0, 0, 1)
    assert bench('name = "mine"', 'tip = "gripper"').scene.robot("arm").tip == "gripper"


def test_it_is_changed_by_dotted_names(bench):
    names = {"tip": "gripper", "links.upper.limits": ["-1 rad", "1 rad"]}
    names |= {"links.fore.limits": ["-30 deg", "30 deg"]}
    changes = {f"robots.mine.{name}": value for name, value in names.items()}
    robot = bench(changes=changes).scene.robot()
    assert bench(changes=["robots.mine.tip=gripper"]).scene.robot().tip == robot.tip == "gripper"
    np.testing.assert_allclose(robot.limits, [[-1, 1], [-np.pi / 6, np.pi / 6]])
    assert bench().at("robots.mine.tip", "fore").scene.robot().tip == "fore"


def test_its_run_is_repeated_without_the_urdf_file(bench):
    run = bench().run()
    np.testing.assert_allclose(run.q.dropna("time")[-1], [np.radians(10), 0.2], atol=1e-6)
    bench.urdf.unlink()
    assert "urdf" not in run.attrs["scenario"]
    assert rs.replay(run).identical(run)


def test_nor_is_the_file_of_a_tool_needed(bench):
    tool = '[[robots.tools]]\nurdf = "robots/arm.urdf"\ntip = "gripper"\nname = "hand"\n[task]'
    run = bench("[task]", tool).with_(duration=0.2).run()
    assert "urdf" not in run.attrs["scenario"] and "gripper" in run.attrs["scenario"]


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("robots/arm", "arm", "robots.mine.urdf: .*/arm.urdf: no such file"),
        ('"robots/arm.urdf"', "3", "robots.mine.urdf: must be the path of a URDF file, got 3"),
        ("robots/arm.urdf", "bench.toml", "robots.mine.urdf: .*bench.toml:2: not valid XML"),
        ('name = "mine"', 'model = "scara"', r"robots.scara: model and urdf: give one of the two"),
        (
            "position",
            'tip = "tol0"\nposition',
            "robots.mine.tip: no frame 'tol0' in robot 'arm'; did you mean 'tool0'",
        ),
        ("position", "pozition", "robots.mine.pozition: unknown key 'pozition'; did you mean"),
        ("position", 'home = ["1 rad"]\nposition', "robots.mine.home: 1 coordinates, expected 2"),
        (
            "[task]",
            '[[robots.tools]]\nname = "hand"\nurdf = "hand.urdf"\n[task]',
            "robots.mine.tools.hand.urdf: .*/hand.urdf: no such file",
        ),
    ],
)
def test_each_fault_is_reported_with_its_key(bench, old, new, told):
    with pytest.raises(rs.errors.FileError, match=f"^[^\n]*bench.toml: {told}[^\n]*$"):
        bench(old, new)


def test_an_arm_with_meshes_is_used_like_any_other(tmp_path):
    """The file names a mesh in a folder that no text names; the mesh makes no difference."""
    (tmp_path / "arm.urdf").write_text(
        """<robot name="arm"><link name="base"/><link name="hand"><visual><geometry>
        <mesh filename="package://nowhere/hand.stl"/></geometry></visual></link>
        <joint name="j" type="revolute"><parent link="base"/><child link="hand"/>
        <axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
    )
    (tmp_path / "arm.toml").write_text(
        """schema = 1
        robots = [{ urdf = "arm.urdf" }]
        objects = [{ name = "dots", marks = ["0, 0, 1 m", "10, 0, 100 cm"] }]
        cameras = [{ name = "eye", on = "arm.hand", focal = 800, size = [640, 480] }]
        task = { kind = "ibvs", inverse = "damped" }
        start = { q = ["5 deg"] }
        """
    )
    experiment = rs.load_scenario(tmp_path / "arm.toml")
    run = experiment.run()
    assert run["q"].values[0, 0] == np.deg2rad(5) and abs(float(run["q_end"][0])) < 1e-4
    assert rs.Experiment.of(run) == experiment and "hand.stl" in experiment.to_toml(complete=True)
