"""Tabs of a browser: a tab that one test has left serves the next one.

A new tab starts a process, which compiles the scripts of a page anew; a page in a tab that has
shown one before is ready in half the time.
"""

import json
from weakref import WeakKeyDictionary

from playwright.sync_api import Error

LOOK = {"viewport": {"width": 1280, "height": 800}, "reduced_motion": "reduce"}
COPY = "GPU stall due to ReadPixels"  # as Chromium itself copies a canvas; no page reads pixels
FREE = WeakKeyDictionary()  # the tabs that nobody uses, by browser and look


class Tabs:
    """Tabs of one test, with what it listens to.

    Parameters
    ----------
    browser : playwright.sync_api.Browser
    **listeners : callable
        What is called on each event of a page, by the name of the event.

    """

    def __init__(self, browser, **listeners):
        self.free, self.browser = FREE.setdefault(browser, {}), browser
        self.listeners, self.taken = listeners, []

    def take(self, **options):
        """Return an empty tab of the look in the options, such as its viewport."""
        look = {**LOOK, **options}
        key = json.dumps(look, sort_keys=True)
        free = self.free.setdefault(key, [])
        page = free.pop() if free else self.browser.new_context(**look).new_page()
        self.taken.append((page, look["viewport"], free))
        for event, listener in self.listeners.items():
            page.on(event, listener)
        return page

    def leave(self):
        """Let the next test use the tabs that this one has not closed."""
        for page, viewport, free in self.taken:
            if page.is_closed():
                continue
            for event, listener in self.listeners.items():
                page.remove_listener(event, listener)
            try:
                empty(page, viewport)
            except Error:
                page.context.close()
            else:
                free.append(page)
        self.taken.clear()


def heed_console(complaints):
    """Return a listener that notes each message, but what the graphics say of Chromium's copy."""
    return lambda said: None if COPY in said.text else complaints.append(said.text)


def empty(page, viewport):
    """Remove everything that a test has left in a tab."""
    for other in page.context.pages:
        if other is not page:
            other.close()
    page.unroute_all()
    page.evaluate("localStorage.clear(); sessionStorage.clear()")
    page.goto("about:blank")
    page.context.clear_cookies()
    page.set_viewport_size(viewport)
    page.mouse.move(0, 0)
