"""The content of a film: the instants of a run or of all phases of a mission."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

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
    """A part of a film: one run and its scene.

    Attributes
    ----------
    run : xarray.Dataset
        The run.
    scene : Scene
        Its scene.
    first : int
        First instant of the run, counted from the start of the film.
    name : str
        Name of the phase of a mission.
    """

    run: xr.Dataset
    scene: Scene
    first: int = 0
    name: str = ""

    @property
    def instants(self) -> range:
        """The instants of the film that show this run."""
        return range(self.first, self.first + self.run.sizes["time"])


@dataclass(frozen=True)
class FilmSource:
    """The instants of a film, the motion of its scene, and its ending.

    Attributes
    ----------
    title : str
        Title of the experiment.
    time : array of shape (T,)
        Times in seconds.
    motion : SceneMotion
        Motion of all frames.
    shots : tuple of FilmShot
        The runs, in order of time.
    ending : str
        How the run or the mission ended.
    data : xarray.Dataset
        The run, or the motion of the whole mission, with the coordinates at all instants.
    """

    title: str
    time: Array
    motion: SceneMotion
    shots: tuple[FilmShot, ...]
    ending: str
    data: xr.Dataset


def build_film_source(
    run: xr.Dataset | MissionRun, experiment: Experiment | None = None
) -> FilmSource:
    """Return the content of a film of a run or a mission.

    Raise InputError if `run` has another type or holds several runs, or if `experiment` is missing
    and the run does not store it.
    """
    if experiment is not None and not isinstance(experiment, Experiment):
        raise InputError(f"experiment: expected an Experiment, got {format_value(experiment)}")
    if isinstance(run, MissionRun):
        return _build_mission_source(run, experiment)
    one = run_data.extract_single_run(run)
    source = Experiment.of(run) if experiment is None else experiment
    run_data.read_configurations(one, source.scene)  # raises InputError for another scene
    motion = SceneMotion.of(source.scene, one["q"].values)
    shots = (FilmShot(one, source.scene),)
    return FilmSource(
        source.title or "", one["time"].values, motion, shots, run_data.describe_ending(one), one
    )


def _build_mission_source(mission: MissionRun, experiment: Experiment | None) -> FilmSource:
    """Return the content of a film of a mission."""
    run = mission.run
    motion, first, shots = SceneMotion.of_mission(mission, run), 0, []
    for leg, (scene, q) in zip(mission.legs, motion.phases, strict=True):
        if len(q):
            one = run_data.extract_single_run(leg.run).isel(time=slice(0, len(q)))
            shots.append(FilmShot(one, scene, first, leg.name))
        first += len(q)
    stored = experiment is None and mission.attrs.get("scenario")
    source = Experiment.of(mission) if stored else experiment
    ending = "all phases as expected" if mission.succeeded else "not completed"
    title = "" if source is None else source.title or ""
    return FilmSource(title, run["time"].values, motion, tuple(shots), ending, run)
