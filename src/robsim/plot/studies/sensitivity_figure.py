"""Figure of the sensitivity of an outcome to the columns of a study, as bars."""

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
BEND = 2.0  # eta above BEND |rho| indicates a dependence that is not monotonic


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

    The bars are correlation ratios eta, 0 to 1, and the whiskers their intervals. Blue bars rise
    with the column, vermillion bars fall with it. Grey bars belong to a choice, or to a dependence
    that is not monotonic ("bends"). The text beside a bar is the rank correlation rho.

    Parameters
    ----------
    study : Study, pandas.DataFrame or Sensitivity
        A study, its table, or a result of `robsim.studies.sensitivity.compute_sensitivity`.
    of : str, default "converged"
        "converged", or a column of numbers.
    axes : matplotlib.axes.Axes, optional
        Axes to draw into. Default: the axes of a new figure.
    size : (float, float), optional
        Width and height of a new figure in inches.
    title : str, optional
        Title of the axes. Default: the outcome and the number of runs.
    **settings
        `names`, `among` and `level` of `robsim.studies.sensitivity.compute_sensitivity`.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the figure that contains `axes`.

    Examples
    --------
    >>> import pandas as pd
    >>> rows = {"draw": range(100), "task.gain": [i / 100 for i in range(100)]}
    >>> outcomes = ["CONVERGED"] * 55 + ["DIVERGED"] * 45
    >>> figure = study_sensitivity(pd.DataFrame({**rows, "outcome": outcomes, "began": True}))
    >>> [text.get_text() for text in figure.axes[0].get_yticklabels()]
    ['task.gain']
    """
    result = study if isinstance(study, Sensitivity) else compute_sensitivity(study, of, **settings)
    with figure_style():
        height = max(1.2 + 0.42 * len(result.effects), 2.0)
        figure, (panel,) = prepare_panels(axes, 1, size, (7.6, height))
        for i, effect in enumerate(result.effects):
            _draw_effect_bar(panel, i, effect)
        names = [effect.name for effect in result.effects]
        panel.set_yticks(range(len(names)), labels=names)
        panel.set(xlim=(0, 1), ylim=(len(names) - 0.4, -0.6))
        panel.set_xlabel("correlation ratio η: nothing depends on it (0) to everything (1)")
        replace_frame_by_grid(panel, "x")
        panel.set_axisbelow(True)
        panel.tick_params(axis="y", length=0)
        subject = "whether a run converges" if result.of == "converged" else result.of
        counted = f"{format_thousands(result.runs)} runs that {result.among}"
        set_axes_title(panel, f"what matters for {subject}: {counted}", title)
    return figure


def _draw_effect_bar(axes: Axes, i: int, effect: Effect) -> None:
    """Draw the bar of one column with its whisker, and its direction as text beside it."""
    words, color = _describe_direction(effect)
    eta = effect.eta
    axes.barh(i, eta.value, height=0.55, color=color)
    ends = [[eta.value - eta.low], [eta.high - eta.value]]
    axes.errorbar([eta.value], [i], xerr=ends, fmt="none", ecolor=palette.BLACK, capsize=3, lw=1.1)
    inside = eta.high > 0.7  # a shorter bar has room beside it
    look: dict[str, Any] = {"ha": "right", "color": "white"} if inside else {"ha": "left"}
    at, offset = (eta.low, -6) if inside else (eta.high, 6)
    axes.annotate(words, (at, i), (offset, 0), va="center", fontsize=8, **_POINTS, **look)


def _describe_direction(effect: Effect) -> tuple[str, str]:
    """Return the direction of a dependence as text, and the colour of its bar."""
    rho, grey = effect.rho, palette.GREY
    if math.isnan(rho.value):
        return f"choice of {effect.groups}", grey
    text = f"ρ = {rho.value:+.2f}".replace("-", "\N{MINUS SIGN}")
    if effect.eta.low > 0 and effect.eta.value > BEND * abs(rho.value):
        return f"bends, {text}", grey
    if rho.low <= 0 <= rho.high:
        return text, palette.LIGHT_GREY
    direction, color = ("rises", palette.BLUE) if rho.value > 0 else ("falls", palette.VERMILLION)
    return f"{direction}, {text}", color
