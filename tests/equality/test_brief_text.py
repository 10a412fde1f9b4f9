"""`to_toml` is as short as a handwritten file, and gives the same experiment to the last bit."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from draws import try_samples
from hypothesis import given
from hypothesis import strategies as st

import robsim as rs
from robsim import examples, load_scenario
from robsim.base.si_units import parse
from robsim.declare.quantities import DIMENSIONS, ExactQuantity
from robsim.declare.short_numbers import shorten_numbers
from robsim.files.toml import parse_toml as tables_of
from robsim.files.toml_layout import format_toml
from robsim.run.stored_data import find_stored_data

LENS = rs.Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]])


def lines_of(text):
    return [line for line in text.splitlines() if line.strip() and not line.startswith("#")]


def both(experiment):
    """The experiments of both texts, and the short one."""
    short = experiment.to_toml()
    stored_data = find_stored_data(experiment).values()
    texts = short, experiment.to_toml(complete=True)
    found = [rs.Experiment.from_text(text, stored_data=stored_data) for text in texts]
    assert found[0] == experiment == found[1] == found[0]
    assert found[0].to_toml(complete=True) == experiment.to_toml(complete=True)
    assert found[0].hash == found[1].hash == experiment.hash
    return short


FEW = (
    "wrong_dh",
    "mobile_arm",
    "inspection_a",
    "stereo_in_hand",
    "joint_lag",
    "chapter_6_2",
    "car",
)
EACH = [pytest.param(x, marks=[pytest.mark.full] * (x not in FEW)) for x in examples.names()]


@pytest.mark.parametrize("name", EACH)
@pytest.mark.few(3)
def test_a_shipped_scenario_is_as_short_as_its_file(name):
    path = Path(examples.path(name))
    short = both(load_scenario(path))
    assert len(short.splitlines()) <= 1.5 * len(lines_of(path.read_text())) + 10
    stored_data = find_stored_data(load_scenario(path)).values()
    assert rs.Experiment.from_text(short, stored_data=stored_data).to_toml() == short


def test_a_robot_of_the_library_takes_a_line():
    scenario = load_scenario(examples.path("eye_in_hand"))
    assert len(both(scenario).splitlines()) <= 45
    wrong = {"belief.cameras.camera.focal": [490, 505], "belief.robots.panda.rpy": "0, 0, 1 deg"}
    short = both(scenario.at(wrong))
    assert len(short.splitlines()) <= 50
    assert tables_of(short, "text")["belief"] == {
        "robots": [{"name": "panda", "rpy": "0, 0, 1 deg"}],
        "cameras": [{"name": "camera", "focal": [490, 505]}],
    }


def test_a_changed_robot_of_the_library_writes_the_change():
    scenario = load_scenario(examples.path("eye_in_hand"))
    names = {
        "robots.panda.links.link2.dh.d": 0.01,
        "robots.panda.links.link3.limits": ["-1 rad", "60 deg"],
        "robots.panda.position": "1, 2, 3 cm",
    }
    changed = scenario.at(names)
    (robot,) = tables_of(both(changed), "text")["robots"]
    links = [
        {"name": "link2", "dh": {"d": "1 cm"}},
        {"name": "link3", "limits": ["-1 rad", "60 deg"]},
    ]
    assert robot == {"model": "panda", "position": "1, 2, 3 cm", "links": links}


def test_a_robot_of_another_name_keeps_its_model():
    arm = replace(rs.robots.puma560(), name="arm")
    scene = rs.Scene(
        [arm], [rs.Object("dots", marks=np.eye(3))], [rs.MountedCamera("eye", LENS, "arm.flange")]
    )
    (robot,) = tables_of(both(rs.Experiment(scene, rs.IBVS())), "text")["robots"]
    assert robot == {"model": "puma560", "name": "arm"}


def test_a_robot_that_was_taken_apart_is_written_in_full():
    arm = rs.robots.puma560()
    links = [replace(link, parent=link.parent and "base") for link in arm.links[:3]]
    scene = rs.Scene(
        [replace(arm, links=tuple(links), home=None, tip="")],
        [rs.Object("dots", marks=np.eye(3))],
        [rs.MountedCamera("eye", LENS, "puma560.base")],
    )
    (robot,) = tables_of(both(rs.Experiment(scene, rs.IBVS())), "text")["robots"]
    assert "model" not in robot and len(robot["links"]) == 3


def test_a_belief_of_other_things_is_complete():
    scenario = load_scenario(examples.path("eye_in_hand"))
    fewer = replace(scenario.scene, objects=(*scenario.scene.objects, rs.Object("ghost")))
    short = both(scenario.with_(task=replace(scenario.task, belief=fewer)))
    belief = tables_of(short, "text")["belief"]
    assert belief["complete"] is True and belief["robots"] == [{"model": "panda"}]


def test_the_text_of_a_run_needs_no_library_and_is_short_again():
    scenario = load_scenario(examples.path("eye_in_hand")).with_(duration=0.2)
    run = scenario.with_(record=3).run()
    assert rs.Experiment.of(run).to_toml() == scenario.with_(record=3).to_toml()


TOOLED = """
schema = 1
objects = [{ name = "dots", marks = ["40, 0, 0 cm", "50, 0, 0 cm", "50, 10, 0 cm"] }]
cameras = [{ name = "eye", on = "arm.tip", focal = 800, size = [640, 480] }]
task = { kind = "ibvs" }
[[robots]]
model = "rhino_xr4"
name = "arm"
home = ["0 deg", "-90 deg", "90 deg", "0 deg", "10 deg"]
[[robots.tools]]
name = "stub"
links = [{ name = "plate", shapes = [{ kind = "ball", radius = "1 cm" }] }]
[[robots.tools]]
model = "rhino_gripper"
position = "0, 0, -10.83 cm"
on = "tool"
bare = true
"""


def test_the_tools_of_a_robot_are_called_by_their_names():
    scenario = rs.Experiment.from_text(TOOLED)
    (robot,) = tables_of(both(scenario), "text")["robots"]
    stub, gripper = robot.pop("tools")
    assert robot == {
        "model": "rhino_xr4",
        "name": "arm",
        "home": ["0 deg", "-90 deg", "90 deg", "0 deg", "10 deg"],
    }
    assert stub["name"] == "stub" and stub["links"][0]["name"] == "plate"
    assert gripper == {
        "model": "rhino_gripper",
        "position": "0, 0, -10.83 cm",
        "on": "tool",
        "bare": True,
    }


def test_the_tool_of_a_robot_is_changed_by_a_path_and_believed_elsewhere():
    scenario = rs.Experiment.from_text(TOOLED)
    name = "robots.arm.tools.rhino_gripper.position"
    moved = scenario.at(name, "0, 1, -10 cm")
    assert moved != scenario and "0, 1, -10 cm" in both(moved)
    belief = tables_of(both(scenario.at(f"belief.{name}", "0, 1, -10 cm")), "text")["belief"]
    tools = [{"name": "rhino_gripper", "position": "0, 1, -10 cm"}]
    assert belief == {"robots": [{"name": "arm", "tools": tools}]}


def test_a_robot_whose_tool_was_changed_by_hand_is_written_link_by_link():
    scenario = rs.Experiment.from_text(TOOLED)
    arm = scenario.scene.robot("arm")
    assert [each.tool.name for each in arm.mountings] == ["stub", "rhino_gripper"]
    shorter = replace(arm, links=arm.links[:-1], tip="palm", home=None)
    assert shorter.mountings == ()
    eye = replace(scenario.scene.camera("eye"), on="arm.palm")
    (robot,) = tables_of(
        both(scenario.with_(scene=replace(scenario.scene, robots=(shorter,), cameras=(eye,)))),
        "text",
    )["robots"]
    assert "tools" not in robot and len(robot["links"]) == len(shorter.links)


def test_the_study_of_a_file_stays_in_its_text():
    study = '[study]\nruns = 100\nvary = { "task.gain" = [0.5, 1.0] }\n'
    scenario = rs.Experiment.from_text(TOOLED + study)
    assert tables_of(scenario.to_toml(), "text")["study"] == scenario.study


@pytest.fixture
def arm(tmp_path):
    arm = rs.Robot.from_dh([[0, 0, 1, 0], [0, 0, 1, 0]], name="planar")
    arm.to_urdf(tmp_path / "planar.urdf")
    text = """
    schema = 1
    robots = [{ urdf = "planar.urdf", name = "arm" }]
    objects = [{ name = "dots", marks = ["0, 0, 1 m", "10, 0, 100 cm"] }]
    cameras = [{ name = "eye", on = "arm.link2", focal = 800, size = [640, 480] }]
    task = { kind = "ibvs", inverse = "damped" }
    """
    (tmp_path / "scenario.toml").write_text(text, encoding="utf-8")
    return load_scenario(tmp_path / "scenario.toml")


def test_a_urdf_file_is_named_as_it_lies_beside_the_text(arm, tmp_path, monkeypatch):
    (robot,) = tables_of(arm.to_toml(folder=tmp_path), "text")["robots"]
    assert robot == {"urdf": "planar.urdf", "name": "arm", "tip": "link2"}
    (tmp_path / "again.toml").write_text(arm.to_toml(folder=tmp_path), encoding="utf-8")
    assert load_scenario(tmp_path / "again.toml") == arm
    monkeypatch.chdir(tmp_path)
    assert 'urdf = "planar.urdf"' in both(arm)
    Path("elsewhere").mkdir()
    monkeypatch.chdir("elsewhere")
    assert f'urdf = "{(tmp_path / "planar.urdf").as_posix()}"' in both(arm)


def test_a_urdf_file_that_has_changed_or_gone_leaves_the_text_true(arm, tmp_path):
    (tmp_path / "planar.urdf").rename(tmp_path / "other.urdf")
    assert "urdf" not in both(arm) and "links = [" in both(arm)
    other = rs.Robot.from_dh([[0, 0, 2, 0], [0, 0, 1, 0]], name="planar")
    other.to_urdf(tmp_path / "planar.urdf")
    both(arm)


def test_python_code_has_no_short_text_either():
    class Mine(rs.laws.JointLaw):
        pass

    scene = load_scenario(examples.path("eye_in_hand")).scene
    with pytest.raises(rs.errors.InputError, match="has no text: Mine is Python code"):
        rs.Experiment(scene, rs.IBVS(law=Mine())).to_toml()


NAMES = {
    "task.gain": lambda x: abs(x) + 1e-3,
    "cameras.camera.focal": lambda x: 300 + 200 * abs(x),
    "cameras.camera.position": lambda x: [x, x / 3, 0.1],
    "cameras.camera.rpy": lambda x: [x, -x / 7, 0.0],
    "objects.plate.rotvec": lambda x: [0.0, x, 1 / 3],
    "objects.plate.marks": lambda x: np.round([[x, 0, 0], [0, x, 0], [0, 0, 1 / 7]], 6),
    "robots.puma560.links.forearm.dh.alpha": lambda x: x,
    "robots.puma560.links.forearm.dh.a": lambda x: x,
    "robots.puma560.position": lambda x: [0.0, x, -0.0],
    "belief.cameras.camera.focal": lambda x: 300 + 200 * abs(x),
    "belief.cameras.camera.center": lambda x: [x, 1e3 * x],
    "belief.robots.puma560.links.upper_arm.dh.theta": lambda x: x,
    "belief.objects.plate.position": lambda x: [x, x, x],
    "run.dt": lambda x: 1e-3 + abs(x) / 100,
    "sensing.noise": abs,
}
NUMBER = st.one_of(
    st.floats(-3, 3, allow_subnormal=False),
    st.decimals(-3, 3, places=2).map(float),
    st.integers(-170, 170).map(np.deg2rad),
)


@try_samples(
    4, 24, changes=st.dictionaries(st.sampled_from(sorted(NAMES)), NUMBER, min_size=1, max_size=5)
)
def test_whatever_is_changed_comes_back_from_a_short_text(changes):
    scenario = load_scenario(examples.path("wrong_dh"))
    made = {name: NAMES[name](float(x)) for name, x in changes.items()}
    short = both(scenario.at(made))
    assert len(short.splitlines()) < 80 and 'model = "puma560"' in short


@given(x=st.floats(-1e9, 1e9), unit=st.sampled_from(sorted(DIMENSIONS)))
def test_a_number_in_its_shortest_unit_is_the_same_to_the_last_bit(x, unit):
    text = shorten_numbers(ExactQuantity(x, unit))
    assert np.float64(parse(text, DIMENSIONS[unit])).tobytes() == np.float64(x).tobytes()
    assert len(text) <= len(ExactQuantity(x, unit))


def test_numbers_at_the_ends_of_their_range_have_texts():
    """In a smaller unit the largest numbers are infinite."""
    for x in (1.7e308, -1.7e308, 5e-324, -0.0):
        assert parse(shorten_numbers(ExactQuantity(x, "m")), "length").hex() == x.hex()


def test_numbers_are_as_people_write_them():
    options = {
        "22.86 cm": ExactQuantity(0.2286, "m"),
        "90 deg": ExactQuantity(np.deg2rad(90), "rad"),
        "40 ms": ExactQuantity(0.04, "s"),
        "-147 deg": ExactQuantity(-147 * rs.units.deg, "rad"),
        "1, 2, 3 mm": ExactQuantity([0.001, 0.002, 0.003], "m"),
        "0 m": ExactQuantity(0.0, "m"),
        "-0 m": ExactQuantity(-0.0, "m"),
        "1 rad": ExactQuantity(1.0, "rad"),
        "2.7 g/cm^3": ExactQuantity(2700.0, "kg/m^3"),
        "0.5": ExactQuantity(0.5, "1"),
    }
    assert {text: shorten_numbers(exact) for text, exact in options.items()} == {
        t: t for t in options
    }
    assert shorten_numbers({"a": [1.0, -0.0, 0.5, True, "1.0 m"]})["a"] == [
        1,
        -0.0,
        0.5,
        True,
        "1.0 m",
    ]


@try_samples(
    20,
    100,
    tables=st.dictionaries(
        st.text(max_size=8),
        st.recursive(
            st.one_of(st.booleans(), st.integers(-9, 9), st.floats(allow_nan=False), st.text()),
            lambda inner: st.one_of(
                st.lists(inner, max_size=9), st.dictionaries(st.text(max_size=40), inner)
            ),
            max_leaves=40,
        ),
    ),
)
def test_any_tables_are_laid_out_as_toml(tables):
    tables.pop("schema", None)
    assert tables_of(format_toml(tables), "text") == tables


def test_a_table_whose_only_entry_is_a_list_of_tables_is_laid_out():
    """A text of sixty lines or more has the densest layout, without a section for this table."""
    items = [{"name": f"point {i}", "place": [i, 2 * i, 3 * i]} for i in range(5)]
    tables = {f"part{i}": {"points": items} for i in range(20)}
    assert tables_of(format_toml(tables), "text") == tables


def test_the_default_folder_is_the_current_one():
    scenario = load_scenario(examples.path("visp_tutorial"))
    assert scenario.to_toml() == scenario.to_toml(folder=os.curdir)


def test_a_camera_of_normalised_coordinates_has_a_text_and_is_changed():
    """Its focal lengths are below a pixel, which a text can express by K alone."""
    lens = rs.Camera([[0.5, 0, 0], [0, 0.5, 0], [0, 0, 1]])
    eye = rs.MountedCamera("eye", lens, on="free_camera.body")
    dot = rs.Object("dot", marks=[[0, 0, 1], [0.1, 0, 1], [0, 0.1, 1.1], [0.1, 0.2, 1]])
    made = rs.Experiment(rs.Scene([rs.robots.free_camera()], [dot], [eye]), rs.IBVS())
    for text in (made.to_toml(), made.to_toml(complete=True)):
        assert rs.Experiment.from_text(text) == made
    assert made.at("cameras.eye.on", "world").scene.camera().camera == lens
