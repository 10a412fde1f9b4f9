"""A decimal comma and a unit without quotes are answered with the corrected text."""

import pytest

import robsim as rs
from robsim.base import si_units
from robsim.base.errors import FileError

PATH = rs.examples.path("chapter_6_1")
TEXT = rs.load_scenario(PATH).to_toml()


def refusal(line, section="[run]"):
    text = TEXT.replace("duration", "#") if line.startswith("duration") else TEXT
    with pytest.raises(FileError) as error:
        rs.Experiment.from_text(text.replace(section, f"{section}\n{line}"), "a.toml")
    return str(error.value)


@pytest.mark.parametrize(
    ("line", "found", "fixed"),
    [
        ("dt = 40 ms", "40 ms", 'dt = "40 ms"'),
        ("dt = 40ms", "40ms", 'dt = "40ms"'),
        ("dt = 0,5", "0,5", "dt = 0.5"),
        ("dt = 1.234,5", "1.234,5", "dt = 1234.5"),
        ("dt = 22,86 ms", "22,86 ms", 'dt = "22.86 ms"'),
        ("dt = 40 ms  # fast", "40 ms", 'dt = "40 ms"  # fast'),
        ("x = { d = 10 cm, a = 3 }", "10 cm", 'x = { d = "10 cm", a = 3 }'),
        ("x = [-20 deg, 3.5]", "-20 deg", 'x = ["-20 deg", 3.5]'),
        ("x = 30 deg/s", "30 deg/s", 'x = "30 deg/s"'),
    ],
)
def test_a_line_that_is_not_toml_is_corrected(line, found, fixed):
    message = refusal(line)
    number = TEXT.replace("[run]", f"[run]\n{line}").splitlines().index(line) + 1
    assert f"(at line {number}, column" in message
    assert f"; found {found}, but " in message and message.endswith(f": {fixed}")


@pytest.mark.parametrize("line", ["dt = fast", "dt = = 3", 'dt = "40 ms', "dt 40 ms", "dt = 4 4 4"])
def test_other_lines_get_no_correction(line):
    assert "; found" not in refusal(line)


@pytest.mark.parametrize(
    ("value", "fixed"),
    [
        ("22,86 ms", '"22.86 ms"'),
        ("5,5 s", '"5.5 s"'),
        ("1.234,5 ms", '"1234.5 ms"'),
        ("0,04s", '"0.04s"'),
    ],
)
def test_a_quoted_number_with_a_comma_is_corrected(value, fixed, called):
    expected = f"; write {fixed}, with a decimal point"
    assert refusal(f'dt = "{value}"').endswith(expected)
    status, _, error = called("run", PATH, "--set", f"run.dt={value}")
    assert status == 2 and expected in error


def test_bare_numbers_with_a_comma_are_corrected():
    with pytest.raises(FileError, match=r"got '0,5'; write 0\.5, with a decimal point"):
        rs.load_scenario(PATH, set={"task.gain": "0,5"})


def test_a_list_with_commas_stays_a_list():
    assert si_units.parse("31, 0, 10 cm", "length", count=3) == (0.31, 0.0, 0.1)
    assert si_units.parse("31,0,10 cm", "length", count=3) == (0.31, 0.0, 0.1)
    with pytest.raises(rs.errors.UnitError, match=r'write "31\.5, 0, 10 cm", with a decimal'):
        si_units.parse("31,5, 0, 10 cm", "length", count=3)
    with pytest.raises(rs.errors.UnitError) as error:
        si_units.parse("31, 0 cm", "length", count=3)
    assert "write" not in str(error.value)


def test_a_unit_without_quotes_on_the_command_line(called):
    status, _, error = called("run", PATH, "--set", "run.dt=40", "ms")
    assert status == 2
    assert "a value with a space needs quotes: --set 'run.dt=40 ms'" in error
    assert "quotes" not in called("run", PATH, "ms")[2]
