"""Phrases of error messages about valid values."""

from __future__ import annotations


def join_alternatives(*phrases: str) -> str:
    """Return phrases joined by commas and "or"."""
    *most, last = phrases
    return f"{', '.join(most)} or {last}" if most else last


def pluralize(noun: str) -> str:
    """Return the plural of the noun of a family.

    >>> pluralize("law"), pluralize("trajectory"), pluralize("kind of moments")
    ('laws', 'trajectories', 'kinds of moments')
    """
    head, of, tail = noun.partition(" of ")
    many = f"{head[:-1]}ies" if head.endswith("y") else f"{head}s"
    return many.replace("matrixs", "matrices") + of + tail
