"""`robsim robots NAME` and `plot.robot`: the table agrees with the library, and it is drawn."""

import tomllib
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from click.testing import CliRunner
from mpl_toolkits.mplot3d.art3d import Line3DCollection

import robsim as rs
from robsim import plot, robots
from robsim.cli import commands
from robsim.plot.shaded_solids import SolidFaces

matplotlib.use("agg")
STANFORD = """\
stanford_arm: Stanford arm: two revolute joints, a boom that slides, and a spherical wrist
6 coordinates, 6 velocities; standard DH: the coordinate adds to theta, or to d if prismatic

link        joint      theta deg        d m        a m  alpha deg  limits            home
shoulder    revolute           0      0.412          0        -90  -170 to 170 deg   0 deg
carriage    revolute           0      0.154          0         90  -170 to 170 deg   90 deg
boom        prismatic          0          0          0          0  0.3048 to 1.27 m  0.6 m
wrist_roll  revolute           0          0          0        -90  -170 to 170 deg   0 deg
wrist_bend  revolute           0          0          0         90  -90 to 90 deg     60 deg
tool        revolute           0      0.263          0          0  -170 to 170 deg   0 deg

tool at home: (0.7315, 0.154, 0.1842) m in the base
its axes: x along (-0.866, 0, -0.5), y along (0, 1, 0), z along (0.5, 0, -0.866)

no masses are known, so there are no dynamics

sources
  - DH: R. P. Paul"""


PUMA = """
mass of all links: 23.45 kg
link        mass kg  centre m                  moment kg m^2  effort  armature  damping  friction
shoulder    0        (0, 0, 0)                 0.35           97.6    0.784     5.802    25.98
upper_arm   17.4     (-0.364, 0.006, 0.228)    0.539          186.4   2.325     9.497    10.62
"""


