"""Version, date and metadata of a release agree in all files that state them."""

import json
import re
import tomllib
from pathlib import Path

import pytest

import robsim as rs

ROOT = Path(__file__).parents[2]
OFFLINE = "docs/howto/offline.md"
CONDA_NAMES = {"matplotlib": "matplotlib-base"}  # without a toolkit of windows


def text(path):
    return (ROOT / path).read_text(encoding="utf-8")


def project():
    return tomllib.loads(text("pyproject.toml"))["project"]


def value(path, key):
    """The only value of a key in a file of YAML, without quotes and a comment."""
    (found,) = re.findall(rf"^\s*{key}: *(.+?)(?: +#.*)?$", text(path), re.M)
    return found.strip("\"'")


def items(path, key):
    """The items of a list in a file of YAML."""
    (block,) = re.findall(rf"^( *){key}:\n((?:\1 +- .*\n)+)", text(path), re.M)
    return re.findall(r"- (.+?)(?: +#.*)?\n", block[1])


def test_the_version_and_its_date_are_the_same_everywhere():
    version, date = re.findall(r"^## (\S+) \((\S+)\)$", text("CHANGELOG.md"), re.M)[0]
    assert version == rs.__version__ == value("CITATION.cff", "version")
    assert version == value("recipe/recipe.yaml", r"context:\n\s*version")
    assert set(re.findall(r"robsim-([\d.]+)-py3", text(OFFLINE))) == {version}
    assert date == value("CITATION.cff", "date-released")


def test_the_citation_repeats_the_metadata():
    metadata = project()
    assert value("CITATION.cff", "title") == "RobSim"
    assert value("CITATION.cff", "abstract") == metadata["description"]
    assert value("CITATION.cff", "license") == metadata["license"] == "BSD-3-Clause"
    assert items("CITATION.cff", "keywords") == metadata["keywords"]
    authors = re.findall(r'^  - name: "(.+)"$', text("CITATION.cff"), re.M)
    assert authors == [author["name"] for author in metadata["authors"]]
    assert authors[0].removeprefix("The ") in text("LICENSE")


def test_the_recipe_has_the_requirements_of_the_package():
    metadata = project()
    wanted = [f"python {metadata['requires-python']}"]
    for each in metadata["dependencies"]:
        name, version = re.fullmatch(r"([\w-]+)(>=[\d.]+)", each).groups()
        wanted.append(f"{CONDA_NAMES.get(name, name)} {version}")
    assert items("recipe/recipe.yaml", "run") == wanted
    (build,) = tomllib.loads(text("pyproject.toml"))["build-system"]["requires"]
    assert build.replace(">=", " >=") in items("recipe/recipe.yaml", "host")
    (command,) = metadata["scripts"].items()
    assert items("recipe/recipe.yaml", "entry_points") == [" = ".join(command)]
    for key, named in (("summary", "description"), ("license", "license")):
        assert value("recipe/recipe.yaml", key) == metadata[named]


def test_the_workflow_runs_scripts_of_the_checks_alone():
    steps = re.findall(r"^ *-? *run: (?!$)(.+)$", text(".github/workflows/check.yml"), re.M)
    assert steps == [".ci/first_commands"]
    begins = [rf"^(start \w+ )?{re.escape(step)}\b" for step in steps]
    assert all(re.search(begin, text(".ci/run"), re.M) for begin in begins)


def test_the_workflow_covers_three_systems_and_the_pythons_of_the_metadata():
    matrix = {
        key: re.findall(r"[\w.-]+", value(".github/workflows/check.yml", key))
        for key in ("os", "python")
    }
    assert [each.partition("-")[0] for each in matrix["os"]] == ["ubuntu", "macos", "windows"]
    found = re.findall(r"Python :: (3\.\d+)$", "\n".join(project()["classifiers"]), re.M)
    assert matrix["python"] == found == ["3.11", "3.12", "3.13", "3.14"]
    assert project()["requires-python"] == f">={found[0]}"


def test_no_address_is_invented():
    written = [text(path) for path in ("pyproject.toml", "CITATION.cff", "recipe/recipe.yaml")]
    assert not re.findall(r"https?://(?:www\.)?(?:example|github|gitlab)\S*", "\n".join(written))
    assert json.loads(text(".devcontainer/devcontainer.json"))["name"] == "RobSim"


@pytest.mark.parametrize("form", sorted((ROOT / ".github/ISSUE_TEMPLATE").glob("*_*.yml")))
def test_a_form_asks_for_its_evidence(form):
    assert re.search(r"^name: .+\ndescription: .+\n", form.read_text(encoding="utf-8"))
    assert "required: true" in form.read_text(encoding="utf-8")
