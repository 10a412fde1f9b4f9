"""The remark at the head of each shipped experiment names an effect and a change to try."""

import re
import shlex

import pytest

import robsim as rs
from robsim.files.scenario_remark import extract_remark

MOST = 330  # characters that fit on a card of the gallery
SENTENCE = re.compile(r"[.?!](?= [A-Z]|$)")


def head(name):
    first, *lines = extract_remark(rs.examples.path(name).read_text(encoding="utf-8")).split("\n")
    return first, lines


def commands(name):
    return [shlex.split(line) for line in head(name)[1] if line.startswith("robsim ")]


def of_options(arguments, option):
    """The values of an option among arguments that are all pairs of an option and a value."""
    pairs = zip(arguments[::2], arguments[1::2], strict=True)
    return [value for name, value in pairs if name == option]


@pytest.mark.parametrize("name", rs.examples.names())
def test_its_first_paragraph_is_short_and_names_an_effect_to_watch(name):
    first, lines = head(name)
    assert len(first) <= MOST and "Watch " in first
    assert len(SENTENCE.findall(first)) in (2, 3)
    assert all(line.startswith("robsim ") or line[-1] in ":." for line in lines)


@pytest.mark.filterwarnings("ignore::robsim.base.errors.RankWarning")  # of a unicycle, on purpose
@pytest.mark.parametrize("name", [name for name in rs.examples.names() if commands(name)])
def test_its_commands_are_valid(name, called):
    for _, command, file, *options in commands(name):
        assert command in ("run", "compare", "study")
        path, changes = rs.examples.path(file.removesuffix(".toml")), of_options(options, "--set")
        for vary in of_options(options, "--vary"):
            key, _, values = vary.partition("=")
            for value in values.split(","):
                rs.load_scenario(path, [*changes, f"{key}={value}"]).check()
        status, _, err = called("check", path, *(w for each in changes for w in ("--set", each)))
        assert status == 0, err


def test_every_line_of_prose_can_be_read_without_scrolling():
    for name in rs.examples.names():
        text = rs.examples.path(name).read_text(encoding="utf-8")
        prose = [line for line in text.splitlines() if re.match(r"#(?!\s+robsim )", line)]
        assert max(map(len, prose)) <= 100, name