@pytest.fixture
def robsim(tmp_path, monkeypatch):
    """`robsim ARGUMENTS` in an empty folder: its output, or its RobSimError."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments):
        done = CliRunner().invoke(commands.cli, [*map(str, arguments)])
        if isinstance(done.exception, rs.RobSimError):
            raise done.exception
        assert done.exit_code == 0, done.output
        return done.output

    return call


def lines(figure):
    """(N, 3) the corners of all faces and the ends of all lines that are drawn, without shadows."""
    drawn = figure.axes[0].collections
    ends = [
        a._segments3d for a in drawn if isinstance(a, Line3DCollection) and a.get_label()[0] != "_"
    ]
    ends += [a._faces for a in drawn if isinstance(a, SolidFaces)]
    return np.concatenate([np.asarray(each).reshape(-1, 3) for each in ends])


def test_the_table_of_a_robot_is_printed_whole(robsim):
    assert robsim("robots", "stanford_arm").startswith(STANFORD)


def test_masses_and_drives_are_printed(robsim):
    assert PUMA in robsim("robots", "puma560")
    planar = robsim("robots", "planar_2r")
    assert "mass of all links: 14 kg" in planar and "friction" not in planar.split("sources")[0]


@pytest.mark.parametrize("name", robots.names())
def test_each_robot_has_a_row_for_each_link_and_all_its_sources(robsim, name):
    from robsim.cli.robot_description import format_robot

    table, robot = format_robot(name), robots.load(name)
    rows = [line.split() for line in table.splitlines()]
    for link in robot.links[1:]:
        assert any(row[:1] == [link.name] and link.joint.kind in row for row in rows)
    flat = " ".join(table.split())
    for source in tomllib.loads(robots.file(name).read_text(encoding="utf-8"))["sources"]:
        assert " ".join(source.split()) in flat
    assert robots.about(name) in flat and f"{robot.tip} at home" in table


def test_places_turns_and_several_coordinates_are_reported(robsim):
    table = robsim("robots", "mobile_arm")
    assert "at (0.12, 0, 0.26) m, z along (0, 0, 1)" in table
    assert "x 0 m, y 0 m, theta 0 deg" in table
    assert "at (0, 0, 0.25) m, about (0, 0, 1)" in robsim("robots", "pan_tilt")
    assert "along (1, 0, 0)     -0.7 to 0.7 m  0 m" in robsim("robots", "gantry")
    assert "90  none                 0 deg" in robsim("robots", "kinova_gen3")


def test_the_drawing_goes_here_or_to_a_given_path_and_never_over_a_file(robsim):
    assert robsim("robots", "scara").endswith("figure at home: scara.png\n")
    assert Path("scara.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    Path("scara.png").write_text("mine", encoding="utf-8")
    for target in ([], ["-o", "."], ["-o", "scara.png"]):
        with pytest.raises(
            rs.errors.FileError, match=r"scara\.png exists; overwrite it with --force"
        ):
            robsim("robots", "scara", *target)
    assert Path("scara.png").read_text(encoding="utf-8") == "mine"
    robsim("robots", "scara", "--force")
    robsim("robots", "scara", "-o", "new/slide.PDF")
    assert Path("scara.png").stat().st_size > 10_000
    assert Path("new/slide.PDF").read_bytes()[:4] == b"%PDF"


def test_an_impossible_drawing_is_reported(robsim):
    with pytest.raises(
        rs.errors.InputError, match="no robot 'ur5' in the library; did you mean 'ur5e'"
    ):
        robsim("robots", "ur5")
    for target in ("picture", "picture.txt"):
        with pytest.raises(
            rs.errors.FileError, match=r"the name of a figure ends in one of \..*\.png"
        ):
            robsim("robots", "ur5e", "-o", target)
    Path("file").touch()
    with pytest.raises(rs.errors.FileError, match="cannot write"):
        robsim("robots", "ur5e", "-o", "file/below.png")
    assert not Path("picture").exists() and not Path("ur5e.png").exists()


def test_the_list_names_the_command_that_shows_one(robsim):
    assert robsim("robots").endswith("print and draw one: robsim robots NAME\n")


def test_a_robot_is_drawn_where_its_links_are():
    arm = robots.ur5e()
    q = arm.home + 0.2
    shapes = [
        shape.at(T).vertices
        for link, T in zip(arm.links, arm.frames(q), strict=True)
        for shape in link.shapes
    ]
    drawn, corners = lines(plot.robot(arm, q)), np.concatenate(shapes)
    np.testing.assert_allclose(drawn.min(axis=0), corners.min(axis=0), rtol=0, atol=1e-12)
    np.testing.assert_allclose(drawn.max(axis=0), corners.max(axis=0), rtol=0, atol=1e-12)
    elsewhere = replace(arm.at(rs.Pose.at(1, 2, 3)), home=q)  # in the axes of its base all the same
    np.testing.assert_array_equal(lines(plot.robot(elsewhere)), drawn)


def test_a_robot_without_shapes_is_lines_or_the_axes_of_its_tip():
    plain = rs.Robot.from_dh([[0, 0, 1, 0], [0, 0, 0.5, 0]])
    np.testing.assert_allclose(lines(plot.robot(plain))[:, 0], [0, 1, 1, 1.5])
    pose = rs.Pose.at(0.3, 0.2, 0.1, rpy=(0, 0, np.pi / 2))
    figure = plot.robot(robots.free_camera(), pose)
    ends = lines(figure).reshape(3, 2, 3)
    np.testing.assert_allclose(ends[:, 0], [[0.3, 0.2, 0.1]] * 3, rtol=0, atol=1e-12)
    ways = [[0, 0.1, 0], [-0.1, 0, 0], [0, 0, 0.1]]
    np.testing.assert_allclose(ends[:, 1] - ends[:, 0], ways, rtol=0, atol=1e-12)
    words = [text.get_text() for text in figure.axes[0].get_legend().get_texts()]
    assert words == ["x of body", "y of body", "z of body"]


def test_only_a_robot_can_be_drawn_alone():
    with pytest.raises(rs.errors.InputError, match="expected a Robot, got 'ur5e'"):
        plot.robot("ur5e")
    with pytest.raises(rs.errors.InputError, match="q: expected one configuration"):
        plot.robot(robots.ur5e(), np.zeros((2, 6)))
