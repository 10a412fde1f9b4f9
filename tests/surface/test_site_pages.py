"""The pages of the site that tools/site writes: examples with figures, benchmarks with plots."""

import re
import sys
from importlib import import_module
from pathlib import Path

import pytest

pytestmark = pytest.mark.full  # as other checks of the repository
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def site():
    """The modules of tools/site by name."""
    sys.path.insert(0, str(ROOT / "tools/site"))
    names = ("example_pages", "benchmark_pages", "benchmark_plots", "markdown_tables")
    yield {name: import_module(name) for name in names}
    sys.path.remove(str(ROOT / "tools/site"))


@pytest.fixture(scope="module")
def examples(site, tmp_path_factory):
    folder = tmp_path_factory.mktemp("docs") / "examples"
    return folder, site["example_pages"].write_example_pages(folder)


@pytest.fixture(scope="module")
def benchmarks(site, tmp_path_factory):
    folder = tmp_path_factory.mktemp("docs") / "benchmarks"
    return folder, site["benchmark_pages"].write_benchmark_pages(folder)


def test_every_example_has_a_page_and_a_group(site, examples):
    folder, names = examples
    expected = {f"{path.stem}.md" for path in (ROOT / "examples").glob("*.py")}
    expected |= {"pose_network.md", "tag_cell.md", "udp_robot.md", "index.md"}
    assert set(names) == expected == {path.name for path in folder.glob("*.md")}
    groups = site["example_pages"].GROUPS.values()
    assert sorted(name for names in groups for name in names) == sorted(
        name.removesuffix(".md") for name in names[1:]
    )


def test_a_page_has_text_figures_the_live_page_and_the_whole_code(examples):
    page = (examples[0] / "joint_lag.md").read_text(encoding="utf-8")
    assert page.startswith("# Joints that lag behind their command make the error overshoot\n")
    assert "](../gallery/joint_lag.png)" in page and "\n\n<!-- live: joint_lag -->\n\n" in page
    code = (ROOT / "examples/joint_lag.py").read_text(encoding="utf-8")
    assert f"```python\n{code.rstrip()}\n```" in page
    assert "#joints-that-lag)" in page.split("## Explanation")[1]


def test_a_page_of_a_folder_shows_its_files(examples):
    page = (examples[0] / "tag_cell.md").read_text(encoding="utf-8")
    assert re.findall(r"^## (.+)$", page, re.M)[:3] == ["arm.urdf", "cell.toml", "ost.yaml"]
    assert "```xml\n" in page and "```toml\n" in page and "```yaml\n" in page


def test_all_links_of_the_examples_lead_to_files(examples):
    folder, names = examples
    for name in names:
        page = (folder / name).read_text(encoding="utf-8")
        prose = re.sub(r"```(?:python|toml|xml|yaml)\n.*?```", "", page, flags=re.S)
        for link in re.findall(r"\]\(([^)#]+)", prose):
            here = folder / link
            assert here.exists() or (ROOT / "docs/examples" / link).resolve().exists(), link


def test_every_figure_that_an_example_saves_is_stored(site):
    pages = site["example_pages"]
    for script in (ROOT / "examples").glob("*.py"):
        saved = re.findall(r'\.savefig\(f?"([^"]+)"', script.read_text(encoding="utf-8"))
        figures = pages.read_script(script).figures
        assert len(figures) >= len(saved), script.name
        assert all(len(figure.text) > 15 for figure in figures)


def test_numbers_of_a_plot_are_the_numbers_of_the_text(site):
    """A parsed number equals its cell: spot checks by hand, then every bar of every plot."""
    text = (ROOT / "benchmarks/README.md").read_text(encoding="utf-8")
    _, sections = site["benchmark_pages"].read_sections()
    tables = {each.title: site["markdown_tables"].read_tables(each.text) for each in sections}
    bars = {}
    for plot in site["benchmark_plots"].PLOTS:
        for group in plot.read(tables[plot.section]):
            for bar in group.bars:
                bars[plot.name, group.title, bar.label] = bar.value
                assert f"| {bar.text} |" in text and bar.value == float(bar.text.replace(",", ""))
    for (plot, group, label), line in {
        ("step_of_the_loop", "a run and step of the batch", "RobSim"): "| the same | {} | JAX",
        ("kinematics", "jacobian", "Pinocchio"): "| `jacobian` | 3.0 | Pinocchio | {} | 0.2 |",
        ("pictures", "320 x 240 pixels", "riley"): "| riley | 1 | {} | 10.5 |",
        ("inverse_kinematics", "panda", "RobSim"): "| panda | 100 % | {} | 180.8 |",
        ("photometric", "a step", "a single run"): "| a single run | {} | 1 |",
        ("schemes", "PBVS", "4,096 runs"): "| 48.7 | 2.23 | 0.44 | 5.1 | 2.05 | {} | 4.9 |",
        ("dynamics", "mass matrix", "RobSim, in a batch"): "| mass matrix | 0.9 | | 2.4 | {} |",
        ("poses", "other, 12 marks", "OpenCV"): "| other, 12 marks | 156 | {} | 10 |",
    }.items():
        assert line.format(f"{bars[plot, group, label]:g}") in text


def test_the_pages_of_the_benchmarks_hold_the_whole_text(site, benchmarks):
    folder, names = benchmarks
    intro, sections = site["benchmark_pages"].read_sections()
    assert names[0] == "index.md" and len(names) == len(sections) + 1
    index = (folder / "index.md").read_text(encoding="utf-8")
    assert intro.partition("\n")[2].strip() in index
    for section, name in zip(sections, names[1:], strict=True):
        page = (folder / name).read_text(encoding="utf-8")
        assert section.text.splitlines()[-1] in page and len(page.split()) < 1500
        assert f"]({name})" in index
        for link in re.findall(r"\]\(([\w.]+)\)|\{image\} (\S+)", page):
            assert (folder / "".join(link)).exists()


def test_a_plot_is_the_same_file_each_time(site, benchmarks, tmp_path):
    again = tmp_path / "again"
    site["benchmark_pages"].write_benchmark_pages(again)
    for path in again.glob("*.svg"):
        assert path.read_bytes() == (benchmarks[0] / path.name).read_bytes()
