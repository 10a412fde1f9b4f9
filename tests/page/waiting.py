"""Waiting for a page."""


def until(page, expression):
    """Wait until an expression of JavaScript is true, which the page's policy leaves to us."""
    for _ in range(200):
        if page.evaluate(expression):
            return
        page.wait_for_timeout(50)
    raise AssertionError(f"never true: {expression}")
