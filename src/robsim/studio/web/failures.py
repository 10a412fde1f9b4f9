"""Failures inside: logged the first time at each place, and never told to the outside."""

from __future__ import annotations

import logging

WORDS = "internal error; the command's own output says more"
_LOG = logging.getLogger("robsim.studio")


class Failures:
    """What has failed so far, so that a page cannot fill the log by asking again."""

    def __init__(self) -> None:
        self._known: set[str] = set()

    def log(self, what: str) -> None:
        """Log the exception that is being handled, unless the same failed before."""
        if what not in self._known:
            self._known.add(what)
            _LOG.exception("%s failed; when it fails again, nothing is said", what)
