"""Which constraints of a law act at each instant of a run."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robsim.servo.constraints.row_names import name_first_row

if TYPE_CHECKING:
    import xarray as xr

Flags = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class ConstraintStates:
    """Constraints that hold back or yield to the command at T instants.

    Rows of one name, such as the rows of a constraint for several depths of a mark, are one
    constraint.

    Attributes
    ----------
    names : tuple of str
        Names of the c constraints.
    holding : ndarray of bool, shape (T, c)
        Whether a constraint holds the command back.
    yielding : ndarray of bool, shape (T, c)
        Whether a constraint gave way, because no command satisfies all.
    owners : tuple of tuple of str
        Dotted names of the values to which each constraint belongs; empty if they are unknown.
    """

    names: tuple[str, ...]
    holding: Flags
    yielding: Flags
    owners: tuple[tuple[str, ...], ...] = ()

    @classmethod
    def of(
        cls,
        run: Mapping[Hashable, xr.DataArray | xr.Variable],
        owners: Sequence[Sequence[str]] = (),
    ) -> ConstraintStates | None:
        """Return the states of a single run; None for a law without constraints.

        `owners` are the dotted names of the values of each row.
        """
        if "active" not in run:
            return None
        labels = [str(label) for label in run["constraint"].values]
        first = [name_first_row(label, labels) for label in labels]
        names = list(dict.fromkeys(first))
        rows = [np.array([each == name for each in first]) for name in names]
        flags = run["active"].values > 0, run["slack"].values > 0
        holding, yielding = (
            np.stack([np.any(part[:, own], axis=1) for own in rows], axis=1) for part in flags
        )
        return cls(
            tuple(names),
            holding,
            yielding,
            tuple(tuple(owners[first.index(name)]) for name in names) if owners else (),
        )

    def select_acting(self) -> ConstraintStates:
        """Return the states of the constraints that ever hold back or yield to the command."""
        acts: Flags = np.any(self.holding | self.yielding, axis=0)
        return replace(
            self,
            names=tuple(name for name, one in zip(self.names, acts, strict=True) if one),
            holding=self.holding[:, acts],
            yielding=self.yielding[:, acts],
        )
