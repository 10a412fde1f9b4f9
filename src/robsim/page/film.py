"""Films: a scene as a page shows it, to which instants are added as they come."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.page.bodies import Entry, Stage, solids
from robsim.page.seen import cameras, images, marks_of
from robsim.page.told import Curves, curves
from robsim.page.ways import ghosts, trails
from robsim.plot import history
from robsim.plot.moving import Moving, frustum_depth
from robsim.run.experiment import Experiment
from robsim.world.scene import Scene

if TYPE_CHECKING:
    import xarray as xr

FORMAT, VERSION = "robsim recording", 2


@dataclass(frozen=True, eq=False)
class Recording:
    """A header and arrays by name, as `recording` describes them."""

    header: dict[str, Any]
    arrays: dict[str, NDArray[Any]]

    def __repr__(self) -> str:
        """Return what it shows, in a line."""
        return f"<Recording {self.header['title']!r} of {len(self.arrays['time'])} instants>"


@dataclass(frozen=True, eq=False)
class Instants:
    """What a page shows of T instants: times (T,), motion, curves, and pixels by array name."""

    time: Array
    moving: Moving
    curves: list[Curves] = field(default_factory=list)
    images: dict[str, Array] = field(default_factory=dict)

    @classmethod
    def of(
        cls, run: xr.Dataset, scene: Scene, second: tuple[xr.Dataset, Scene] | None = None
    ) -> Instants:
        """Return the instants of a run, beside those of a second one of as many.

        InputError: a run of another scene.
        """
        history.configurations(run, scene)
        other, beside, pixels = None, None, images(run)
        if second is not None:
            other, other_scene = second
            beside = Moving.of(other_scene, other["q"].values)
            pixels |= images(other, " second")
        moving = Moving.of(scene, run["q"].values, beside)
        return cls(run["time"].values, moving, curves(run, scene, other), pixels)


class Film:
    """The things of a scene as entries of a header, and how each of them moves.

    What moves is found from `moving`, and `depth` metres is the size of cameras; `run` tells what
    its cameras see, and where its goal is.
    """

    def __init__(
        self,
        moving: Moving,
        run: xr.Dataset | None = None,
        belief: Scene | None = None,
        depth: float | None = None,
    ) -> None:
        stage = self.stage = Stage(moving)
        depth = self.depth = frustum_depth(moving) if depth is None else depth
        first = {} if run is None else history.first_numbers(run)
        self.entries: dict[str, list[Entry]] = {
            "parts": solids(stage, moving.scene, depth, "true"),
            "marks": marks_of(stage, first),
            "cameras": cameras(stage, depth, run),
            "trails": trails(stage),
        }
        if run is not None:
            self.entries["parts"] += ghosts(stage, belief, run, depth)

    def recording(self, title: str, shown: Instants, **told: Any) -> Recording:
        """Return the recording of some instants, with what there is to tell."""
        header = {
            "format": FORMAT,
            "version": VERSION,
            "title": title,
            **{"outcome": "", "texts": {}, "events": [], **told},
            "curves": [each.entry for each in shown.curves],
            "reach": self.reach,
            "frames": self.stage.listed,
            **self.entries,
        }
        return Recording(header, {**self.stage.arrays, **self.arrays(shown)})

    def like(self, other: Film) -> bool:
        """Return whether the same things are shown, wherever they are."""
        mine, others = self.stage.arrays, other.stage.arrays
        return (
            self.entries == other.entries
            and self.stage.listed == other.stage.listed
            and all(np.array_equal(mine[name], others[name]) for name in mine)
        )

    @property
    def reach(self) -> list[list[float]]:
        """The lowest and highest coordinates of the origins of all frames, in metres."""
        at = self.stage.poses(self.stage.moving)[..., :3].reshape(-1, 3)
        ends = (at.min(axis=0), at.max(axis=0)) if len(at) else (np.zeros(3), np.zeros(3))
        return [[float(np.float32(x)) for x in end] for end in ends]

    def arrays(self, shown: Instants) -> dict[str, NDArray[Any]]:
        """Return the arrays that have a row for each instant, and those of goals in images."""
        return {
            "time": shown.time,
            "poses": self.stage.poses(shown.moving),
            **{each.array: each.values for each in shown.curves},
            **shown.images,
        }


def belief_of(experiment: Experiment) -> Scene | None:
    """Return what the task believes of the scene, where that is something else."""
    belief: Scene | None = getattr(experiment.task, "belief", None)
    return None if belief in (None, experiment.scene) else belief
