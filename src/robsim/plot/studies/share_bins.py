"""Square bins of many runs, coloured by the share of runs that converged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.plot import palette
from robsim.plot.studies.column_axis import Rows
from robsim.plot.studies.run_dots import DotPositions

DENSE = 2000  # runs of a panel; more dots would cover each other
FEWEST = 5  # runs of a bin with a colour; the runs of other bins are dots
IN_A_BIN, MOST_BINS = 25, 48  # mean number of runs in a bin, largest number of bins along an axis
SHARES = LinearSegmentedColormap.from_list(
    "share", [palette.ORANGE, palette.tint_color(palette.ORANGE, 0.75), palette.BLUE]
)


@dataclass(frozen=True)
class ShareBins:
    """Bins of runs over two columns.

    Attributes
    ----------
    edges : tuple of two arrays
        Edges of the bins along x, shape (nx + 1,), and along y, shape (ny + 1,).
    counts, shares : array of shape (nx, ny)
        Number of runs of each bin, and the share of them that converged; NaN with few runs.
    sparse : array of bool of shape (rows,)
        Rows of the table in bins with few runs.
    """

    edges: tuple[Array, Array]
    counts: Array
    shares: Array
    sparse: Rows

    @classmethod
    def of(cls, at: DotPositions, rows: Rows, converged: Rows) -> ShareBins:
        """Return the bins of the chosen rows, of which some converged."""
        number = int(np.clip(np.sqrt(rows.sum() / IN_A_BIN), 1, MOST_BINS))
        edges = tuple(np.histogram_bin_edges(each[rows], number) for each in at)
        counts = np.histogram2d(at[0][rows], at[1][rows], edges)[0]
        hits = np.histogram2d(at[0][rows & converged], at[1][rows & converged], edges)[0]
        shares = np.where(counts >= FEWEST, hits / np.maximum(counts, 1), np.nan)
        sparse = np.zeros(len(rows), dtype=bool)
        sparse[rows] = counts[_find_bins(at, rows, edges)] < FEWEST
        return cls((edges[0], edges[1]), counts, shares, sparse)

    def draw(self, axes: Axes) -> None:
        """Draw the bins with enough runs."""
        look: dict[str, Any] = {"cmap": SHARES, "vmin": 0.0, "vmax": 1.0}
        look |= {"rasterized": True, "zorder": 0.5}
        axes.pcolormesh(*self.edges, np.ma.masked_invalid(self.shares.T), **look)

    @staticmethod
    def describe(panels: Sequence[ShareBins]) -> str:
        """Return the label of the scale of colours, with the numbers of runs of the squares."""
        colored = [each.counts[np.isfinite(each.shares)].astype(int) for each in panels]
        counts = np.concatenate(colored)
        text = f" ({counts.min()} to {counts.max()} runs a square)" if counts.size else ""
        return f"share converged{text}"


def _find_bins(
    at: DotPositions, rows: Rows, edges: tuple[Array, ...]
) -> tuple[NDArray[np.intp], ...]:
    """Return the index of the bin of each chosen row along both axes."""
    return tuple(
        np.clip(np.searchsorted(edge, each[rows], side="right") - 1, 0, len(edge) - 2)
        for each, edge in zip(at, edges, strict=True)
    )
