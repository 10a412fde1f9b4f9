"""`robsim schema`: the shipped files are valid by it, and spoiled ones are not."""

import json
import tomllib

import jsonschema
import pytest
from click.testing import CliRunner

from robsim import examples, robots
from robsim.cli import commands

TEXT = """
schema = 1
robots = [{ model = "rhino_xr4", name = "arm" }]
[[objects]]
name = "cube"
position = "28, 0, 2.5 cm"
shapes = [{ kind = "block", length = "5 cm", width = "6 cm", height = "70 mm", color = "b" }]
[[cameras]]
name = "eye"
on = "arm.tool"
size = [640, 480]
focal = [800, 810]
[[belief.cameras]]
name = "eye"
focal = 850
[task]
kind = "ibvs"
features = [{ kind = "points", marks = [0, 1] }, "theta_u"]
gain = { at_zero = 4, at_infinity = 0.4, slope = 30 }
limit = { joint = "30 deg/s" }
[run]
dt = "40 ms"
"""


def schema(*options):
    done = CliRunner().invoke(commands.cli, ["schema", *options])
    assert done.exit_code == 0
    made = json.loads(done.output)
    jsonschema.Draft7Validator.check_schema(made)
    return jsonschema.Draft7Validator(made)


@pytest.fixture(scope="module")
def scenario_files():
    return schema()


@pytest.mark.parametrize("name", examples.names())
def test_every_example_is_valid_and_names_its_schema(scenario_files, name):
    text = examples.path(name).read_text(encoding="utf-8")
    assert text.startswith("#:schema robsim.schema.json\n")
    scenario_files.validate(tomllib.loads(text))


def test_every_robot_of_the_library_is_valid_and_names_its_schema():
    robot_files = schema("--robot")
    for name in robots.names():
        text = robots.file(name).read_text(encoding="utf-8")
        assert text.startswith("#:schema robot.schema.json\n")
        robot_files.validate(tomllib.loads(text))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("", ""),
        ('model = "rhino_xr4"', 'urdf = "arm.urdf", tip = "tool"'),
        ('name = "arm"', 'links = [{ name = "base", place = { position = "0, 0, 1 m" } }]'),
        ('[{ kind = "points", marks = [0, 1] }, "theta_u"]', '"pixels"'),
        ("gain = { at_zero = 4, at_infinity = 0.4, slope = 30 }", "gain = 2"),
    ],
)
def test_readable_files_are_valid(scenario_files, old, new):
    assert old in TEXT
    scenario_files.validate(tomllib.loads(TEXT.replace(old, new)))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("schema = 1", "schema = 2"),
        ("schema = 1", ""),
        ("[task]", "[tsak]"),
        ("gain = {", "gian = {"),
        ("at_infinity = 0.4, ", ""),
        ('kind = "ibvs"', 'kind = "ivbs"'),
        ('kind = "ibvs"', 'law = "joint"'),
        ('dt = "40 ms"', "dt = 0.04"),
        ('dt = "40 ms"', 'dt = "40"'),
        ('dt = "40 ms"', 'dt = "40 mm"'),
        ('position = "28, 0, 2.5 cm"', 'position = "28, 0, 2.5 deg"'),
        ('kind = "block", length = "5 cm"', 'kind = "block"'),
        ('kind = "block"', 'kind = "ball"'),
        ("size = [640, 480]", "size = [640]"),
        ("focal = 850", 'focal = "850"'),
        ('kind = "points", marks = [0, 1]', 'kind = "points", marks = "all"'),
        ('"theta_u"', '"thetau"'),
        ('name = "cube"', 'name = "two words"'),
        ('model = "rhino_xr4"', 'model = "rhino_xr4", urdf = "arm.urdf"'),
        ('model = "rhino_xr4", ', ""),
        ('"30 deg/s"', '"30 deg"'),
    ],
)
def test_spoiled_files_are_invalid(scenario_files, old, new):
    assert old in TEXT
    assert not scenario_files.is_valid(tomllib.loads(TEXT.replace(old, new, 1)))


def test_an_example_brings_the_schema_along_but_writes_none_over(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    run = CliRunner()
    assert "robsim.schema.json" in run.invoke(commands.cli, ["examples", "car"]).output
    beside = tmp_path / "robsim.schema.json"
    assert json.loads(beside.read_text()) == schema().schema
    beside.write_text("mine")
    assert "schema" not in run.invoke(commands.cli, ["examples", "tilted_square"]).output
    assert beside.read_text() == "mine"
