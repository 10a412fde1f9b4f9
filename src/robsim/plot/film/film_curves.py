"""The curves of a film: pale over the whole time, in full colour up to the shown instant."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from robsim.base.arrays import Array
from robsim.plot import palette, run_data
from robsim.plot.film.film_source import FilmSource
from robsim.plot.joints_figure import draw_joints_by_unit, list_display_units
from robsim.plot.velocity_figure import draw_velocity

PALE = 0.25  # opacity of the future part of a curve
_NOW: dict[str, Any] = {"color": palette.BLACK, "linewidth": 1.0, "zorder": 4}


class FilmCurves:
    """Velocities and error of a run, or the coordinates of a mission, over time."""

    def __init__(self, source: FilmSource) -> None:
        self._source, self._time = source, source.time
        self._units = list_display_units(source.data) if len(source.shots) > 1 else []
        self.panels = len(self._units) or 3
        self._overlays: list[tuple[Line2D, Array]] = []
        self._time_lines: list[Line2D] = []

    def draw(self, panels: list[Axes]) -> list[Line2D]:
        """Draw all curves into axes, and return the animated artists."""
        shot = self._source.shots[0]
        if self._units:
            draw_joints_by_unit(panels, self._source.data)
        else:
            frame = run_data.find_moving_frame(shot.run, shot.scene)
            draw_velocity(panels, shot.run, shot.scene, frame)
        for axes in panels:
            self._time_lines.append(axes.axvline(self._time[0], **_NOW))
            for line in axes.get_lines():
                values = np.asarray(line.get_ydata())
                if len(values) == len(self._time) and line is not self._time_lines[-1]:
                    self._overlays.append((_add_growing_line(axes, line), values))
        return [*(line for line, _ in self._overlays), *self._time_lines]

    def place(self, instant: int) -> None:
        """Extend the coloured part of the curves to an instant."""
        for line, values in self._overlays:
            line.set_data(self._time[: instant + 1], values[: instant + 1])
        for line in self._time_lines:
            line.set_xdata([self._time[instant]] * 2)


def _add_growing_line(axes: Axes, line: Line2D) -> Line2D:
    """Make a line pale, and return an empty line of its former style over it."""
    overlay = Line2D([], [])
    overlay.update_from(line)
    axes.add_line(overlay)
    line.set_alpha(PALE)
    return overlay
