"""The panel of the interaction matrix shows the numbers of the shown instant."""

import numpy as np
import pytest
from page.waiting import until

pytestmark = pytest.mark.browser

TABLE = """() => [...document.querySelectorAll("#matrix tbody tr")]
  .map((row) => [...row.cells].slice(1).map((cell) => cell.textContent.replace("−", "-")))"""

COUNT = """() => {
  const ask = robsim.link.ask.bind(robsim.link);
  robsim.counted = 0;
  robsim.link.ask = (request) => {
    robsim.counted += 1;
    ask(request);
  };
  for (const time of robsim.clock.times) robsim.clock.seek(time);
}"""


def test_the_panel_shows_the_matrix_of_the_shown_instant(desk):
    page = desk.page()
    page.keyboard.press("Shift+ArrowRight")
    until(page, "robsim.clock.times.length === 11")
    assert page.locator("#matrix table").count() == 0  # it is closed
    page.keyboard.press("m")
    for index in (0, 3):
        page.evaluate(f"robsim.clock.seek(robsim.clock.times[{index}])")
        until(page, f"robsim.matrix.message?.index === {index}")
        bench = desk.app.bench
        L = bench.experiment.scene.interaction(bench.pair.live.instants[index].q)
        np.testing.assert_allclose(np.array(page.evaluate(TABLE), float), L.matrix, atol=0.0051)
    assert "rank 6 of 6" in page.inner_text("#matrix")
    page.locator("#matrix select").select_option(index=1)
    assert page.inner_text("#matrix thead").split()[0].startswith("body")
    page.evaluate(COUNT)
    until(page, "robsim.matrix.message.index === 10")
    assert page.evaluate("robsim.counted") <= 2  # of eleven instants in less than a period
    page.keyboard.press("m")
    assert not page.evaluate("document.getElementById('matrix').open")
