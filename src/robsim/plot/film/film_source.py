"""What is filmed: the instants of a run, or of all phases of a mission."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from robsim.base.arrays import Array
from robsim.base.errors import InputError, format_value
from robsim.plot import run_data
from robsim.plot.scene_motion import SceneMotion
from robsim.run.experiment import Experiment
from robsim.run.mission_run import MissionRun
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True)
class FilmShot:
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
class FilmSource:
    """Instants (T,) in seconds, where everything is then, and how it ended."""

    title: str
    time: Array
    moving: SceneMotion
    shots: tuple[FilmShot, ...]
    ending: str
    joined: xr.Dataset  # with the coordinates at all instants


def build_film_source(run: Any, experiment: Experiment | None = None) -> FilmSource:
    """Return what a film of a run or a mission shows.

    InputError: anything else, several runs, or a run of Python code without its experiment.
    """
    if experiment is not None and not isinstance(experiment, Experiment):
        raise InputError(f"experiment: expected an Experiment, got {format_value(experiment)}")
    if isinstance(run, MissionRun):
        return _build_mission_source(run, experiment)
    one = run_data.extract_single_run(run)
    made = Experiment.of(run) if experiment is None else experiment
    run_data.read_configurations(one, made.scene)  # a run of another scene is refused
    moving = SceneMotion.of(made.scene, one["q"].values)
    shots = (FilmShot(one, made.scene),)
    return FilmSource(
        made.title or "", one["time"].values, moving, shots, run_data.describe_ending(one), one
    )


def _build_mission_source(mission: MissionRun, experiment: Experiment | None) -> FilmSource:
    joined, moving, first, shots = mission.run, SceneMotion.of_mission(mission), 0, []
    for leg, (scene, q) in zip(mission.legs, moving.spells, strict=True):
        if len(q):
            one = run_data.extract_single_run(leg.run).isel(time=slice(0, len(q)))
            shots.append(FilmShot(one, scene, first, leg.name))
        first += len(q)
    told = experiment is None and mission.attrs.get("scenario")
    made = Experiment.of(mission) if told else experiment
    ending = "all phases as expected" if mission.succeeded else "not completed"
    title = "" if made is None else made.title or ""
    return FilmSource(title, joined["time"].values, moving, tuple(shots), ending, joined)
