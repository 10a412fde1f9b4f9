"""`Comparison`: the runs and measures of several schemes, as data and as a table."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr

from robsim.analysis.measures import MEASURES
from robsim.base.arrays import as_nonnegative
from robsim.base.errors import InputError
from robsim.base.html import format_html_table
from robsim.base.text_tables import align_columns, format_csv, format_digits
from robsim.engine.outcome import Outcome
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False)
class Comparison:
    """Runs and measures of several schemes, as `compare` returns them; printed as a table.

    Attributes
    ----------
    runs : mapping of str to Dataset
        Run of each scheme.
    data : Dataset
        One variable for each measure (see `robsim.analysis.measures`), with dimensions (scheme,) or
        (scheme, run), NaN if a measure is undefined; the outcome; and `began`, false if the camera
        does not see the target at the start, or a joint is beyond its limits.
    scenes : mapping of str to Scene
        Scene of each scheme.
    notes : tuple of str
        Differences between the schemes other than the task.

    Examples
    --------
    >>> from robsim import IBVS, compare, examples, load_scenario
    >>> one = load_scenario(examples.path("camera_retreat")).with_(dt=0.02, duration=15)
    >>> comparison = compare({"image": one.with_(task=IBVS(one.task.goal))})
    >>> comparison.names, round(float(comparison.data.retreat[0]), 2)
    (('image',), 1.03)
    """

    runs: Mapping[str, xr.Dataset]
    data: xr.Dataset
    scenes: Mapping[str, Scene]
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the schemes, in the given order."""
        return tuple(self.runs)

    @property
    def batch(self) -> bool:
        """Whether the schemes have several starts."""
        return "run" in self.data.dims

    def converged(self) -> xr.DataArray:
        """Return the share of converged runs among the runs that began, for each scheme.

        Starts that cannot begin do not count as failures. The share is between 0 and 1, and NaN if
        no run of a scheme began.
        """
        has_converged = (self.data["outcome"] == Outcome.CONVERGED).astype(float)
        return has_converged.where(self.data["began"]).mean("run") if self.batch else has_converged

    def began(self) -> xr.DataArray:
        """Return the number of runs that began, for each scheme."""
        return self.data["began"].sum("run") if self.batch else self.data["began"].astype(int)

    def quantile(self, share: float = 0.5) -> xr.Dataset:
        """Return a quantile of each measure over the converged runs of each scheme.

        Parameters
        ----------
        share : float, default 0.5
            Probability of the quantile, 0 to 1; 0.5 is the median.

        Returns
        -------
        Dataset
            One variable for each measure; the measures themselves for single runs.

        Raises
        ------
        InputError
            If `share` is outside of 0 to 1.
        """
        share = as_nonnegative(share, "share of a quantile")
        if share > 1:
            raise InputError(f"share of a quantile: expected 0 to 1, got {share:g}")
        if not self.batch:
            return self.data[list(MEASURES)]
        has_converged = self.data["outcome"] == Outcome.CONVERGED
        measures = self.data[list(MEASURES)].where(has_converged)
        with warnings.catch_warnings(action="ignore", category=RuntimeWarning):  # no run
            finite = measures.where(np.isfinite)
            return finite.quantile(share, "run", keep_attrs=True).drop_vars("quantile")

    def csv(self) -> str:
        """Return all measures as comma-separated values in full precision."""
        units = [f"{name} ({each.unit})" for name, each in MEASURES.items()]
        numbers = self.quantile()
        rows = [
            [name, *self._endings(i), *(float(numbers[key][i]) for key in MEASURES)]
            for i, name in enumerate(self.names)
        ]
        return format_csv([["scheme", *self._heads("converged (1)", "began (1)"), *units], *rows])

    def __str__(self) -> str:
        """Return the table, without measures that are undefined for every scheme."""
        return "\n".join([*align_columns(self._columns()), *self._denominators(), *self.notes])

    def _repr_html_(self) -> str:
        """Return the table for notebooks."""
        first, *rows = zip(*self._columns(), strict=True)
        units, *rows = rows
        head = [
            f"{name} ({unit})" if unit else name for name, unit in zip(first, units, strict=True)
        ]
        return format_html_table(
            "Comparison", rows, head, "\n".join([*self._denominators(), *self.notes])
        )

    def _columns(self) -> list[list[str]]:
        """Return columns of text: the name, the unit, and the value of each scheme."""
        numbers = self.quantile()
        measures = {key: each for key, each in MEASURES.items() if each.short}
        measures = {key: each for key, each in measures.items() if np.isfinite(numbers[key]).any()}
        columns = [["scheme", "", *self.names]]
        endings = [self._endings(i) for i in range(len(self.names))]
        heads = self._heads("converged", "of")
        columns += [[head, "", *column] for head, *column in zip(heads, *endings, strict=True)]
        for key, each in measures.items():
            unit = "" if each.unit == "1" else each.unit
            columns.append([each.short, unit, *map(format_digits, numbers[key].values)])
        return columns

    def __repr__(self) -> str:
        """Return the table; notebooks show it as text."""
        return str(self)

    def _heads(self, *of_batch: str) -> tuple[str, ...]:
        """Return the given heads for a batch, or the head "outcome" for single runs."""
        return of_batch if self.batch else ("outcome",)

    def _endings(self, i: int) -> tuple[str, ...]:
        """Return the outcome of a scheme, in the columns of `_heads`."""
        if not self.batch:
            return (Outcome(int(self.data["outcome"][i])).words,)
        share = float(self.converged()[i])
        return "-" if np.isnan(share) else f"{share:.4g}", str(int(self.began()[i]))

    def _denominators(self) -> list[str]:
        """Return notes on the number of runs behind the numbers of a batch."""
        if not self.batch:
            return []
        count = self.data.sizes["run"]
        share = "converged: share of the starts that began"
        lines = [f"{share}; the rest: medians of the runs that converged, of {count}"]
        why = [self._not_begun(i) for i in range(len(self.names))]
        if len(set(why)) == 1:
            return lines + [f"note: {why[0]}"] * bool(why[0])
        return lines + [
            f"note: under {name} {text}" for name, text in zip(self.names, why, strict=True) if text
        ]

    def _not_begun(self, i: int) -> str:
        """Return a note on the starts of a scheme that could not begin; empty if all could."""
        began, endings = self.data["began"].values[i], self.data["outcome"].values[i]
        counts = [(outcome, int((endings[~began] == outcome).sum())) for outcome in Outcome]
        why = ", ".join(f"{count} {outcome.words}" for outcome, count in counts if count)
        some = f"{(~began).sum()} of {began.size} starts"
        return f"{some} could not begin and are not counted: {why}" if why else ""
