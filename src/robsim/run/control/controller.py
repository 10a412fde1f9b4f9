"""The controller of an experiment on its own: one command from one measurement."""

from __future__ import annotations

import os
from typing import Any, Self

import numpy as np

from robsim.base.arrays import Array, flag
from robsim.base.errors import InputError, said
from robsim.files.changes import Changes
from robsim.kernels import guarding
from robsim.run.control.clock import Clock
from robsim.run.control.drive_command import DriveCommand, Health, doing, limits_of
from robsim.run.control.images import Images
from robsim.run.experiment import Experiment, load_scenario
from robsim.run.staged import Staged
from robsim.servo.controller import Decision
from robsim.servo.sight import Sight
from robsim.servo.standalone import Standalone

EMPTY = np.empty(0)


class Controller:
    """The controller of an experiment on its own, for a robot or a loop of your own.

    It is the very one that simulates: `step` performs the stages of the loop, from the image to
    the command within the limits of the experiment's `Safety`, and remembers from call to call
    what the scheme needs (a depth filter, Broyden's matrix, an estimated motion). The scene of the
    experiment is what the controller is about; the imperfections of its sensing and actuation are
    those of the world, and play no part.

    `velocity_names` names the numbers of a command, `cameras` what it looks through, `dt` is the
    period in seconds.

    InputError: a mission, or several starts.

    >>> from robsim import examples
    >>> controller = Controller.from_file(examples.path("visp_tutorial"))
    >>> run = controller.experiment.run()
    >>> command = controller.step(run.pixels.values[0], run.q.values[0], t=0.0)
    >>> bool((command.velocities == run.qd.values[0]).all()), command.phase
    (True, 'moving')
    """

    def __init__(self, experiment: Experiment) -> None:
        if not isinstance(experiment, Experiment):
            raise InputError(f"expected an Experiment, got {said(experiment)}")
        if isinstance(experiment.task, Staged):
            raise InputError("a mission has a controller for each phase: take one of its tasks")
        if experiment.varied:
            raise InputError("numbers differ from run to run: take one experiment, of_run(i)")
        self.experiment = experiment
        self.dt, self.scene = experiment.dt, experiment.scene
        bound, guard = experiment.task.bind(self.scene), experiment.guard(experiment)
        self._alone = Standalone(bound, self.dt, guard)
        self._to_run = guard.safety.hold_to_run
        scale = bound.tolerance / bound.tolerances
        self._scale, self._tolerance = scale, bound.tolerance
        self.velocity_names = tuple(self.scene.velocity_names[i] for i in bound.columns)
        self.reset()

    @classmethod
    def from_file(cls, path: str | os.PathLike[str], set: Changes = ()) -> Self:
        """Return the controller of a scenario file, with changes as in `load_scenario`.

        FileError: what is wrong with the file.
        """
        return cls(load_scenario(path, set))

    @property
    def cameras(self) -> tuple[str, ...]:
        """The names of the cameras, each once."""
        return self._images.reader.cameras

    @property
    def sights(self) -> tuple[Sight, ...]:
        """The cameras with their targets, in the order of the marks of a run."""
        return self._alone.controller.sights

    def reset(self) -> None:
        """Forget all that was measured, and any stop, as before the first call."""
        self._blocks = self._alone.begin(1)
        self._images = Images(self.scene, self.sights, self._alone.controller.excused)
        self._clock = Clock(self.dt)
        self._q = np.empty(0)
        self._last: DriveCommand | None = None

    def step(self, pixels: Any, q: Any, t: float, *, run: bool | None = None) -> DriveCommand:
        """Return what to command for the period that begins, and how the controller is.

        pixels   what is new in the images: (N, 2) of the marks (column, row), NaN for one that is
                 not seen; {number: (column, row)} of those that are; by names {target: ...},
                 {camera: ...} or {(camera, target): ...}, as a `Detector` gives them; any of these
                 as `Marks` with a time of their own, where the image is older than the joints; None
                 where there is no new image
        q        coordinates (nq,) of the scene as measured, or {robot: q}
        t        seconds, on a clock that need not begin at zero; the first call is the start
        run      whether the robot may move: by default it may, unless the safety says hold_to_run

        Calls may come early, late, or not at all: a period has the number that its time says, and
        within one the command stays. Depths that a scheme takes for true follow from the scene at
        the coordinates when the image was taken. Marks that are not seen stay where they were, and
        are left out of the features that can do without.

        InputError: what is given at the first call does not fit the scene. Later nothing is raised
        for data: the robot brakes, and `health.fault` says why.
        """
        try:
            begins = self._clock.told(t)
        except InputError as error:
            if self._last is None:
                raise
            self._clock.go_on()
            return self._brake(str(error), True)
        try:
            return self._step(pixels, q, begins, run)
        except InputError as error:
            if self._last is None:
                self._clock = Clock(self.dt)
                raise
            return self._brake(str(error), begins)

    def row(self) -> dict[str, float]:
        """Return what was measured and commanded at the last call, named as in `table`.

        A list of them is a log: `read_log(pandas.DataFrame(rows), experiment)` makes it a run.

        InputError: nothing was called yet.
        """
        if self._last is None:
            raise InputError("row: no step was taken yet")
        qd = np.zeros(self.scene.nv)
        qd[self._alone.controller.columns] = self._last.velocities
        parts = ("q", self.scene.coordinate_names, self._q), ("qd", self.scene.velocity_names, qd)
        found = {"time": self._clock.now}
        for of, names, values in parts:
            found |= {f"{of}[{name}]": x for name, x in zip(names, values.tolist(), strict=True)}
        for i, pair in enumerate(self._images.seen().tolist()):
            found |= {f"pixels[{i},column]": pair[0], f"pixels[{i},row]": pair[1]}
        return found

    def decide(self, pixels: Any, q: Any, t: float) -> Decision:
        """Return what `step` commands, with features and errors, the run last."""
        self._step(pixels, q, self._clock.told(t), None)
        return self._alone.decision(self._blocks)

    def _step(self, pixels: Any, q: Any, begins: bool, run: Any) -> DriveCommand:
        """Take what was measured, and decide once in a period, when it begins."""
        released = not self._to_run if run is None else flag(run, "run")
        joints = self._joints(q)
        unused = self._images.take(pixels, joints, self._clock.now)
        self._q = joints
        if self._last is not None and not begins:
            return self._last
        if not self._images.known:
            return self._wait(unused)
        return self._decided(float(released), unused)

    def _joints(self, q: Any) -> Array:
        """Return coordinates (nq,) of the scene."""
        if type(q) is np.ndarray and q.dtype == np.float64 and q.shape == (self.scene.nq,):
            found = q.copy()
            if np.isfinite(found).all():
                return found
        found = self.scene.coordinates(q, "q", limits=False)
        if found.shape != (self.scene.nq,):
            raise InputError(f"q: expected shape ({self.scene.nq},), got {found.shape}")
        return found

    def _decided(self, released: float, unused: tuple[str, ...], fault: str = "") -> DriveCommand:
        """Return the command of the period, by the stages of the loop."""
        age = self._images.age(self._clock.now)
        self._alone.take(self._blocks, self._q, self._images.each.items(), age, released)
        self._alone.perform(self._blocks, self._clock.step)
        why, at_limit, error, qd, busy = self._alone.read(self._blocks)
        small = bool((np.abs(error * self._scale) < self._tolerance).all())
        converged = small and not busy and not why & guarding.HELD
        limits = limits_of(why, at_limit, self.velocity_names) if why else ()
        stale = bool(why & guarding.OLD_IMAGE)
        health = Health(converged, self._images.lost(), stale, age, limits, unused, fault)
        self._last = DriveCommand(qd, error, doing(why, converged), health)
        return self._last

    def _wait(self, unused: tuple[str, ...], fault: str = "") -> DriveCommand:
        """Return that the robot stands still until all marks have been seen once."""
        health = Health(lost=self._images.lost(), unused=unused, fault=fault)
        self._last = DriveCommand(np.zeros(len(self.velocity_names)), EMPTY, "waiting", health)
        return self._last

    def _brake(self, fault: str, begins: bool) -> DriveCommand:
        """Return how the robot brakes, as what was given now does not serve."""
        assert self._last is not None
        if not begins:
            health = self._last.health._replace(fault=fault)
            return self._last._replace(health=health)
        if not self._images.known:
            return self._wait((), fault)
        try:
            return self._decided(0.0, (), fault)
        except InputError as error:  # from a law or a feature of the user's own
            health = Health(lost=self._images.lost(), fault=f"{fault}; {error}")
            zero = np.zeros(len(self.velocity_names))
            self._last = DriveCommand(zero, EMPTY, "holding", health)
            return self._last
