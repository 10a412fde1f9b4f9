"""The panel of the interaction matrix shows the numbers of the shown instant."""

import numpy as np
import pytest
from page.conftest import until
from page.test_studio_page import Desk

import robsim as rs
from robsim.studio.studio import studio

pytestmark = pytest.mark.browser

TABLE = """() => [...document.querySelectorAll("#matrix tbody tr")]
  .map((row) => [...row.cells].slice(1).map((cell) => Number(cell.textContent.replace("−", "-"))))"""


@pytest.fixture
def desk(chromium):
    with studio(rs.load_scenario(rs.examples.path("visp_tutorial"))) as server:
        made = Desk(chromium, server)
        made.app = server._app
        yield made
        for context in made.contexts:
            context.close()
    assert not made.complaints


def test_the_panel_shows_the_matrix_of_the_shown_instant(desk):
    page = desk.page()
    until(page, "robsim.clock.times.length > 5")
    assert page.locator("#matrix table").count() == 0  # it is closed, and asks for nothing
    page.keyboard.press("m")
    for index in (0, 3):
        page.evaluate(
            f"robsim.clock.following = false; robsim.clock.seek(robsim.clock.times[{index}])"
        )
        until(page, f"robsim.matrix.message?.index === {index}")
        bench = desk.app.bench
        L = bench.experiment.scene.interaction(bench.pair.live.instants[index].q)
        np.testing.assert_allclose(page.evaluate(TABLE), L.matrix, atol=0.0051)
    assert "rank 6 of 6" in page.inner_text("#matrix")
    page.locator("#matrix select").select_option(index=1)
    assert page.inner_text("#matrix thead").split()[0].startswith("body")
    asked = page.evaluate(
        """() => { const asked = []; const own = robsim.link.ask.bind(robsim.link);
        robsim.link.ask = (request) => { if ("interaction" in request) asked.push(performance.now()); own(request); };
        robsim.heldBack = asked; robsim.clock.toEnd(); robsim.clock.following = true; }"""
    )
    assert asked is None
    until(page, "robsim.heldBack.length > 4")
    times = page.evaluate("robsim.heldBack")
    assert np.diff(times).min() > 199
    page.keyboard.press("m")
    assert not page.evaluate("document.getElementById('matrix').open")
