"""Gestures of a person on the page of a studio, and the poses and values that the page shows."""

import numpy as np
from page.waiting import wait_until_true

from robsim import Pose

BALL = """(() => {{
  const {{ space }} = robsim.view;
  const p = robsim.handles.balls.get('{0}').position.clone().project(space.camera);
  const box = space.renderer.domElement.getBoundingClientRect();
  return [box.left + ((p.x + 1) / 2) * box.width, box.top + ((1 - p.y) / 2) * box.height];
}})()"""
FRAME = """(() => {{ const each = robsim.view.space.frames.find((f) => f.name === '{0}');
  return [...each.position.toArray(), ...each.quaternion.toArray()]; }})()"""
ROW = """[...document.querySelectorAll('#controls .lil-controller')]
  .find((row) => row.querySelector('.lil-name')?.textContent === '{0}')"""
CENTRE = """(() => {{ const each = {0}; each.scrollIntoView({{ block: 'center' }});
  const box = each.getBoundingClientRect();
  return [box.left + box.width / 2, box.top + box.height / 2]; }})()"""
TRACK = """(() => {{ const {{ header, arrays, space }} = robsim.view;
  const at = (name) => header.frames.findIndex((f) => f.name === name && f.group === 'true');
  const [time, poses, n] = [[...arrays.time.values], arrays.poses.values, header.frames.length];
  const row = (i, k) => [...poses.slice(7 * (i * n + k), 7 * (i * n + k) + 7)];
  const [camera, target] = ['{0}', '{1}'].map(at);
  return time.map((t, i) => [t, ...row(i, camera), ...row(i, target)]); }})()"""


def measure_offset(one, other):
    """Return the distance (mm) and the angle (degrees) between two poses."""
    difference = one.inv() @ other
    return 1e3 * np.linalg.norm(difference.position), np.degrees(np.linalg.norm(difference.rotvec))


def make_pose(numbers):
    """Return the pose of position and quaternion (x, y, z, w)."""
    return Pose.from_quaternion(numbers[:3], numbers[3:] / np.linalg.norm(numbers[3:]))


class Hands:
    """A person at the page of a studio; `driver` is a browser of `page.drivers`."""

    def __init__(self, driver):
        self.driver = driver
        self.until("document.body.dataset.ready")

    def until(self, expression, seconds=30.0):
        """Wait until an expression of the page is true."""
        wait_until_true(self.driver, expression, seconds)

    def ask(self, request):
        """Send a request, and wait until it has been handled."""
        before = self.read("requests")
        self.driver.evaluate(f"robsim.link.ask({request})")
        self.until(f"robsim.state.requests > {before}")

    def read(self, name):
        """Return a part of the state of the studio."""
        return self.driver.evaluate(f"robsim.state.{name}")

    def play_to_rest(self):
        """Simulate at the highest speed until the run has converged and rests, or has ended."""
        self.ask("{speed: 0}")
        self.ask("{play: true}")
        self.until("robsim.state.resting || (robsim.state.outcome && !robsim.state.playing)", 60)
        self.driver.wait(0.3)

    def pose(self, frame):
        """Return the pose of a frame in the scene graph of the page."""
        return make_pose(np.array(self.driver.evaluate(FRAME.format(frame))))

    def track(self, camera, target):
        """Return the times and the poses of the target in the camera, as the page shows them."""
        rows = np.array(self.driver.evaluate(TRACK.format(camera, target)))
        poses = [make_pose(row[1:8]).inv() @ make_pose(row[8:]) for row in rows]
        return rows[:, 0], poses

    def grab(self, handle):
        """Click the ball of a handle, and return its place on the page."""
        self.driver.evaluate("robsim.clock.toEnd()")
        held = f"robsim.handles.choice.held === '{handle}'"
        for _ in range(10):  # the layout may have moved under the pointer: click again
            self.driver.click(*self.driver.evaluate(BALL.format(handle)))
            self.driver.wait(0.3)
            if self.driver.evaluate(held):
                break
        self.until(held)
        self.driver.wait(0.3)
        return self.driver.evaluate(BALL.format(handle))

    def pull(self, handle, right, down):
        """Drag the ball of a handle by pixels; the simulation pauses meanwhile."""
        self.ask("{play: false}")
        x, y = self.grab(handle)
        self.driver.drag((x, y), (x + right, y + down))
        self.driver.wait(0.5)

    def turn(self, handle, right, down):
        """Turn the body of a handle by dragging the outer ring of its rotation tool."""
        self.ask("{play: false}")
        self.grab(handle)
        self.set_mode(handle, "true")
        self.driver.wait(0.3)
        x, y = self.driver.evaluate(BALL.format(handle))
        self.driver.drag((x, y), (x + right, y + down))
        self.driver.wait(0.5)
        self.set_mode(handle, "false")

    def set_mode(self, handle, turns):
        """Let the tool of a handle turn or move its body."""
        change = f"robsim.handles.choice.turn = {turns}, robsim.handles.hold('{handle}')"
        self.driver.evaluate(f"({change})")

    def field(self, name):
        """Return the text in the field of a control."""
        return self.driver.evaluate(f"{ROW.format(name)}.querySelector('input, select').value")

    def type_value(self, name, text):
        """Type a value in the field of a control, and press Enter."""
        before, field = self.read("requests"), f"{ROW.format(name)}.querySelector('input')"
        while not self.driver.evaluate(f"document.activeElement === {field}"):
            self.driver.click(*self.driver.evaluate(CENTRE.format(field)))
            self.driver.wait(0.2)  # the layout may have moved under the pointer: click again
        self.driver.type_text(text)
        self.until(f"robsim.state.requests > {before}")
        self.driver.wait(0.2)

    def press_button(self, text):
        """Click the first button with a text."""
        button = f"[...document.querySelectorAll('button')].find((b) => b.textContent === '{text}')"
        before = self.read("requests")
        self.driver.click(*self.driver.evaluate(CENTRE.format(button)))
        self.until(f"robsim.state.requests > {before}")
