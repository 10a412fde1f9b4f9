"""The display of robots, scenes, explanations and comparisons in notebooks and interpreters."""

import base64
import io
import re

import numpy as np
import pytest
from matplotlib.image import imread

import robsim as rs
from robsim.analysis.explanation.findings import Finding
from robsim.base.html import format_html_table
from robsim.page.export import build_notebook_bundle


def cells(html):
    """Texts of all cells, row by row."""
    rows = re.findall(r"<tr>(.*?)</tr>", html)
    return [re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row) for row in rows]


ARM = rs.Robot.from_dh(
    [[0, 0, 1, 0], [0, 0, 1, 0]], limits=[[-1, 1], [-np.inf, np.inf]], name="arm"
)


def test_a_robot_is_a_line_and_a_table_of_its_coordinates():
    assert repr(ARM) == "<Robot 'arm': 3 links to 'link2', coordinates: link1, link2>"
    head, first, second = cells(ARM._repr_html_())
    assert head == ["coordinate", "lowest", "highest", "home"]
    assert first == ["link1", "-57.3°", "57.3°", "0°"]
    assert second == ["link2", "", "", "0°"]


def test_a_robot_of_many_joints_is_a_line_too():
    text = repr(rs.Robot.from_dh([[0, 0, 1, 0]] * 30, name="snake"))
    assert text.endswith("link7, link8, ... (30 in all)>") and "\n" not in text
    post = rs.Robot("post", [rs.joints.Link("base")])
    assert repr(post) == "<Robot 'post': one link to 'base', coordinates: none>"


def test_a_scene_is_a_line_for_each_thing():
    lens = rs.Camera([[800, 0, 320], [0, 800, 240], [0, 0, 1]], (640, 480))
    dot = rs.Object("dot", marks=[[1, 0, 2]])
    scene = rs.Scene(ARM, dot, rs.MountedCamera("eye", lens, "arm.link2"))
    assert repr(scene).splitlines() == [
        "<Scene",
        "  robot 'arm' on world: coordinates: link1, link2",
        "  object 'dot' on world: one mark",
        "  camera 'eye' on arm.link2: 640 x 480 px>",
    ]
    assert cells(scene._repr_html_())[3] == ["camera", "eye", "arm.link2", "640 x 480 px"]
    many = rs.Scene(objects=[rs.Object(f"thing{i}", marks=[[0, 0, i]]) for i in range(40)])
    assert len(repr(many).splitlines()) == 14 and repr(many).endswith("... (40 in all)>")


def test_an_explanation_is_a_table_of_reasons_and_advice():
    cause, advice = Finding("noise", "a < b & c"), Finding("gain", "Try gain=0.5.")
    found = rs.analysis.Explanation(
        rs.Outcome.LOCAL_MINIMUM, "It stopped.", 1.0, (cause,), (advice,), ("so",)
    )
    assert cells(found._repr_html_()) == [
        ["Why", "a &lt; b &amp; c"],
        ["Note", "so"],
        ["Try", "Try gain=0.5."],
    ]
    assert len(repr(found).splitlines()) == 1


def test_a_comparison_is_the_table_that_it_prints():
    one = rs.load_scenario(rs.examples.path("camera_retreat"))
    tasks = {"<b>image</b>": rs.IBVS(one.task.goal), "pose": rs.PBVS(one.task.goal)}
    found = rs.compare(one.scene, tasks, one.start, duration=1)
    head, first, second = cells(found._repr_html_())
    assert head[:2] == ["scheme", "outcome"] and len(head) == len(first) == len(second)
    assert (first[0], second[0]) == ("&lt;b&gt;image&lt;/b&gt;", "pose")
    printed = str(found).splitlines()[2].split()
    assert [text for text in first[2:] if text != "-"][-1] == [t for t in printed if t != "-"][-1]


@pytest.mark.parametrize("text", ["<script>", 'a "b"', "x & y", "<img src=x onerror=y>"])
def test_every_text_is_escaped(text):
    html = format_html_table(text, [(text, 3)], (text, text), text)
    assert text not in html
    assert "<td" in html and "<br>" in format_html_table("two\nlines", [])


def picture(bundle):
    data = base64.b64decode(bundle["image/png"])
    assert data.startswith(b"\x89PNG") and len(data) <= 22_000
    return (imread(io.BytesIO(data), format="png")[..., :3] * 255).round().astype(int)


def test_a_run_in_a_notebook_has_a_picture_behind_its_page():
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial"))
    run = experiment.run(duration=0.4)
    bundle = build_notebook_bundle(run)
    html, image = bundle["text/html"], picture(bundle)
    assert image.shape == (320, 736, 3)
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 20
    goal = (np.abs(image - (214, 0, 122)) < 60).all(axis=2)  # the outline of the goal
    assert goal[:, :416].sum() > 10 and goal[:, 416:].sum() > 10
    assert f"data:image/png;base64,{bundle['image/png']}" in html
    assert html.count("<iframe") == 1 and 'sandbox="allow-scripts"' in html


def test_without_its_page_the_picture_is_left():
    arm = rs.Robot.from_dh([[0, 0, 1, 0]], name="arm")
    html = build_notebook_bundle(arm)["text/html"]
    rest = re.sub(r"<iframe.*?</iframe>|<style>.*?</style>", "", html, flags=re.S)
    assert re.fullmatch(r"<div [^>]*><img alt=[^>]*></div>", rest)


def test_an_experiment_has_its_table_and_a_picture():
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial"))
    bundle = build_notebook_bundle(experiment)
    assert bundle["text/html"] == experiment._repr_html_()
    assert picture(bundle).shape == (320, 416, 3)


def test_a_batch_has_its_table_alone():
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial"))
    batch = rs.simulate(
        experiment.scene, experiment.task, np.stack([experiment.start] * 2), duration=0.2
    )
    assert build_notebook_bundle(batch).keys() == {"text/html"}
