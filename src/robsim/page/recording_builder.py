"""Builder of recordings, which can be extended by instants while a run goes on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.page.body_shapes import BodyShapes
from robsim.page.camera_views import collect_mark_pixels, list_camera_entries, list_mark_entries
from robsim.page.constraint_entries import (
    build_constraint_entries,
    list_view_margins,
    pack_constraint_states,
)
from robsim.page.curves_and_texts import CurvePanel, build_curve_panels
from robsim.page.outlines_and_trails import list_outline_entries, list_trail_entries
from robsim.page.recording_frames import Entry, RecordingFrames, build_solid_entries
from robsim.plot import run_data
from robsim.plot.scene_motion import SceneMotion, choose_frustum_depth
from robsim.run.constraint_states import ConstraintStates
from robsim.run.experiment import Experiment
from robsim.world.scene import Scene

if TYPE_CHECKING:
    from robsim.plot.run_data import RunVariables

FORMAT, VERSION = "robsim recording", 2


@dataclass(frozen=True, eq=False)
class Recording:
    """Content of a page: a header, and arrays by name.

    `load_recording` reads a recording from a page.

    Attributes
    ----------
    header : dict
        Title, outcome, texts and events, and the frames, solids, cameras and curves that the page
        shows. The module `robsim.page.recordings` describes the entries.
    arrays : dict of str to array
        Arrays by name, such as "time" (T,) in seconds and "poses" (T, frames, 7).

    Examples
    --------
    >>> from robsim import Robot, export_html
    >>> from robsim.page import load_recording
    >>> arm = Robot.from_dh([[0, 0, 1, 0]], name="arm")
    >>> recording = load_recording(export_html(arm, "arm.html"))
    >>> recording.arrays["poses"].shape == (1, len(recording.header["frames"]), 7)
    True
    """

    header: dict[str, Any]  # Any: JSON
    arrays: dict[str, NDArray[Any]]  # Any: float64, float32 or uint32, by array

    def __repr__(self) -> str:
        """Return the title and the number of instants."""
        return f"<Recording {self.header['title']!r} of {len(self.arrays['time'])} instants>"


@dataclass(frozen=True, eq=False)
class RecordingInstants:
    """Data of T instants: times (T,), motion, curves, pixels by array name, and constraints."""

    time: Array
    motion: SceneMotion
    curves: list[CurvePanel] = field(default_factory=list)
    images: dict[str, Array] = field(default_factory=dict)
    constraints: ConstraintStates | None = None

    @classmethod
    def of(
        cls,
        run: RunVariables,
        scene: Scene,
        second: tuple[RunVariables, Scene] | None = None,
        owners: Sequence[Sequence[str]] = (),
    ) -> RecordingInstants:
        """Return the instants of a run, and of a second run with equally many instants.

        `owners` are the dotted names of the constraints that make each row of constraints.

        Raise InputError if the run belongs to another scene.
        """
        run_data.read_configurations(run, scene)
        other, other_motion, pixels = None, None, collect_mark_pixels(run)
        if second is not None:
            other, other_scene = second
            other_motion = SceneMotion.of(other_scene, other["q"].values)
            pixels |= collect_mark_pixels(other, " second")
        motion = SceneMotion.of(scene, run["q"].values, other_motion)
        panels, states = build_curve_panels(run, scene, other), ConstraintStates.of(run, owners)
        return cls(run["time"].values, motion, panels, pixels, states)


class RecordingBuilder:
    """Builder of recordings: the bodies of a scene as header entries, and the motion of each.

    `motion` determines the moving frames. `run` provides the camera images and the goal. `belief`
    is the scene that the task assumes. The constraints of `task` define the margins of the images.
    `depth` is the depth of camera frustums in metres.

    If `live`, the motion goes on, and `former` is the builder before a change: numbers of frames,
    shapes of equal bodies, depth and reach stay, so that only the changed entries differ.
    """

    def __init__(
        self,
        motion: SceneMotion,
        run: RunVariables | None = None,
        belief: Scene | None = None,
        task: object = None,
        live: bool = False,
        former: RecordingBuilder | None = None,
    ) -> None:
        self.shapes: BodyShapes = BodyShapes(former.shapes if former else None)
        keys = former.frames.keys if former else ()
        frames = RecordingFrames(motion, self.shapes, keys, live)
        depth = former.depth if former else choose_frustum_depth(motion)
        self.frames: RecordingFrames = frames
        self.depth: float = depth
        first = {} if run is None else run_data.number_first_marks(run)
        self.entries: dict[str, list[Entry]] = {
            "parts": build_solid_entries(frames, motion.scene, depth, "true"),
            "marks": list_mark_entries(frames, first),
            "cameras": list_camera_entries(frames, depth, run, list_view_margins(task)),
            "trails": list_trail_entries(frames),
        }
        if run is not None:
            self.entries["parts"] += list_outline_entries(frames, belief, run, depth)
        self.shapes.forget_former()
        self.reach: list[list[float]] = former.reach if former else self._find_reach()

    def build_recording(self, title: str, instants: RecordingInstants, **entries: Any) -> Recording:
        """Return the recording of the instants; `entries` are further entries of the header."""
        header = self.build_header(title, instants, **entries)
        return Recording(header, {**self.shapes.arrays, **self.collect_arrays(instants)})

    def build_header(
        self, title: str, instants: RecordingInstants, **entries: Any
    ) -> dict[str, Any]:  # Any: JSON
        """Return the header of a recording of the instants, as `build_recording`."""
        states = instants.constraints
        return {
            "format": FORMAT,
            "version": VERSION,
            "title": title,
            **{"outcome": "", "texts": {}, "why": None, "events": [], **entries},
            "curves": [each.entry for each in instants.curves],
            "constraints": states and build_constraint_entries(states),
            "reach": self.reach,
            "frames": self.frames.frame_entries,
            **self.entries,
        }

    def _find_reach(self) -> list[list[float]]:
        """Return the lowest and highest coordinates of the origins of all frames, in metres."""
        at = self.frames.compute_poses(self.frames.motion)[..., :3].reshape(-1, 3)
        ends = (at.min(axis=0), at.max(axis=0)) if len(at) else (np.zeros(3), np.zeros(3))
        return [[float(np.float32(x)) for x in end] for end in ends]

    def collect_arrays(self, instants: RecordingInstants) -> dict[str, NDArray[Any]]:
        """Return the arrays with a row for each instant, and the goals in the images."""
        return {
            "time": instants.time,
            "poses": self.frames.compute_poses(instants.motion),
            **{name: x for each in instants.curves for name, x in each.arrays.items()},
            **instants.images,
            **(pack_constraint_states(instants.constraints) if instants.constraints else {}),
        }


def find_task_belief(experiment: Experiment) -> Scene | None:
    """Return the scene that the task assumes, if it differs from the true scene."""
    belief: Scene | None = getattr(experiment.task, "belief", None)
    return None if belief in (None, experiment.scene) else belief
