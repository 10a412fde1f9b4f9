"""Suites: published or agreed sets of starts on which anybody's scheme is compared."""
