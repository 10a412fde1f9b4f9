"""The controller of an experiment on its own: one command from one measurement."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from robsim.base.arrays import Array, number, numbers, runs_last
from robsim.base.errors import InputError, said
from robsim.run.experiment import Experiment
from robsim.run.staged import Staged
from robsim.servo.controller import Decision
from robsim.servo.sight import Key, Sight
from robsim.servo.standalone import Standalone


class Controller:
    """The controller of an experiment, pulled by hand: by a robot, or by a loop of your own.

    It is the very one that simulates: `step` performs the stages of the loop, from the image to
    the command, and remembers from call to call what the scheme needs (a depth filter, Broyden's
    matrix, an estimated motion). The scene of the experiment is what the controller is about; the
    imperfections of its sensing and actuation are those of the world, and play no part.

    `velocity_names` names the numbers of a command, `cameras` what it looks through.

    InputError: a mission, or several starts.

    >>> from robsim import Controller, examples, load_scenario
    >>> experiment = load_scenario(examples.path("visp_tutorial"))
    >>> controller, run = Controller(experiment), experiment.run()
    >>> qd = controller.step(run.pixels.values[0], run.q.values[0], t=0.0)
    >>> bool((qd == run.qd.values[0]).all())
    True
    """

    def __init__(self, experiment: Experiment) -> None:
        if not isinstance(experiment, Experiment):
            raise InputError(f"expected an Experiment, got {said(experiment)}")
        if isinstance(experiment.task, Staged):
            raise InputError("a mission has a controller for each phase: take one of its tasks")
        if experiment.varied:
            raise InputError("numbers differ from run to run: take one experiment, of_run(i)")
        self.dt, self.scene = experiment.dt, experiment.scene
        self._alone = Standalone(experiment.task.bind(self.scene), self.dt, hides=True)
        self.reset()

    @property
    def velocity_names(self) -> tuple[str, ...]:
        """The names of the velocities of a command."""
        names = self.scene.velocity_names
        return tuple(names[i] for i in self._alone.controller.columns)

    @property
    def cameras(self) -> tuple[str, ...]:
        """The names of the cameras, each once."""
        return tuple(dict.fromkeys(sight.eye.name for sight in self.sights))

    def reset(self) -> None:
        """Forget all that was measured, as at the start of a run."""
        self._blocks = self._alone.begin(1)
        self._last: dict[Key, Array] = {}

    def step(self, pixels: Any, q: Any, t: float) -> Array:
        """Return the velocities (n,) to command for the period that begins, in rad/s and m/s.

        pixels   (N, 2) of the marks (column, row), NaN for one that is not seen now; for several
                 cameras or targets {camera: pixels} or {(camera, target): pixels}
        q        coordinates (nq,) of the scene as measured, or {robot: q}
        t        seconds since the start, a whole number of periods: 0 begins anew

        Depths that a scheme takes for true follow from the scene at q.

        InputError: another shape, a time between two periods, a mark that was never seen.
        """
        qd: Array = self.decide(pixels, q, t).command.qd[:, 0].copy()
        return qd

    def decide(self, pixels: Any, q: Any, t: float) -> Decision:
        """Return what `step` commands, with features and errors, the run last."""
        step = self._number(t)
        if step == 0:
            self.reset()
        coordinates = self.scene.coordinates(q, "q", limits=False)
        if coordinates.shape != (self.scene.nq,):
            raise InputError(f"q: expected shape ({self.scene.nq},), got {coordinates.shape}")
        given = {sight.key: self._image(sight, pixels) for sight in self.sights}
        wide = runs_last(coordinates, 1)
        depth = {sight.key: sight.project(wide).depth for sight in self.sights}
        return self._alone.decide(self._blocks, step, wide, given, depth)

    @property
    def sights(self) -> tuple[Sight, ...]:
        """The cameras with their targets, in the order of the marks of a run."""
        return self._alone.controller.sights

    def _number(self, t: Any) -> int:
        """Return the number of the period that begins at a time."""
        periods = number(t, "t (seconds)") / self.dt
        if periods < 0 or abs(periods - round(periods)) > 1e-6 * max(periods, 1.0):
            raise InputError(f"t: expected a multiple of the period {self.dt:g} s, got {said(t)}")
        return round(periods)

    def _image(self, sight: Sight, pixels: Any) -> Array:
        """Return the pixels (N, 2, 1) of a target; what is hidden is where it was seen last."""
        what, N = f"pixels of '{sight.target.name}'", len(sight.target.marks)
        found = numbers(self._own(sight, pixels), what, (N, 2), gaps=True)
        if found.shape != (N, 2):
            raise InputError(f"{what}: expected shape ({N}, 2), got {found.shape}")
        hidden = np.asarray(np.isnan(found).any(axis=1))
        if hidden.any():
            if sight.key not in self._last:
                raise InputError(f"{what}: every mark must be seen once before it may be NaN")
            found[hidden] = self._last[sight.key][hidden]
        self._last[sight.key] = found
        rows = self._alone.given.views[sight.key].hidden
        self._blocks.put(rows, hidden[:, None].astype(float))
        return runs_last(found, 2)

    def _own(self, sight: Sight, pixels: Any) -> Any:
        """Return the pixels that are given for a camera and its target."""
        if not isinstance(pixels, Mapping):
            if len(self.sights) > 1:
                raise InputError(f"pixels: give them for each camera: {', '.join(self.cameras)}")
            return pixels
        for key in (sight.key, sight.eye.name):
            if key in pixels:
                return pixels[key]
        given = ", ".join(map(str, pixels)) or "none"
        raise InputError(f"pixels: none of camera '{sight.eye.name}'; given: {given}")
