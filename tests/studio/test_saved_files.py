"""Files that a page saves: scenario, Python code, run, page and film of one experiment."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

import robsim as rs
from robsim import examples, load_scenario
from robsim.errors import InputError
from robsim.page import load_recording
from robsim.studio.downloads import build_download, format_file_name, format_saved_scenario
from robsim.studio.python_code import find_changes, format_python_code
from robsim.studio.workbench import Workbench

LINES = 60  # most lines of a saved scenario
FEW = ("inspection_b", "chapter_6_2", "wrong_dh", "visp_tutorial", "car")
EACH = [pytest.param(x, marks=[pytest.mark.full] * (x not in FEW)) for x in examples.names()]
TYPICAL = {"task.gain": 0.8, "run.duration": "7.5 s", "sensing.noise": 0.25}


def list_typical_edits(experiment):
    """Experiments after one more typical change each."""
    edits = [experiment]
    paths = {each.path: each for each in experiment.controls()}
    for name, value in TYPICAL.items():
        if name in paths:
            edits.append(edits[-1].at(name, value))
    camera = experiment.scene.cameras[0].name
    edits.append(edits[-1].at(f"belief.cameras.{camera}.focal", [812, 808]))
    thing = experiment.scene.objects[0].name
    here = paths[f"objects.{thing}.position"]
    edits.append(edits[-1].at(here.changes([x + 0.005 for x in here.value])))
    if "start.q" in paths:
        start = paths["start.q"]
        edits.append(edits[-1].at(start.changes([x + 0.001 for x in start.value])))
    return edits


def run_code(code):
    found = {}
    exec(code.partition("run = ")[0], found)
    return found["experiment"]


@pytest.mark.parametrize("name", EACH)
def test_the_saved_scenario_and_the_code_are_short_and_exact(name):
    original = load_scenario(examples.path(name))
    edits = list_typical_edits(original)
    for each in edits if name == "visp_tutorial" else (edits[0], edits[-1]):
        text = format_saved_scenario(each)
        assert len(text.splitlines()) <= LINES
        assert text.startswith("#") == (each is not original)
        assert rs.Experiment.from_text(text) == each
        code = format_python_code(each)
        assert run_code(code) == each and "load_scenario" in code


def test_the_code_reads_like_one_of_a_person():
    experiment = load_scenario(examples.path("eye_in_hand"))
    changed = experiment.at({"task.gain": 0.8, "objects.plate.rotvec": "0, 0, 12.5 deg"})
    assert format_python_code(changed).splitlines() == [
        "import robsim as rs",
        "",
        'experiment = rs.load_scenario(rs.examples.path("eye_in_hand")).at({',
        '    "objects.plate.rpy": "0, 0, 12.5 deg",',
        '    "task.gain": 0.8,',
        "})",
        "run = experiment.run()",
        "rs.show(run)",
    ]
    assert format_saved_scenario(changed).splitlines()[0] == (
        '# eye_in_hand.toml with objects.plate.rpy = "0, 0, 12.5 deg", task.gain = 0.8'
    )


def test_a_change_back_to_a_default_is_a_change():
    experiment = load_scenario(examples.path("visp_tutorial"))
    assert find_changes(experiment, experiment.at("task.gain", 1)) == {"task.gain": 1}
    assert find_changes(experiment, experiment) == {}


@pytest.mark.parametrize("title", ["it's \\ '''' and \"quoted\"", 'three """ quotes', "Käse"])
def test_an_experiment_without_a_file_is_written_in_full(title, tmp_path):
    shipped = load_scenario(examples.path("visp_tutorial"))
    experiment = rs.Experiment(shipped.scene, shipped.task, title=title)
    code = format_python_code(experiment)
    assert run_code(code) == experiment and "from_text" in code
    assert format_file_name(experiment, "film.gif").isascii()


