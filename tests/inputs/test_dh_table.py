"""A chain as a table of Denavit-Hartenberg rows, as textbooks print them."""

import json
import tomllib

import jsonschema
import numpy as np
import pytest

import robsim as rs
from robsim.base.errors import FileError
from robsim.cli.schema_command import build_schema_text
from robsim.joints import DHRow

HEAD = '["theta (deg)", "d (cm)", "a (cm)", "alpha (deg)"]'
FILE = """schema = 1
[[robots]]
name = "arm"
{robot}
[[objects]]
name = "dot"
marks = ["0, 0, 2 m"]
[[cameras]]
name = "eye"
on = "arm.link{last}"
size = [640, 480]
focal = 800
[task]
kind = "ibvs"
"""


def read(robot, last=3):
    text = FILE.format(robot=robot, last=last)
    return rs.Experiment.from_text(text, "a.toml").scene.robots[0]


def refusal(robot):
    with pytest.raises(FileError) as error:
        read(robot)
    return str(error.value)


def rigid(row, turn, slide, convention):
    """The transform of a row by elementary matrices, with nothing but NumPy."""
    theta, d, a, alpha = row

    def rot(angle, i, j):
        R = np.eye(4)
        R[[i, j], [i, j]] = np.cos(angle)
        R[j, i], R[i, j] = np.sin(angle), -np.sin(angle)
        return R

    def move(length, i):
        T = np.eye(4)
        T[i, 3] = length
        return T

    z = rot(theta + turn, 0, 1) @ move(d + slide, 2)
    x = move(a, 0) @ rot(alpha, 1, 2)
    return z @ x if convention == "standard" else x @ z


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_a_table_is_the_chain_that_the_book_means(convention):
    robot = read(
        f'convention = "{convention}"\n'
        f'dh = [{HEAD}, ["q1", 10, 0, 90], ["q2 - 90", 0, 22.5, 0], [0, "d3", 0.5, -90]]'
    )
    assert [link.joint.kind for link in robot.links[1:]] == ["revolute", "revolute", "prismatic"]
    q = [0.3, -0.4, 0.2]
    deg = np.pi / 180
    rows = [(0, 0.1, 0, 90 * deg), (-90 * deg, 0, 0.225, 0), (0, 0, 0.005, -90 * deg)]
    moves = [(q[0], 0), (q[1], 0), (0, q[2])]
    T = np.eye(4)
    for row, move in zip(rows, moves, strict=True):
        T = T @ rigid(row, *move, convention)
    np.testing.assert_allclose(robot.fk(q), T, atol=1e-12)


@pytest.mark.parametrize(
    ("dh", "joints", "kinds"),
    [
        ("[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 0]", '"RPR"', "RPR"),
        ("[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 0]", '["revolute", "prismatic", "R"]', "RPR"),
        ("[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 0]", None, "RRR"),
        ('["θ1", 1, 0, 0], [0, "q2 + 3.5", 1, 0], ["theta3", 0, 0, "90"]', None, "RPR"),
        ('["q1*", 1, 0, 0], [0, "d2", 1, 0], ["q_3-90", 0, 0, 1e1]', '"RPR"', "RPR"),
    ],
)
def test_the_joints_have_names_or_variables(dh, joints, kinds):
    robot = read(f"dh = [{HEAD}, {dh}]" + (f"\njoints = {joints}" if joints else ""))
    assert [link.joint.kind[0].upper() for link in robot.links[1:]] == list(kinds)


def test_columns_come_in_any_order_and_may_be_left_out():
    one = read('dh = [["alpha (rad)", "r_i [mm]"], [0, 100], [0.5, 50], [0, 0]]')
    rows = [[0, 0, 0.1, 0], [0, 0, 0.05, 0.5], [0, 0, 0, 0]]
    assert one == rs.Robot.from_dh(rows, name="arm")


