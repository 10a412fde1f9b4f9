"""Formatting of fitted numbers with their intervals."""

from __future__ import annotations

import math

import numpy as np

from robsim.analysis.explanation.text_format import format_list
from robsim.base.arrays import Array
from robsim.geometry.pose import Pose


def format_interval(value: float, half: float, unit: str = "") -> str:
    """Format a number with the half width of its interval, rounded to two digits of the latter.

    >>> format_interval(0.86912, 0.0123), format_interval(4.0, 0.0, "px")
    ('0.869 +- 0.012', '4 +- 0 px')
    """
    tail = f" {unit}" if unit else ""
    if not math.isfinite(half):
        return f"{value:.3g} (not determined){tail}"
    if half <= 1e-6 * abs(value):
        return f"{value:.4g} +- 0{tail}"
    digits = max(1 - math.floor(math.log10(half)), 0)
    return f"{round(value, digits):g} +- {half:.2g}{tail}"


def format_change(twist: Array, half: Array) -> str:
    """Format the change of a pose by a twist (6,) in m and rad, with half widths (6,).

    >>> format_change(np.array([0.01, 0, 0, 0, 0, 0.1]), np.array([0.001] * 3 + [0.01] * 3))
    'turned by 5.73 +- 0.57 degrees and moved by 10 +- 1 mm'
    """
    metres, angle = Pose.exp(twist).position, np.degrees(twist[3:])
    moved, turned = (
        _format_norm(1e3 * metres, 1e3 * half[:3], "mm"),
        _format_norm(angle, np.degrees(half[3:]), "degrees"),
    )
    parts = [f"turned by {turned}"] if turned else []
    parts += [f"moved by {moved}"] if moved else []
    return format_list(parts) or "another one"


def _format_norm(values: Array, half: Array, unit: str) -> str:
    """Format the norm of a vector (3,), or "" if it is below its half width."""
    size = float(np.linalg.norm(values))
    width = float(np.linalg.norm(values * half)) / size if size else math.inf
    return format_interval(size, width, unit) if size > width else ""
