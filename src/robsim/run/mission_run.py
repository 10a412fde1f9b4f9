"""How a mission went: its legs, and all of them joined."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.engine.outcome import Outcome
from robsim.files.run_schema import MISSION
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class MissionLeg:
    """One phase of a mission as it went; seconds since the start of the mission.

    `run` is a run like any other: `replay` repeats it, `explain` says why it ended.
    """

    name: str
    outcome: Outcome
    succeeded: bool
    start: float
    end: float
    run: xr.Dataset
    scene: Scene

    @property
    def q_end(self) -> Array:
        """The coordinates (nq,) where it ended."""
        q: Array = np.array(self.run["q_end"].values)
        return q


@dataclass(frozen=True, eq=False)
class MissionRun:
    """How a mission went: the legs that were begun, the last one perhaps in vain.

    `attrs` say where it comes from, as those of a run do: `Experiment.of` reads them.
    """

    legs: tuple[MissionLeg, ...]
    planned: int  # phases
    problem: str = ""  # why the next phase could not begin, if it could not
    attrs: dict[str, Any] = field(default_factory=dict)

    @property
    def succeeded(self) -> bool:
        """Whether every phase ended as it should."""
        return len(self.legs) == self.planned and all(leg.succeeded for leg in self.legs)

    @property
    def run(self) -> xr.Dataset:
        """The record of the whole mission: q, qd and the phase at each time.

        Where one phase ends and the next begins there is one instant, that of the next.
        InputError: no leg has a record, only its end.
        """
        import xarray as xr

        if not self.legs or "time" not in self.legs[0].run.dims:
            raise InputError("nothing to join: this mission has no legs, or summaries of them only")
        parts = [_get_leg_instants(leg, last=leg is self.legs[-1]) for leg in self.legs]
        joined: xr.Dataset = xr.concat(parts, dim="time")
        own = {"title": MISSION, "succeeded": int(self.succeeded)}
        joined.attrs = {**self.attrs, **own}
        return joined

    def __repr__(self) -> str:
        return f"<MissionRun: {len(self.legs)} of {self.planned} phases>"

    def __str__(self) -> str:
        wide = max((len(leg.name) for leg in self.legs), default=0)
        lines = [f"{leg.start:8.2f} s  {leg.name:{wide}}  {leg.outcome.words}" for leg in self.legs]
        left = self.planned - len(self.legs)
        lines += [self.problem] if self.problem else []
        return "\n".join([*lines, *([f"phases not begun: {left}"] if left else [])])


def _get_leg_instants(leg: MissionLeg, *, last: bool) -> xr.Dataset:
    """Return q and qd of a leg on the clock of the mission; its end belongs to the next."""
    run = leg.run[["q", "qd"]].drop_vars("run", errors="ignore")
    before = run["time"].values < leg.end - leg.start - 1e-9 * float(leg.run.attrs["dt"])
    count = int(before.sum()) + (1 if last else 0)
    run = run.isel(time=slice(0, max(count, 1 if last else 0)))
    run = run.assign_coords(time=run["time"] + leg.start)
    return run.assign_coords(phase=("time", np.full(run.sizes["time"], leg.name)))