def test_the_robot_is_read_again_from_its_text():
    text = FILE.format(robot=f'dh = [{HEAD}, ["q1", 10, 0, 90], [0, "d2", 0, 0]]', last=2)
    experiment = rs.Experiment.from_text(text, "a.toml")
    written = experiment.to_toml()
    assert rs.Experiment.from_text(written, "b.toml").scene == experiment.scene
    assert 'dh = { d = "10 cm", alpha = "90 deg" }' in written


def test_zeros_of_a_row_are_left_out():
    assert DHRow(d=0.1, alpha=0.5) == DHRow(0.0, 0.1, 0.0, 0.5) and DHRow() == DHRow(0, 0, 0, 0)
    link = '{{ name = "link1", joint = "revolute", dh = {row} }}'
    lines = [
        f'links = [{{ name = "base" }}, {link.format(row=row)}]'
        for row in (
            '{ d = "10 cm", alpha = "90 deg" }',
            '{ theta = "0 deg", d = "10 cm", a = "0 m", alpha = "90 deg" }',
        )
    ]
    assert read(lines[0], 1) == read(lines[1], 1)
    empty = FILE.format(robot=f'links = [{{ name = "base" }}, {link.format(row="{}")}]', last=1)
    experiment = rs.Experiment.from_text(empty, "a.toml")
    assert experiment.scene.robots[0].links[1].joint.dh == DHRow()
    assert rs.Experiment.from_text(experiment.to_toml(), "b.toml").scene == experiment.scene


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (f"dh = [{HEAD}]", "dh: expected headings and 1 to 255 rows, got 1 lists"),
        ("dh = 3", "dh: expected a row of headings, as in"),
        (f"dh = [{HEAD}, [0, 1, 2]]", "dh: row 1 has 3 cells, and the headings have 4"),
        (f'dh = [{HEAD}, [0, 1, 2, "x"]]', "dh: row 1, column alpha: expected a number in the"),
        (f'dh = [{HEAD}, [0, "2,5", 2, 0]]', "got '2,5'; write 2.5, with a decimal point"),
        (f'dh = [{HEAD}, [0, 1, "q1", 0]]', "dh: row 1, column a: 'q1' is a variable, which is"),
        (f'dh = [{HEAD}, ["q1", "d1", 0, 0]]', "dh: row 1, column d: 'd1' is a second variable"),
        (f'dh = [{HEAD}, ["q1", 0, 0, 0]]\njoints = "P"', "dh: row 1: the variable belongs to a"),
        (f'dh = [{HEAD}, [0, 0, 0, 0]]\njoints = "RX"', "joints: expected 1 letters R or P"),
        ('dh = [["theta", "d (m)"], [0, 0]]', "column 1 of the headings: the unit is missing of t"),
        ('dh = [["theta (cm)"], [0]]', "column 1 of the headings: 'cm' is no unit of theta; exp"),
        ('dh = [["beta (deg)"], [0]]', "column 1 of the headings: 'beta (deg)' is none of theta"),
        ('dh = [["d (m)", "d (cm)"], [0, 1]]', "dh: d has several columns"),
        (f'dh = [{HEAD}, [0, 0, 0, 0]]\nlinks = [{{ name = "a" }}]', "dh and links: give one of"),
        ('joints = "RR"', "joints: the kinds of the joints belong to a table dh, which is missing"),
    ],
)
def test_a_wrong_table_names_the_row_and_the_column(lines, message):
    assert "robots.arm" in refusal(lines) and message in refusal(lines)


def test_the_schema_has_the_table():
    schema = json.loads(build_schema_text())

    def check(robot, last=2):
        jsonschema.validate(tomllib.loads(FILE.format(robot=robot, last=last)), schema)

    check(f'dh = [{HEAD}, ["q1", 10, 0, 90], [0, "d2", 0, 0]]\njoints = "RP"')
    check('links = [{ name = "base" }, { name = "l", joint = "revolute", dh = { a = "1 m" } }]')
    with pytest.raises(jsonschema.ValidationError):
        check(f"dh = [{HEAD}, [0, true, 0, 0]]")
    with pytest.raises(jsonschema.ValidationError):
        check('joints = "RP"')
