"""Figure of the sensitivity of an outcome to the columns of a study, as bars."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from robsim.plot import palette
from robsim.plot.canvas import figure_style, prepare_panels, replace_frame_by_grid, set_axes_title
from robsim.plot.studies.column_axis import format_thousands
from robsim.studies.sensitivity import Effect, Sensitivity, compute_sensitivity

if TYPE_CHECKING:
    import pandas as pd

    from robsim.studies.study_result import StudyResult
    from robsim.studies.table_columns import Among

_POINTS: dict[str, Any] = {"textcoords": "offset points"}
BEND = 2.0  # the dependence is not monotonic if eta > BEND |rho|


def study_sensitivity(
    study: StudyResult | pd.DataFrame | Sensitivity,
    of: str = "converged",
    *,
    axes: Axes | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
    names: Sequence[str] | str | None = None,
    among: Among | None = None,
    level: float = 0.95,
) -> Figure:
    """Draw how much an outcome or a measure depends on each column of a study, as bars.

    The bars are correlation ratios eta, 0 to 1, and the whiskers their intervals. The outcome rises
    with the column of a blue bar, and falls with the column of a vermillion bar. Grey bars are
    columns of names, and dependences that are not monotonic ("bends"). Light grey bars have no
    clear direction. The text beside a bar is the rank correlation rho.

    Parameters
    ----------
    study : StudyResult, pandas.DataFrame or Sensitivity
        Result of a study, its table, or a result of `compute_sensitivity`. The options `names`,
        `among` and `level` do not apply to the latter.
    of : str, default "converged"
        "converged", or a column of numbers.
    axes : matplotlib.axes.Axes, optional
        Axes to draw into. Default: the axes of a new figure.
    size : (float, float), optional
        Width and height of a new figure in inches.
    title : str, optional
        Title of the axes. Default: the outcome and the number of runs.
    names : str or sequence of str, optional
        Columns to examine. Default: the varied columns, and the distance and the angle of the start
        from the goal.
    among : {"converged", "began"}, optional
        Counted runs. Default: the converged runs for a measure, and all runs that began for
        "converged".
    level : float, default 0.95
        Level of the intervals.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the figure that contains `axes`.

    Raises
    ------
    InputError
        If a column does not exist or has only one value, or if fewer than 20 runs are counted.

    Examples
    --------
    >>> import pandas as pd
    >>> rows = {"draw": range(100), "task.gain": [i / 100 for i in range(100)]}
    >>> outcomes = ["CONVERGED"] * 55 + ["DIVERGED"] * 45
    >>> figure = study_sensitivity(pd.DataFrame({**rows, "outcome": outcomes, "began": True}))
    >>> [text.get_text() for text in figure.axes[0].get_yticklabels()]
    ['task.gain']
    """
    result = (
        study
        if isinstance(study, Sensitivity)
        else compute_sensitivity(study, of, names, among=among, level=level)
    )
    with figure_style():
        height = max(1.2 + 0.42 * len(result.effects), 2.0)
        figure, (panel,) = prepare_panels(axes, 1, size, (7.6, height))
        for i, effect in enumerate(result.effects):
            _draw_effect_bar(panel, i, effect)
        labels = [effect.name for effect in result.effects]
        panel.set_yticks(range(len(labels)), labels=labels)
        panel.set(xlim=(0, 1), ylim=(len(labels) - 0.4, -0.6))
        panel.set_xlabel("correlation ratio η: from no (0) to complete (1) dependence")
        replace_frame_by_grid(panel, "x")
        panel.set_axisbelow(True)
        panel.tick_params(axis="y", length=0)
        subject = "convergence" if result.of == "converged" else result.of
        counted = f"{format_thousands(result.runs)} runs that {result.among}"
        set_axes_title(panel, f"sensitivity of {subject}: {counted}", title)
    return figure


def _draw_effect_bar(axes: Axes, i: int, effect: Effect) -> None:
    """Draw the bar of one column with its whisker, and its direction as text beside it."""
    words, color = _describe_direction(effect)
    eta = effect.eta
    axes.barh(i, eta.value, height=0.55, color=color)
    ends = [[eta.value - eta.low], [eta.high - eta.value]]
    axes.errorbar([eta.value], [i], xerr=ends, fmt="none", ecolor=palette.BLACK, capsize=3, lw=1.1)
    inside = eta.high > 0.7  # beside a longer bar is no space for the text
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
