"""Films: a scene as a page shows it, to which instants are added as they come."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.page.camera_views import collect_mark_pixels, list_camera_entries, list_mark_entries
from robsim.page.curves_and_texts import CurvePanel, build_curve_panels
from robsim.page.outlines_and_trails import list_outline_entries, list_trail_entries
from robsim.page.recording_frames import Entry, RecordingFrames, build_solid_entries
from robsim.plot import run_data
from robsim.plot.scene_motion import SceneMotion, choose_frustum_depth
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
class RecordingInstants:
    """What a page shows of T instants: times (T,), motion, curves, and pixels by array name."""

    time: Array
    moving: SceneMotion
    curves: list[CurvePanel] = field(default_factory=list)
    images: dict[str, Array] = field(default_factory=dict)

    @classmethod
    def of(
        cls, run: xr.Dataset, scene: Scene, second: tuple[xr.Dataset, Scene] | None = None
    ) -> RecordingInstants:
        """Return the instants of a run, beside those of a second one of as many.

        InputError: a run of another scene.
        """
        run_data.read_configurations(run, scene)
        other, beside, pixels = None, None, collect_mark_pixels(run)
        if second is not None:
            other, other_scene = second
            beside = SceneMotion.of(other_scene, other["q"].values)
            pixels |= collect_mark_pixels(other, " second")
        moving = SceneMotion.of(scene, run["q"].values, beside)
        return cls(run["time"].values, moving, build_curve_panels(run, scene, other), pixels)


class RecordingBuilder:
    """The things of a scene as entries of a header, and how each of them moves.

    What moves is found from `moving`, and `depth` metres is the size of cameras; `run` tells what
    its cameras see, and where its goal is.
    """

    def __init__(
        self,
        moving: SceneMotion,
        run: xr.Dataset | None = None,
        belief: Scene | None = None,
        depth: float | None = None,
    ) -> None:
        stage = self.stage = RecordingFrames(moving)
        depth = self.depth = choose_frustum_depth(moving) if depth is None else depth
        first = {} if run is None else run_data.number_first_marks(run)
        self.entries: dict[str, list[Entry]] = {
            "parts": build_solid_entries(stage, moving.scene, depth, "true"),
            "marks": list_mark_entries(stage, first),
            "cameras": list_camera_entries(stage, depth, run),
            "trails": list_trail_entries(stage),
        }
        if run is not None:
            self.entries["parts"] += list_outline_entries(stage, belief, run, depth)

    def recording(self, title: str, shown: RecordingInstants, **told: Any) -> Recording:
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

    def like(self, other: RecordingBuilder) -> bool:
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

    def arrays(self, shown: RecordingInstants) -> dict[str, NDArray[Any]]:
        """Return the arrays that have a row for each instant, and those of goals in images."""
        return {
            "time": shown.time,
            "poses": self.stage.poses(shown.moving),
            **{each.array: each.values for each in shown.curves},
            **shown.images,
        }


def find_task_belief(experiment: Experiment) -> Scene | None:
    """Return what the task believes of the scene, where that is something else."""
    belief: Scene | None = getattr(experiment.task, "belief", None)
    return None if belief in (None, experiment.scene) else belief
