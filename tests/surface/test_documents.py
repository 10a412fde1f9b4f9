"""The code in the README and the guides runs as printed."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import matplotlib
import pytest
import tomli_w
from front_door import public_objects

import robsim as rs
from robsim.cli.commands import cli
from robsim.declare import family
from robsim.features.feature import FEATURES

ROOT = Path(__file__).parents[2]
PAGES = [page for page in (ROOT / "docs").rglob("*.md") if page.parent.name != "reference"]
DOCUMENTS = sorted([ROOT / "README.md", *PAGES])
LONG = {"calibration", "driving", "logs", "outliers", "seven_steps", "visibility"}
RUN = [
    pytest.param(
        each, marks=[pytest.mark.full] * (each.stem in LONG and each.parent.name == "docs")
    )
    for each in DOCUMENTS
]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))

matplotlib.use("agg")


def blocks(document, language="python"):
    return re.findall(rf"```{language}\n(.*?)```", document.read_text(encoding="utf-8"), re.DOTALL)


def page_name(document):
    """The path of a page below the repository, which names its tests."""
    return document.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("document", RUN, ids=page_name)
@pytest.mark.few(6)
def test_its_python_runs_from_top_to_bottom(document, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {}  # as a reader has them who pastes the page
    for block in blocks(document):
        exec(compile(block, document.name, "exec"), names)


def test_the_tests_that_hold_the_promises_exist():
    named = re.findall(r"`(tests/[\w/.]+)(?:::(\w+))?`", (ROOT / "docs/promises.md").read_text())
    assert len(named) > 25
    for path, test in named:
        assert (ROOT / path).exists(), path
        assert not test or f"def {test}(" in (ROOT / path).read_text(), test


@pytest.mark.full
def test_the_written_pages_agree_with_the_code():
    """In a process of its own, without the kinds that tests register."""
    check = [sys.executable, ROOT / "docs/build.py", "--check"]
    done = subprocess.run(check, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


def test_every_public_name_has_an_entry_in_the_reference():
    names = [(module, name) for module, name, _ in public_objects()]
    pages = {m: (ROOT / f"docs/reference/{m}.md").read_text("utf-8") for m, _ in names}
    missing = [(m, name) for m, name in names if f"## `{name}`\n" not in pages[m]]
    assert missing == [] and len(pages) > 20


def test_every_command_and_every_option_is_in_the_reference():
    page = (ROOT / "docs/commands.md").read_text(encoding="utf-8")
    for name, command in cli.commands.items():
        section = page.split(f"\n## `robsim {name}`\n")[1].split("\n## ")[0]
        options = [option for each in command.params for option in each.opts]
        assert [o for o in options if o.startswith("-") and f"{o}" not in section] == []


def scenarios(document):
    """For each TOML block, the whole file; a block that is a fragment changes the one before."""
    tables = {}
    for block in blocks(document, "toml"):
        found = tomllib.loads(block)
        tables = found if "schema" in found else {**tables, **found}
        yield tomli_w.dumps(tables)


@pytest.mark.filterwarnings("ignore::robsim.base.errors.RankWarning")
@pytest.mark.parametrize("text", list(scenarios(ROOT / "docs" / "scenario.md")))
def test_its_scenarios_run_and_are_repeated(text):
    experiment = rs.Experiment.from_text(text)
    run = experiment.run()
    if isinstance(experiment.task, rs.Mission):
        assert run.succeeded and rs.Experiment.of(run).run().run.identical(run.run)
        return
    error = run["error_norm"].dropna("time").values
    assert error[-1] < 0.5 * error[0]
    assert rs.replay(run).identical(run)


def own(kinds):
    """The names of RobSim's own kinds, without those that a page registers."""
    return [name for name, kind in kinds.kinds.items() if kind.__module__.startswith("robsim.")]


def test_there_is_an_example_of_every_kind_of_task():
    text = (ROOT / "docs" / "scenario.md").read_text(encoding="utf-8")
    for kind in own(family("task")):
        assert f'kind = "{kind}"' in text and f'`"{kind}"`' in text


def keys(schema):
    """Yield the keys that a JSON schema accepts in any table."""
    if isinstance(schema, dict):
        yield from schema.get("properties", ())
    for value in schema.values() if isinstance(schema, dict) else schema:
        if isinstance(value, dict | list):
            yield from keys(value)


def test_every_key_of_a_scenario_file_is_named():
    """By the schema of a process of its own, without the kinds that tests register."""
    made = subprocess.run(
        [sys.executable, "-m", "robsim", "schema"], check=True, capture_output=True, text=True
    )
    known = set(keys(json.loads(made.stdout)))
    assert {"gain", "watchdog", "then", "noise"} <= known
    pages = [ROOT / "docs/scenario.md", *(ROOT / "docs/kinds").glob("*.md")]
    words = set(re.findall(r"\w+", "".join(page.read_text(encoding="utf-8") for page in pages)))
    assert sorted(known - words) == []


def test_the_weightings_are_named():
    text = (ROOT / "docs" / "scenario.md").read_text(encoding="utf-8")
    rs.weights.Tukey()  # its module registers them
    names = own(family("weighting"))
    assert {"border", "fade", "huber", "tukey", "cauchy"} <= set(names)
    assert all(f'"{name}"' in text for name in names)


def test_the_features_are_named():
    text = (ROOT / "docs" / "scenario.md").read_text(encoding="utf-8")
    assert all(f'"{name}"' in text for name in own(FEATURES))


def test_the_readme_shows_the_quickstart_example():
    shown, _ = blocks(ROOT / "README.md")
    example = (ROOT / "examples" / "quickstart.py").read_text(encoding="utf-8")
    assert example.split('"""', 2)[2].strip() == shown.strip()


def test_the_seven_steps_agree_with_the_example():
    shown = "\n".join(blocks(ROOT / "docs" / "seven_steps.md"))
    example = (ROOT / "examples" / "seven_steps.py").read_text(encoding="utf-8")
    lines = [line for line in example.split('"""', 2)[2].splitlines() if line]
    assert [line for line in shown.splitlines() if line] == lines


@pytest.mark.parametrize("document", DOCUMENTS, ids=page_name)
def test_its_links_lead_somewhere(document):
    links = re.findall(r"\]\((?!https?:)([^)#]+)\)", document.read_text(encoding="utf-8"))
    assert [link for link in links if not (document.parent / link).exists()] == []
