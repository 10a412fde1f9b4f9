"""What matters most in a study, as bars."""

from __future__ import annotations

import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robsim.plot import palette
from robsim.plot.canvas import figure_style, prepare_panels, replace_frame_by_grid, set_axes_title
from robsim.plot.studies.column_axis import format_thousands
from robsim.studies.sensitivity import Effect, Sensitivity, compute_sensitivity

_POINTS: dict[str, Any] = {"textcoords": "offset points"}
BEND = 2.0  # times |rho| above which eta tells of more than rising or falling


def study_sensitivity(
    study: Any,
    of: str = "converged",
    *,
    axes: Any = None,
    size: Any = None,
    title: str | None = None,
    **settings: Any,
) -> Figure:
    """Draw how much an outcome or a measure depends on each column of a study, as bars.

    study       a study, its table, or what `robsim.studies.sensitivity.compute_sensitivity` returned
    of          "converged", or a column of numbers
    settings    names, among and level of that function

    The bars are correlation ratios, 0 to 1, and the whiskers their intervals. Blue rises with the
    number, vermillion falls with it, grey is a choice or bends, which means that neither rises
    nor falls tells it; the text has the rank correlation. `axes` is one to draw into, instead of a
    new figure of `size` (width, height) inches.

    >>> import pandas as pd
    >>> rows = {"draw": range(100), "task.gain": [i / 100 for i in range(100)]}
    >>> outcomes = ["CONVERGED"] * 55 + ["DIVERGED"] * 45
    >>> figure = study_sensitivity(pd.DataFrame({**rows, "outcome": outcomes, "began": True}))
    >>> [text.get_text() for text in figure.axes[0].get_yticklabels()]
    ['task.gain']
    """
    found = study if isinstance(study, Sensitivity) else compute_sensitivity(study, of, **settings)
    with figure_style():
        height = max(1.2 + 0.42 * len(found.effects), 2.0)
        figure, (panel,) = prepare_panels(axes, 1, size, (7.6, height))
        for i, effect in enumerate(found.effects):
            _draw_effect_bar(panel, i, effect)
        names = [effect.name for effect in found.effects]
        panel.set_yticks(range(len(names)), labels=names)
        panel.set(xlim=(0, 1), ylim=(len(names) - 0.4, -0.6))
        panel.set_xlabel("correlation ratio η: nothing depends on it (0) to everything (1)")
        replace_frame_by_grid(panel, "x")
        panel.set_axisbelow(True)
        panel.tick_params(axis="y", length=0)
        what = "whether a run converges" if found.of == "converged" else found.of
        counted = f"{format_thousands(found.runs)} runs that {found.among}"
        set_axes_title(panel, f"what matters for {what}: {counted}", title)
    return figure


def _draw_effect_bar(axes: Axes, i: int, effect: Effect) -> None:
    """Draw the bar of one column with its whisker, and its direction as text beside it."""
    words, color = _describe_direction(effect)
    eta = effect.eta
    axes.barh(i, eta.value, height=0.55, color=color)
    ends = [[eta.value - eta.low], [eta.high - eta.value]]
    axes.errorbar([eta.value], [i], xerr=ends, fmt="none", ecolor=palette.BLACK, capsize=3, lw=1.1)
    inside = eta.high > 0.7  # else there is room beside the bar
    look: dict[str, Any] = {"ha": "right", "color": "white"} if inside else {"ha": "left"}
    at, beside = (eta.low, -6) if inside else (eta.high, 6)
    axes.annotate(words, (at, i), (beside, 0), va="center", fontsize=8, **_POINTS, **look)


def _describe_direction(effect: Effect) -> tuple[str, str]:
    """Return in words how an outcome depends on a column, and the colour of its bar."""
    rho, grey = effect.rho, palette.GREY
    if math.isnan(rho.value):
        return f"choice of {effect.groups}", grey
    text = f"ρ = {rho.value:+.2f}".replace("-", "\N{MINUS SIGN}")
    if effect.eta.low > 0 and effect.eta.value > BEND * abs(rho.value):
        return f"bends, {text}", grey
    if rho.low <= 0 <= rho.high:
        return text, palette.LIGHT_GREY
    way, color = ("rises", palette.BLUE) if rho.value > 0 else ("falls", palette.VERMILLION)
    return f"{way}, {text}", color
