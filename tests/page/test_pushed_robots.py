"""Handles of bodies that a robot carries, in a real browser."""

import numpy as np
import pytest
from page.waiting import until, wait_for_frame

import robsim as rs
from robsim.studio.studio import studio

pytestmark = pytest.mark.browser
AT = """(name) => {
  const { space } = robsim.view;
  const index = space.header.frames.findIndex((f) => f.name === name && f.group === "true");
  return space.frames[index].position.toArray();
}"""
BALL = "(name) => robsim.handles.balls.get(name)?.position.toArray()"


def test_a_pushed_camera_returns_to_its_goal(chromium):
    with studio(rs.load_scenario(rs.examples.path("eye_in_hand"))) as server:
        context = chromium.new_context(viewport={"width": 1280, "height": 800})
        page = context.new_page()
        page.goto(server.address)
        until(page, "document.body.dataset.ready")
        page.evaluate("robsim.link.ask({ speed: 0 })")
        page.evaluate("robsim.link.ask({ play: true })")
        until(page, "robsim.state.resting && robsim.clock.index === robsim.clock.times.length - 1")
        wait_for_frame(page)  # which places the last instant
        goal = np.array(page.evaluate(AT, "camera"))
        assert page.evaluate(BALL, "cameras.camera") == pytest.approx(goal, abs=1e-6)
        page.evaluate("robsim.link.ask({ play: false })")
        until(page, "!robsim.state.playing")
        page.evaluate("robsim.handles.hold('cameras.camera')")
        page.evaluate(
            "const ball = robsim.handles.balls.get('cameras.camera');"
            "ball.position.x += 0.03; robsim.handles.send();"
        )
        until(page, "robsim.state.since > 5 && !robsim.state.resting")
        until(page, f"Math.abs(({AT})('camera')[0] - {goal[0]}) > 0.02")  # its instant has arrived
        pushed = np.array(page.evaluate(AT, "camera"))
        assert pushed - goal == pytest.approx([0.03, 0.0, 0.0], abs=1e-5)
        page.evaluate("robsim.link.ask({ play: true })")
        until(page, "robsim.state.resting && robsim.clock.index === robsim.clock.times.length - 1")
        wait_for_frame(page)
        assert page.evaluate(AT, "camera") == pytest.approx(goal, abs=1e-5)
        assert page.evaluate(BALL, "cameras.camera") == pytest.approx(goal, abs=1e-5)
        context.close()


def test_a_hand_that_rests_during_a_drag_has_sent_its_newest_pose(desk):
    page = desk.page()
    sent = page.evaluate("""async () => {
      const { handles } = robsim;
      const [poses, ball] = [[], [...handles.balls.values()][0]];
      handles.hold(ball.name);
      handles.drag = (name, pose) => poses.push(pose[0]);
      for (const x of [1, 2, 3]) {
        ball.position.x = x;
        handles.sendLater();
      }
      await new Promise((done) => setTimeout(done, 200));
      return poses;
    }""")
    assert sent == [1, 3]  # the first at once, the last after the interval, none in between
