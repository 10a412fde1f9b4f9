"""Figure of the constraints of a law that act, over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.plot import palette, run_data
from robsim.plot.canvas import AxesLike, figure_style, prepare_panels, set_time_axis
from robsim.run.constraint_states import ConstraintStates, Flags

if TYPE_CHECKING:
    import xarray as xr

MOST_ROWS = 10  # of a figure; further constraints are counted in one more row
ROW, FRAME = 0.2, 0.55  # height of a row and of axis and label, inches
BAR = 0.7  # height of a bar, as a share of a row
HOLDING: dict[str, Any] = {"facecolor": palette.ORANGE}
YIELDING: dict[str, Any] = {"facecolor": palette.VERMILLION, "hatch": "////", "edgecolor": "white"}
REST = "{} more"  # label of the row of further constraints


def constraints(
    run: xr.Dataset,
    *,
    axes: AxesLike | None = None,
    size: tuple[float, float] | None = None,
    title: str | None = None,
) -> Figure:
    """Draw which constraints of the law act over time (s).

    Each constraint that ever acts has a row, in the order in which they begin to act. A bar lasts
    while it holds the command back; it is dark while the constraint gives way, because no command
    satisfies all. Of more than ten constraints, those that act longest have rows of their own.

    Parameters
    ----------
    run : xarray.Dataset
        A single run of a law with constraints.
    axes : matplotlib.axes.Axes, optional
        Axes to draw into. Default: the axes of a new figure.
    size : (float, float), optional
        Width and height of a new figure in inches.
    title : str, optional
        Title of a new figure. Default: the outcome of the run.

    Returns
    -------
    matplotlib.figure.Figure
        The new figure, or the figure that contains `axes`.

    Raises
    ------
    InputError
        If `run` is not a single run, or its law has no constraints.

    Examples
    --------
    >>> import robsim as rs
    >>> law = rs.laws.ConstrainedLaw([rs.constraints.JointSpeeds(0.2)])
    >>> scenario = rs.load_scenario(rs.examples.path("visp_tutorial")).at("task.law", law)
    >>> rows = constraints(scenario.run()).axes[0].get_yticklabels()
    >>> rows[0].get_text(), len(rows)
    ('body.wz at its upper limit', 4)
    """
    one = run_data.extract_single_run(run)
    states = select_drawn_constraints(one)
    if states is None:
        raise InputError("constraints: the law of this run has no constraints")
    with figure_style():
        inches = 6.4, measure_rows_height(states) + 0.3
        figure, panels = prepare_panels(axes, 1, size, inches)
        draw_constraints(panels[0], one["time"].values, states)
        if axes is None:
            figure.suptitle(run_data.describe_ending(one) if title is None else title)
    return figure


def select_drawn_constraints(one: xr.Dataset) -> ConstraintStates | None:
    """Return the states of the constraints with rows of their own; None without constraints.

    The constraints are in the order in which they begin to act; the last row joins those that act
    for the shortest time if there are too many.
    """
    states = ConstraintStates.of(one)
    if states is None:
        return None
    acting = states.holding | states.yielding
    longest = np.argsort(-acting.sum(axis=0), kind="stable")
    ever = longest[acting[:, longest].any(axis=0)]
    own, rest = (ever, ever[:0]) if len(ever) <= MOST_ROWS else np.split(ever, [MOST_ROWS - 1])
    own = own[np.argsort(acting[:, own].argmax(axis=0), kind="stable")]
    names = [states.names[i] for i in own]

    def join(flags: Flags) -> Flags:
        parts = [flags[:, own], *([flags[:, rest].any(axis=1, keepdims=True)] if len(rest) else [])]
        return np.concatenate(parts, axis=1)

    labels = [*names, *([REST.format(len(rest))] if len(rest) else [])]
    return ConstraintStates(tuple(labels), join(states.holding), join(states.yielding))


def measure_rows_height(states: ConstraintStates) -> float:
    """Return the height of the axes of constraints with their labels, in inches."""
    return ROW * max(len(states.names), 1) + FRAME


def draw_constraints(axes: Axes, time: Array, states: ConstraintStates) -> None:
    """Draw a row for each constraint: when it holds the command back, and when it gives way."""
    rows = len(states.names)
    for i in range(rows):
        given = states.yielding[:, i]
        held = states.holding[:, i] & ~given
        for flags, look in ((held, HOLDING), (given, YIELDING)):
            axes.broken_barh(_find_spans(time, flags), (i - BAR / 2, BAR), linewidth=0, **look)
    if states.yielding.any():
        looks = {"holds the command back": HOLDING, "gives way": YIELDING}
        patches = [Patch(label=words, linewidth=0, **look) for words, look in looks.items()]
        axes.legend(
            handles=patches, loc="lower left", bbox_to_anchor=(0, 1), ncols=2, frameon=False
        )
    set_time_axis(axes, time)
    axes.set_yticks(range(rows), states.names)
    axes.set_ylim(max(rows, 1) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    axes.set_axisbelow(True)
    if not rows:
        axes.text(
            0.5, 0.5, "no constraint acts", transform=axes.transAxes, ha="center", va="center"
        )


def _find_spans(time: Array, flags: Flags) -> list[tuple[float, float]]:
    """Return start and duration of the spans of instants with a flag; each lasts for its period."""
    edges = np.diff(np.concatenate([[False], flags, [False]]).astype(int))
    ends = np.append(time, time[-1])  # the command of the last instant has no period
    pairs = zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True)
    return [(float(time[a]), float(ends[b] - time[a])) for a, b in pairs]
