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
    """The runs and measures of several schemes; printed as a table.

    `runs` and `scenes` are by the name of the scheme. `data` has a variable for each measure (see
    `robsim.analysis.measures`), with dims (scheme,) or of batches (scheme, run), NaN where a
    measure is undefined; the outcome; and `began`, false where the start itself was out of sight
    or beyond the limits of the joints, so that there is nothing to measure. `notes` say what
    besides the task differs.
    """

    runs: Mapping[str, xr.Dataset]
    data: xr.Dataset
    scenes: Mapping[str, Scene]
    notes: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the schemes, in the order given."""
        return tuple(self.runs)

    @property
    def batch(self) -> bool:
        """Whether every scheme ran from several starts."""
        return "run" in self.data.dims

    def converged(self) -> xr.DataArray:
        """Return the share of the runs of each scheme that converged, 0 to 1, of those that began.

        A start that cannot begin is no failure of a scheme; NaN if none of them began.
        """
        arrived = (self.data["outcome"] == Outcome.CONVERGED).astype(float)
        return arrived.where(self.data["began"]).mean("run") if self.batch else arrived

    def began(self) -> xr.DataArray:
        """Return how many runs of each scheme could begin."""
        return self.data["began"].sum("run") if self.batch else self.data["began"].astype(int)

    def quantile(self, share: float = 0.5) -> xr.Dataset:
        """Return, for each scheme of a batch, a quantile of each measure over converged runs.

        0.5 is the median. Of single runs: their measures. InputError: a share beyond 0 and 1.
        """
        share = as_nonnegative(share, "share of a quantile")
        if share > 1:
            raise InputError(f"share of a quantile: expected 0 to 1, got {share:g}")
        if not self.batch:
            return self.data[list(MEASURES)]
        arrived = self.data["outcome"] == Outcome.CONVERGED
        found = self.data[list(MEASURES)].where(arrived)
        with warnings.catch_warnings(action="ignore", category=RuntimeWarning):  # of none
            finite = found.where(np.isfinite)
            return finite.quantile(share, "run", keep_attrs=True).drop_vars("quantile")

    def csv(self) -> str:
        """Return the table as comma-separated values, with all measures, in full precision."""
        units = [f"{name} ({each.unit})" for name, each in MEASURES.items()]
        numbers = self.quantile()
        rows = [
            [name, *self._endings(i), *(float(numbers[key][i]) for key in MEASURES)]
            for i, name in enumerate(self.names)
        ]
        return format_csv([["scheme", *self._heads("converged (1)", "began (1)"), *units], *rows])

    def __str__(self) -> str:
        """Return the table; measures that are undefined for every scheme are left out."""
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
        shown = {key: each for key, each in MEASURES.items() if each.short}
        shown = {key: each for key, each in shown.items() if np.isfinite(numbers[key]).any()}
        columns = [["scheme", "", *self.names]]
        endings = [self._endings(i) for i in range(len(self.names))]
        heads = self._heads("converged", "of")
        columns += [[head, "", *column] for head, *column in zip(heads, *endings, strict=True)]
        for key, each in shown.items():
            unit = "" if each.unit == "1" else each.unit
            columns.append([each.short, unit, *map(format_digits, numbers[key].values)])
        return columns

    def __repr__(self) -> str:
        """Return the table, also where a notebook shows it as text."""
        return str(self)

    def _heads(self, *of_batch: str) -> tuple[str, ...]:
        return of_batch if self.batch else ("outcome",)

    def _endings(self, i: int) -> tuple[str, ...]:
        """Return the outcome of a scheme, in the columns that `_heads` names."""
        if not self.batch:
            return (Outcome(int(self.data["outcome"][i])).words,)
        share = float(self.converged()[i])
        return "-" if np.isnan(share) else f"{share:.4g}", str(int(self.began()[i]))

    def _denominators(self) -> list[str]:
        """Return notes on the runs that the numbers of a batch count."""
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
        """Return how many starts of a scheme could not begin, and why; empty if all could."""
        began, endings = self.data["began"].values[i], self.data["outcome"].values[i]
        counts = [(outcome, int((endings[~began] == outcome).sum())) for outcome in Outcome]
        why = ", ".join(f"{count} {outcome.words}" for outcome, count in counts if count)
        some = f"{(~began).sum()} of {began.size} starts"
        return f"{some} could not begin, and count nothing: {why}" if why else ""
