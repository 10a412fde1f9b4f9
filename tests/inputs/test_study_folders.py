"""Folders that should hold a study, and the message of the studio if they do not."""

import json

import pytest

import robsim as rs
from robsim.cli.studio_command import _load_shown
from robsim.page import load_recording


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """The folder of a study of eight runs."""
    folder = tmp_path_factory.mktemp("study")
    one = rs.load_scenario(rs.examples.path("visp_tutorial")).with_(duration=0.4)
    rs.study(
        one, 4, start=rs.starts.LookAt(distance=(0.5, 1)), vary={"task.gain": [1, 2]}, store=folder
    )
    return folder


@pytest.fixture
def folder(kept, tmp_path):
    """A copy of it."""
    for path in kept.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path


def test_the_folder_of_a_study_is_known_by_its_file(folder):
    shown, shelf = _load_shown(folder)
    assert shelf is None and isinstance(shown, rs.studies.StudyResult)
    assert shown.hash == rs.open_study(folder).hash and len(shown.table) == 8


def newer(folder):
    about = json.loads((folder / "study.json").read_text())
    (folder / "study.json").write_text(json.dumps({**about, "format": 99, "robsim": "7.0"}))


def cut(folder):
    part = next(folder.glob("rows-*.parquet"))
    part.write_bytes(part.read_bytes()[:-40])


def short(folder):
    part = next(folder.glob("rows-*.parquet"))
    part.rename(folder / part.name.replace("0000000000008", "0000000000009"))


def without_rows(folder):
    next(folder.glob("rows-*.parquet")).unlink()


def without_text(folder):
    (folder / "study.toml").unlink()


def garbled(folder):
    (folder / "study.json").write_text("[]")


def without_about(folder):
    (folder / "study.json").unlink()


DAMAGE = [
    (newer, "a study of format 99, of RobSim 7.0; this is"),
    (cut, ".parquet is damaged, or of another study; delete it, and resume the study"),
    (short, ".parquet is damaged, or of another study; delete it, and resume the study"),
    (without_rows, "the study has no runs yet, so it has no map"),
    (without_text, "study.toml"),
    (garbled, "study.json: not in the form that RobSim writes"),
    (without_about, "no study here: study.json is missing"),
]


@pytest.mark.parametrize(("damage", "reason"), DAMAGE)
def test_a_fault_of_a_study_is_reported_before_anything_is_served(damage, reason, folder, called):
    damage(folder)
    status, out, err = called("studio", folder, "--no-open")
    assert status == 2 and not out
    assert reason in err and err.startswith("error: ") and err.count("\n") == 1


def test_a_map_has_bounds(kept, monkeypatch):
    monkeypatch.setattr("robsim.page.study_map.MOST_RUNS", 7)
    with pytest.raises(rs.errors.InputError, match="at most 7 runs, and this study has 8"):
        rs.export_html(rs.open_study(kept), "x.html")


def test_a_page_of_a_study_is_no_recording(kept, tmp_path):
    path = rs.export_html(rs.open_study(kept), tmp_path / "map.html")
    with pytest.raises(
        rs.errors.FileError, match="its format is 'robsim study', not 'robsim recording'"
    ):
        load_recording(path)
