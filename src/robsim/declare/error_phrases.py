"""Phrases of error messages about valid values."""

from __future__ import annotations


def join_alternatives(*phrases: str) -> str:
    """Return phrases joined by commas and "or"."""
    *most, last = phrases
    return f"{', '.join(most)} or {last}" if most else last
