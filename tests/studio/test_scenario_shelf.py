"""The shipped experiments on their shelf: groups, pictures, and the words of a search."""

from __future__ import annotations

import base64
import json

import pytest

from robsim import examples
from robsim.files.example_groups import GROUPS, find_group
from robsim.studio.scenario_shelf import ScenarioShelf
from robsim.studio.session import Session

LARGEST = 400_000  # bytes of all pictures
MESSAGE = 65_536  # bytes of a message


@pytest.fixture(scope="module")
def shelf():
    return ScenarioShelf.shipped()


def test_each_experiment_is_in_one_group(shelf):
    grouped = [name for names in GROUPS.values() for name in names]
    assert sorted(grouped) == list(examples.names()) and len(GROUPS["Begin here"]) == 5
    assert [each["name"] for each in shelf.entries] == grouped
    assert all(each["group"] == find_group(each["name"]) for each in shelf.entries)
    assert find_group("nothing") == ""


def test_each_experiment_has_a_small_picture(shelf):
    pictures = shelf.pictures()
    assert sorted(pictures) == list(examples.names())
    data = [base64.b64decode(each.partition(",")[2]) for each in pictures.values()]
    assert all(each[:4] == b"RIFF" and each[8:12] == b"WEBP" for each in data)
    assert len(set(data)) == len(data) and sum(map(len, data)) < LARGEST


def test_the_words_of_the_whole_remark_can_be_searched(shelf):
    entry = next(each for each in shelf.entries if each["name"] == "camera_retreat")
    assert entry["about"].startswith("The camera should only turn") and "\n" not in entry["about"]
    assert entry["more"].endswith("--set task.interaction=mean")
    assert len(json.dumps({"type": "gallery", "entries": shelf.entries})) < MESSAGE


def test_a_studio_serves_the_pictures_without_an_open_experiment(shelf, tmp_path):
    media, content = Session(None, shelf).download("pictures.json")
    assert media == "application/json" and json.loads(content) == shelf.pictures()
    (tmp_path / "one.toml").write_text("schema = 1\n")
    assert json.loads(Session(None, ScenarioShelf.of(tmp_path)).download("pictures.json")[1]) == {}
