"""Two browsers that one script can drive: Chromium by Playwright, Firefox by WebDriver BiDi."""

import base64
import itertools
import json
import time
from typing import ClassVar

STEP = 0.03  # seconds between two motions of the pointer


def list_points(start, stop, steps):
    """The points of a straight motion of the pointer, without its start."""
    shares = [(i + 1) / steps for i in range(steps)]
    return [
        tuple(a + share * (b - a) for a, b in zip(start, stop, strict=True)) for share in shares
    ]


class ChromiumDriver:
    """A page of Playwright."""

    def __init__(self, page):
        self.page = page

    def evaluate(self, expression):
        return self.page.evaluate(expression)

    def wait(self, seconds):
        self.page.wait_for_timeout(1000 * seconds)

    def click(self, x, y):
        self.page.mouse.click(x, y)

    def drag(self, start, stop, steps=8):
        """Press the button at a point of the page, move in steps, and release it."""
        self.page.mouse.move(*start)
        self.wait(0.15)
        self.page.mouse.down()
        for point in list_points(start, stop, steps):
            self.page.mouse.move(*point)
            self.wait(STEP)
        self.page.mouse.up()

    def type_text(self, text):
        """Replace the text of the focused field, and press Enter."""
        self.page.keyboard.press("Control+a")
        self.page.keyboard.type(text)
        self.page.keyboard.press("Enter")

    def press(self, keys):
        self.page.keyboard.press(keys)


class FirefoxDriver:
    """A tab of Firefox, by the WebDriver BiDi protocol."""

    KEYS: ClassVar = {"Enter": "\ue007", "Escape": "\ue00c", "Control": "\ue009", "Shift": "\ue008"}

    def __init__(self, socket):
        self.socket, self.numbers = socket, itertools.count()
        self.call("session.new", capabilities={})
        self.context = self.call("browsingContext.getTree")["contexts"][0]["context"]

    def call(self, method, **params):
        number = next(self.numbers)
        self.socket.send(json.dumps({"id": number, "method": method, "params": params}))
        while True:
            answer = json.loads(self.socket.recv(timeout=60))
            if answer.get("id") == number:
                assert "result" in answer, answer
                return answer["result"]

    def open(self, address):
        self.call("browsingContext.navigate", context=self.context, url=address, wait="complete")

    def evaluate(self, expression):
        text = f"JSON.stringify({expression}) ?? 'null'"
        where = {"target": {"context": self.context}, "awaitPromise": False}
        return json.loads(self.call("script.evaluate", expression=text, **where)["result"]["value"])

    def take_picture(self):
        """Return the tab as PNG."""
        shot = self.call("browsingContext.captureScreenshot", context=self.context)
        return base64.b64decode(shot["data"])

    def wait(self, seconds):
        time.sleep(seconds)

    def act(self, kind, actions):
        source = {"type": kind, "id": kind, "actions": actions}
        self.call("input.performActions", context=self.context, actions=[source])

    def click(self, x, y):
        self.drag((x, y), (x, y), 0)

    def drag(self, start, stop, steps=8):
        """Press the button at a point of the page, move in steps, and release it."""
        actions = [_move(start, 0.15), {"type": "pointerDown", "button": 0}]
        actions += [_move(point, STEP) for point in list_points(start, stop, steps)]
        self.act("pointer", [*actions, {"type": "pointerUp", "button": 0}])

    def type_text(self, text):
        """Replace the text of the focused field, and press Enter."""
        self.press("Control+a")
        for key in [*text, "Enter"]:
            self.press(key)

    def press(self, keys):
        """Press one key while others are held, such as "Control+z"."""
        codes = [self.KEYS.get(key, key) for key in keys.split("+")]
        downs = [{"type": "keyDown", "value": code} for code in codes]
        ups = [{"type": "keyUp", "value": code} for code in reversed(codes)]
        self.act("key", [*downs, *ups])


def _move(point, seconds):
    x, y = (round(value) for value in point)
    return {"type": "pointerMove", "x": x, "y": y, "duration": round(1000 * seconds)}
