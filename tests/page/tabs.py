"""Tabs of a browser that tests use one after the other.

A new tab starts a process, which compiles the scripts of a page. A page in a used tab is ready in
half the time.
"""

import json
from weakref import WeakKeyDictionary

LOOK = {"viewport": {"width": 1280, "height": 800}, "reduced_motion": "reduce"}
COPY = "GPU stall due to ReadPixels"  # Chromium's own copy of a canvas; our pages read no pixels
FREE = WeakKeyDictionary()  # the tabs that no test uses, by browser and look


class Tabs:
    """Tabs of one test, with its listeners for the events of a page, by the names of the events."""

    def __init__(self, browser, **listeners):
        self.free, self.browser = FREE.setdefault(browser, {}), browser
        self.listeners, self.taken = listeners, []

    def take(self, listeners=(), **options):
        """Return an empty tab with the options of a context, and with listeners of its own."""
        heard = {**self.listeners, **dict(listeners)}
        look = {**LOOK, **options}
        key = json.dumps(look, sort_keys=True)
        free = self.free.setdefault(key, [])
        page = free.pop() if free else self.browser.new_context(**look).new_page()
        self.taken.append((page, look["viewport"], free, heard))
        for event, listener in heard.items():
            page.on(event, listener)
        return page

    def leave(self):
        """Leave the open tabs to the next test."""
        from playwright.sync_api import Error

        for page, viewport, free, heard in self.taken:
            if page.is_closed():
                continue
            for event, listener in heard.items():
                page.remove_listener(event, listener)
            try:
                empty(page, viewport)
            except Error:
                page.context.close()
            else:
                free.append(page)
        self.taken.clear()


def heed_console(complaints):
    """Return a listener that adds messages to `complaints`, except warnings with `COPY`."""

    def heed(said):
        if said.type != "warning" or COPY not in said.text:
            complaints.append(said.text)

    return heed


def empty(page, viewport):
    """Restore the state of a new tab."""
    for other in page.context.pages:
        if other is not page:
            other.close()
    page.unroute_all()
    page.evaluate("localStorage.clear(); sessionStorage.clear()")
    page.goto("about:blank")
    page.context.clear_cookies()
    page.set_viewport_size(viewport)
    page.mouse.move(0, 0)
