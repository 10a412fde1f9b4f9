"""A change of the experiment changes its entries in the scene of the page, and nothing else."""

import numpy as np
import pytest
from page.desk import open_desk
from page.waiting import until

import robsim as rs

pytestmark = pytest.mark.browser
DRAWN = "[...robsim.view.space.items.values()].flatMap((item) => item.nodes.map((n) => n.uuid))"
EYE = "robsim.view.space.camera.position.toArray()"
WAY = """() => {
  const { trails, frames } = robsim.view.header;
  const second = trails.findIndex((t) => frames[t.frame].group === "second");
  const line = robsim.view.space.groups.trails.children[2 * second];
  const at = line.geometry.attributes.position.array;
  const count = robsim.view.arrays.time.shape[0];
  return { visible: line.visible, points: [...at.slice(0, 3 * count)] };
}"""


def test_a_change_keeps_the_view_and_the_other_bodies(chromium):
    experiment = rs.load_scenario(rs.examples.path("eye_in_hand"))
    with open_desk(chromium, experiment) as desk:
        page = desk.page()
        page.locator("#step").click()
        until(page, "robsim.clock.times.length === 2")
        page.evaluate("robsim.view.space.camera.position.x += 0.3")
        eye, drawn = page.evaluate(EYE), set(page.evaluate(DRAWN))
        ask = "robsim.link.ask({ set: ['belief.objects.plate.position', [0.45, 0.1, 0.0]] })"
        page.evaluate(ask)
        until(page, "robsim.view.space.groups.belief.children.length > 0")
        assert drawn < set(page.evaluate(DRAWN)) and page.evaluate(EYE) == eye
        ghost = "robsim.view.space.groups.belief.children[0]"
        until(page, f"{ghost}.visible && Math.abs({ghost}.position.y - 0.1) < 1e-5")
        page.keyboard.press("Home")  # before the change there was no belief
        until(page, f"!{ghost}.visible")
        assert len(page.evaluate("robsim.clock.times")) == 2


def test_the_path_of_the_second_scheme_grows_with_its_run(chromium):
    experiment = rs.load_scenario(rs.examples.path("visp_tutorial"))
    with open_desk(chromium, experiment) as desk:
        page = desk.page()
        page.evaluate("robsim.link.ask({ second: ['task.interaction', 'desired'] })")
        until(page, "robsim.view.header.trails.length === 2")
        page.evaluate("robsim.link.ask({ step: 15 })")
        until(page, "robsim.clock.times.length === 16")
        until(page, "robsim.view.late === undefined")
        way = page.evaluate(WAY)
        run = experiment.at("task.interaction", "desired").run()["q"].values[:16]
        there = experiment.scene.display.matrix @ experiment.scene.pose("camera", run).matrix
        assert way["visible"]
        assert np.allclose(np.reshape(way["points"], (16, 3)), there[:, :3, 3], atol=1e-5)
        page.evaluate("robsim.view.space.show({ second: false })")
        assert not page.evaluate(WAY)["visible"]
