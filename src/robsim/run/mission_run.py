"""The result of a mission: its legs, and their joined record."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from robsim.base.arrays import Array
from robsim.base.errors import InputError
from robsim.engine.outcome import Outcome
from robsim.files.run_schema import MISSION
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

OF_LEGS = (
    "q",
    "qd",
    "torque",
    "saturation",
)  # variables of the record of a mission, if a leg has them


@dataclass(frozen=True, eq=False)
class MissionLeg:
    """One simulated phase of a mission.

    Attributes
    ----------
    name : str
        Name of the phase.
    outcome : Outcome
        Outcome of the run.
    succeeded : bool
        Whether the outcome is one of the expected outcomes of the phase.
    start, end : float
        Seconds since the start of the mission.
    run : xarray.Dataset
        Run of the phase, which `replay` repeats and `explain` explains.
    scene : Scene
        Scene during the phase.
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
        """The coordinates (nq,) at the end of the leg."""
        q: Array = np.array(self.run["q_end"].values)
        return q


@dataclass(frozen=True, eq=False)
class MissionRun:
    """Result of a mission: a leg for each phase that began.

    The last leg may have failed. `Experiment.of` reads the experiment from `attrs`.

    Attributes
    ----------
    legs : tuple of MissionLeg
        Simulated phases in their order.
    planned : int
        Number of phases of the mission.
    problem : str
        Reason why the next phase could not begin; empty if every phase began or the last leg
        failed.
    attrs : dict
        Stored experiment, as in a run.

    Examples
    --------
    >>> from robsim import Experiment, FollowJoints, Mission, Phase, Scene, robots
    >>> there = Phase("there", FollowJoints(to=[0.5, 0.5], duration=1.0))
    >>> mission = Experiment(Scene(robots.planar_2r()), Mission([there])).run()
    >>> mission.succeeded, mission.legs[0].outcome.name
    (True, 'CONVERGED')
    """

    legs: tuple[MissionLeg, ...]
    planned: int
    problem: str = ""
    attrs: dict[str, str] = field(default_factory=dict)

    @property
    def succeeded(self) -> bool:
        """Whether all phases ended with an expected outcome."""
        return len(self.legs) == self.planned and all(leg.succeeded for leg in self.legs)

    @property
    def run(self) -> xr.Dataset:
        """The record of the whole mission: q, qd, torques of drives and the phase at each time.

        The last instant of a phase and the first of the next are stored once, as the latter. If
        every n-th step is recorded, the end of the mission may not be among the instants.

        Raises
        ------
        InputError
            If no leg has a record over time.
        """
        import xarray as xr

        if not self.legs or "time" not in self.legs[0].run.dims:
            raise InputError("nothing to join: this mission has no legs, or summaries of them only")
        parts = [_get_leg_instants(leg, last=leg is self.legs[-1]) for leg in self.legs]
        dataset: xr.Dataset = xr.concat(parts, dim="time")
        limits = [leg.run["torque_limit"] for leg in self.legs if "torque_limit" in leg.run]
        if limits:  # NaN for joints that no phase drives
            dataset["torque_limit"] = limits[0].copy(data=np.fmax.reduce(limits))
        own = {"title": MISSION, "succeeded": int(self.succeeded)}
        dataset.attrs = {**self.attrs, **own}
        return dataset

    def __repr__(self) -> str:
        return f"<MissionRun: {len(self.legs)} of {self.planned} phases>"

    def __str__(self) -> str:
        rows = [
            (f"{leg.start:8.2f} to {leg.end:.2f} s", leg.name, leg.outcome.words)
            for leg in self.legs
        ]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]
        left = self.planned - len(self.legs)
        lines += [self.problem] if self.problem else []
        return "\n".join([*lines, *([f"phases not begun: {left}"] if left else [])])


def _get_leg_instants(leg: MissionLeg, *, last: bool) -> xr.Dataset:
    """Return q, qd and the torques of a leg in mission time.

    The last instant is included only for the last leg, if it is recorded.
    """
    import xarray as xr

    variables = {name: leg.run[name] for name in OF_LEGS if name in leg.run}
    run = xr.Dataset(variables).drop_vars("run", errors="ignore")
    rounding = 4 * np.spacing(leg.end)
    kept = run["time"].values < leg.end - leg.start + (rounding if last else -rounding)
    run = run.isel(time=slice(0, int(kept.sum())))
    run = run.assign_coords(time=run["time"] + leg.start)
    return run.assign_coords(phase=("time", np.full(run.sizes["time"], leg.name)))
