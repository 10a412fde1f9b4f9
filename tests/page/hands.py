"""Gestures of a person on the page of a studio, and the poses and values that the page shows."""

import time

import numpy as np

from robsim import Pose

FRAME = """(() => {{ const f = robsim.view.space.frames.find((f) => f.name === '{0}');
  return [...f.position.toArray(), ...f.quaternion.toArray()]; }})()"""
BALL = """(() => {{
  const {{ space }} = robsim.view;
  const p = robsim.handles.balls.get('{0}').position.clone().project(space.camera);
  const box = space.renderer.domElement.getBoundingClientRect();
  return [box.left + ((p.x + 1) / 2) * box.width, box.top + ((1 - p.y) / 2) * box.height];
}})()"""
FIELD = """(() => {{
  const rows = [...document.querySelectorAll('#controls .lil-controller')];
  const row = rows.find((r) => r.querySelector('.lil-name')?.textContent === '{0}');
  const field = row.querySelector('{1}');
  field.scrollIntoView({{ block: 'center' }});
  return {2};
}})()"""
CENTRE = "((b) => [b.left + b.width / 2, b.top + b.height / 2])({}.getBoundingClientRect())"


class Hands:
    """A person at the page of a studio.

    `driver` is a browser; see `page.drivers`.
    """

    def __init__(self, driver):
        self.driver = driver

    def until(self, expression, seconds=20.0):
        """Wait until an expression of the page is true."""
        end = time.monotonic() + seconds
        while not self.driver.evaluate(f"Boolean({expression})"):
            assert time.monotonic() < end, f"never true: {expression}: {self.state()}"
            self.driver.wait(0.05)

    def state(self):
        return self.driver.evaluate("robsim.state")

    def ask(self, request):
        self.driver.evaluate(f"robsim.link.ask({request})")

    def pose(self, frame):
        """The pose of a frame in the scene graph of the page."""
        numbers = np.array(self.driver.evaluate(FRAME.format(frame)))
        return Pose.from_quaternion(numbers[:3], numbers[3:] / np.linalg.norm(numbers[3:]))

    def relative(self, camera, target):
        """The pose of the target in the camera, as the page shows both."""
        return self.pose(camera).inv() @ self.pose(target)

    def play_to_rest(self, seconds=40.0):
        """Simulate at the highest speed until the run has converged or ended."""
        self.ask("{speed: 0}")
        self.ask("{play: true}")
        ended = "robsim.state.outcome && robsim.state.outcome !== 'CONVERGED'"
        self.until(f"robsim.state.resting || ({ended})", seconds)

    def grab(self, handle):
        """Click the ball of a handle, and return its place on the page."""
        self.driver.evaluate("robsim.clock.toEnd()")
        x, y = self.driver.evaluate(BALL.format(handle))
        self.driver.click(x, y)
        self.until(f"robsim.handles.choice.held === '{handle}'")
        self.driver.wait(0.3)
        return self.driver.evaluate(BALL.format(handle))

    def pull(self, handle, right, down):
        """Drag the ball of a handle by pixels."""
        x, y = self.grab(handle)
        self.driver.drag((x, y), (x + right, y + down))
        self.driver.wait(0.4)

    def field(self, name, kind="input"):
        """The value in the field of a control."""
        return self.driver.evaluate(FIELD.format(name, kind, "field.value"))

    def type_value(self, name, text):
        """Type a value in the field of a control, and press Enter."""
        x, y = self.driver.evaluate(FIELD.format(name, "input", CENTRE.format("field")))
        self.driver.click(x, y)
        self.driver.type_text(text)
        self.driver.wait(0.3)
