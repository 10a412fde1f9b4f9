"""Ten mistakes of ten kinds: each is reported in one line, with its key and a valid value."""

import pytest

import robsim as rs
from robsim.run.experiment import Experiment

TEXT = """
schema = 1
robots = [{ model = "rhino_xr4" }]
[[objects]]
name = "cube"
shapes = [{ kind = "block", length = "5 cm", width = "6 cm", height = "70 mm" }]
[[cameras]]
name = "eye"
on = "rhino_xr4.tool"
size = [640, 480]
focal = [800, 810]
[task]
kind = "ibvs"
gain = 1.5
[start]
q = ["1 deg", "-92 deg", "92 deg", "1 deg", "-90 deg"]
[run]
dt = "40 ms"
"""
MISTAKES = {
    "a misspelt key": (
        "gain = 1.5",
        "gian = 1.5",
        "task.gian: unknown key 'gian'; did you mean 'gain'?",
    ),
    "no unit": ('"40 ms"', "0.04", "run.dt: 0.04: expected one number with a unit of time (s, ms)"),
    "another unit": (
        '"5 cm"',
        '"5 deg"',
        "objects.cube.shapes[0].length: '5 deg': expected one number with a unit of length",
    ),
    "no such kind": ('"ibvs"', '"ibsv"', "task.kind: no kind 'ibsv'; did you mean 'ibvs'? kinds:"),
    "a missing key": (
        ', width = "6 cm"',
        "",
        "objects.cube.shapes[0].width: missing, and it must be given",
    ),
    "out of bounds": ("1.5", "-1", "task.gain: must be greater than 0, got -1"),
    "another type": ("[640, 480]", '"VGA"', "cameras.eye.size: must be a valid list, got 'VGA'"),
    "no such frame": (
        "rhino_xr4.tool",
        "rhino_xr4.tol",
        "cameras.eye.on: no frame 'rhino_xr4.tol'; did you mean 'rhino_xr4.tool'?",
    ),
    "too few": (
        '"1 deg", "-90',
        '"-90',
        "start.q: 4 coordinates, expected 5: shoulder, upper_arm,",
    ),
    "two ways at once": (
        "focal =",
        "K = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nfocal =",
        "cameras.eye: K and focal: give one of them only",
    ),
}


def refusal(text):
    with pytest.raises(rs.errors.FileError) as caught:
        Experiment.from_text(text, "bench.toml")
    return str(caught.value)


@pytest.mark.parametrize("what", MISTAKES)
def test_a_mistake_is_reported_in_one_line(what):
    old, new, told = MISTAKES[what]
    assert old in TEXT
    message = refusal(TEXT.replace(old, new, 1))
    assert message.startswith(f"bench.toml: {told}") and "\n" not in message


def test_several_are_reported_together_and_none_because_of_another():
    text, several = TEXT, ("a misspelt key", "no unit", "another unit", "another type")
    for what in several:
        old, new, _ = MISTAKES[what]
        text = text.replace(old, new, 1)
    lines = sorted(refusal(text).split("\n"))
    expected = sorted(f"bench.toml: {MISTAKES[what][2]}" for what in several)
    assert len(lines) == len(expected)
    assert all(line.startswith(told) for line, told in zip(lines, expected, strict=True))


TEN = """
schema = 1
tittle = "bench"
robots = [{ model = "rhino_xr5" }]
[[objects]]
name = "cube"
shapes = [{ kind = "block", length = "5 deg", width = "6 cm" }, { kind = "bloc" }]
[[cameras]]
name = "eye"
on = "rhino_xr5.tool"
size = "VGA"
focal = [800, 810]
[task]
kind = "ibvs"
gain = -1
interaction = "curent"
[sensing]
noise = "1 m"
[run]
dt = 0.04
"""
TOLD = [
    "robots.rhino_xr5.model: no robot 'rhino_xr5' in the library; did you mean 'rhino_xr4'? "
    "robots: car,",
    "objects.cube.shapes[0].length: '5 deg': expected one number with a unit of length",
    "objects.cube.shapes[0].height: missing, and it must be given",
    "objects.cube.shapes[1].kind: no kind 'bloc'; did you mean 'block'? kinds: ball, block,",
    "cameras.eye.size: must be a valid list, got 'VGA'",
    "tittle: unknown key 'tittle'; did you mean 'title'? keys: robots, objects,",
    "task.interaction: must be 'current', 'desired', 'mean', 'broyden' or a matrix of 6 columns, "
    "got 'curent'; did you mean 'current'?",
    "task.gain: must be greater than 0, got -1",
    "sensing.noise: must be a valid number, got '1 m'",
    "run.dt: 0.04: expected one number with a unit of time",
]


def test_ten_mistakes_in_one_file_are_ten_messages():
    """No error mentions the frame of the camera, for its robot is invalid."""
    lines = refusal(TEN).split("\n")
    assert len(lines) == len(TOLD) == 10
    for line, told in zip(lines, TOLD, strict=True):
        assert line.startswith(f"bench.toml: {told}")


def test_a_kind_that_needs_a_table_is_shown_in_one():
    text = TEXT[: TEXT.index("[task]")].replace("schema = 1", 'schema = 1\ntask = "ibvs"')
    assert refusal(text).endswith("""got 'ibvs', as in { kind = "ibvs" }""")
