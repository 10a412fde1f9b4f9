"""What is filmed: the instants of a run, or of all phases of a mission."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from robsim.base.arrays import Array
from robsim.base.errors import InputError, said
from robsim.plot import history
from robsim.plot.moving import Moving
from robsim.run.experiment import Experiment
from robsim.run.mission_run import MissionRun
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class Shot:
    """A run in its scene, from the instant `first` of the footage on; `name` is of its phase."""

    run: xr.Dataset
    scene: Scene
    first: int = 0
    name: str = ""

    @property
    def instants(self) -> range:
        """The instants of the footage that are its own."""
        return range(self.first, self.first + self.run.sizes["time"])


@dataclass(frozen=True)
class Footage:
    """Instants (T,) in seconds, where everything is then, and how it ended."""

    title: str
    time: Array
    moving: Moving
    shots: tuple[Shot, ...]
    ending: str
    joined: xr.Dataset  # with the coordinates at all instants


def footage_of(run: Any, experiment: Experiment | None = None) -> Footage:
    """Return what a film of a run or a mission shows.

    InputError: anything else, several runs, or a run of Python code without its experiment.
    """
    if experiment is not None and not isinstance(experiment, Experiment):
        raise InputError(f"experiment: expected an Experiment, got {said(experiment)}")
    if isinstance(run, MissionRun):
        return _of_mission(run, experiment)
    one = history.single(run)
    made = Experiment.of(run) if experiment is None else experiment
    history.configurations(one, made.scene)  # a run of another scene is refused
    moving = Moving.of(made.scene, one["q"].values)
    shots = (Shot(one, made.scene),)
    return Footage(made.title or "", one["time"].values, moving, shots, history.ending(one), one)


def _of_mission(mission: MissionRun, experiment: Experiment | None) -> Footage:
    joined, moving, first, shots = mission.run, Moving.of_mission(mission), 0, []
    for leg, (scene, q) in zip(mission.legs, moving.spells, strict=True):
        if len(q):
            one = history.single(leg.run).isel(time=slice(0, len(q)))
            shots.append(Shot(one, scene, first, leg.name))
        first += len(q)
    told = experiment is None and mission.attrs.get("scenario")
    made = Experiment.of(mission) if told else experiment
    ending = "all phases as expected" if mission.succeeded else "not completed"
    title = "" if made is None else made.title or ""
    return Footage(title, joined["time"].values, moving, tuple(shots), ending, joined)
