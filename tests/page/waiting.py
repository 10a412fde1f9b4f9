"""Waiting for a page."""

import time

PATIENCE = 60.0  # seconds; other tests compile and draw on the same cores
DRAWN = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


def until(page, expression):
    """Wait until an expression of JavaScript is true, which the page's policy leaves to us."""
    end = time.monotonic() + PATIENCE
    while not page.evaluate(expression):
        if time.monotonic() > end:
            state = page.evaluate("window.robsim?.state")
            raise AssertionError(f"never true: {expression}; state: {state}")
        page.wait_for_timeout(50)


def wait_for_frame(page):
    """Wait until the page has drawn a whole frame."""
    page.evaluate(DRAWN)