def test_the_code_of_an_own_file_runs_without_the_file(tmp_path):
    shipped = load_scenario(examples.path("visp_tutorial"))
    other = tmp_path / "it's.toml"
    other.write_text(shipped.text, encoding="utf-8")
    moved = load_scenario(other).at("task.gain", 2)
    code = format_python_code(moved)
    assert "# it's.toml with task.gain = 2" in code and str(tmp_path) not in code
    other.unlink()
    assert run_code(code) == run_code(format_python_code(moved)) == moved


def test_the_code_of_a_file_that_needs_further_files_loads_it(tmp_path):
    mesh = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
    (tmp_path / "plate.stl").write_text(mesh + "endloop\nendfacet\nendsolid s\n")
    text = load_scenario(examples.path("visp_tutorial")).text
    shape = 'shapes = [{ kind = "mesh", filename = "plate.stl" }]'
    own = tmp_path / "own.toml"
    own.write_text(text.replace('name = "square"', f'name = "square"\n{shape}'), encoding="utf-8")
    experiment = load_scenario(own)
    code = format_python_code(experiment)
    assert run_code(code) == experiment and str(own) in code


def test_a_long_value_is_named_in_the_remark():
    experiment = load_scenario(examples.path("chapter_6_1"))
    start = np.array([-0.349062417462177, -1.78022744, 1.91985558, -0.2094413, -2.26892])
    changed = experiment.at("task.gain", 60).with_(start=start, seed=3)
    assert format_saved_scenario(changed).splitlines()[0] == (
        "# chapter_6_1.toml with task.gain = 60, run.seed = 3, another start.q"
    )


def test_the_files_are_named_after_the_experiment():
    experiment = load_scenario(examples.path("eye_in_hand"))
    names = ("experiment.toml", "experiment.py", "run.nc", "run.html", "film.mp4")
    assert [format_file_name(experiment, each) for each in names] == [
        *("eye_in_hand.toml", "eye_in_hand.py", "eye_in_hand-run.nc", "eye_in_hand-run.html"),
        "eye_in_hand.mp4",
    ]
    own = rs.Experiment(experiment.scene, experiment.task, title='Grün: a "plate"/../x\n')
    assert format_file_name(own, "run.nc") == "grun-a-plate-x-run.nc"
    assert format_file_name(own.with_(title="???"), "run.nc") == "experiment-run.nc"


def test_run_and_page_are_those_of_the_bench(tmp_path):
    bench = Workbench(load_scenario(examples.path("visp_tutorial")))
    for _ in range(20):
        bench.step()
    bench.set("task.gain", 0.8)
    for _ in range(5):
        bench.step()
    saved = bench.saved_experiment()
    (tmp_path / "run.nc").write_bytes(build_download(saved, bench.recording, "run.nc")[1])
    with rs.open_run(tmp_path / "run.nc") as run:
        assert np.array_equal(run["q"], saved.run()["q"], equal_nan=True)
        assert rs.Experiment.of(run) == saved
    (tmp_path / "run.html").write_bytes(build_download(saved, bench.recording, "run.html")[1])
    page, shown = load_recording(tmp_path / "run.html"), bench.recording()
    assert page.header["texts"] == shown.header["texts"] and len(page.arrays["time"]) == 26
    for name, values in shown.arrays.items():
        stored = page.arrays[name]  # some in 32 bits
        assert np.allclose(stored, values, rtol=1e-6, atol=5e-6, equal_nan=True), name


def test_a_film_opens_and_an_installation_without_pyav_says_so(tmp_path, monkeypatch):
    from PIL import Image

    experiment = load_scenario(examples.path("visp_tutorial")).with_(duration=0.4)
    media, content = build_download(experiment, None, "film.gif")
    Path(tmp_path / "film.gif").write_bytes(content)
    with Image.open(tmp_path / "film.gif") as film:
        assert media == "image/gif" and film.n_frames > 1 and film.size == (960, 540)
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match="needs PyAV: pip install"):
        build_download(experiment, None, "film.mp4")
    assert build_download(experiment, None, "film.avi") is None
