"""Waiting for a page."""

import time

from page.drivers import ChromiumDriver

PATIENCE = 60.0  # seconds; other tests compile and draw on the same cores
DRAWN = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


def until(page, expression):
    """Wait until an expression of JavaScript is true, which the page's policy leaves to us."""
    wait_until_true(ChromiumDriver(page), expression)


def wait_until_true(driver, expression, seconds=PATIENCE):
    """Wait until an expression is true in the page of a browser of `page.drivers`."""
    end = time.monotonic() + seconds
    while not driver.evaluate(f"Boolean({expression})"):
        if time.monotonic() > end:
            state = driver.evaluate("window.robsim?.state")
            raise AssertionError(f"never true: {expression}; state: {state}")
        driver.wait(0.05)


def wait_for_frame(page):
    """Wait until the page has drawn a whole frame."""
    page.evaluate(DRAWN)
