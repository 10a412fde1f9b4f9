"""The controller of an experiment on its own: one command from one measurement."""

from __future__ import annotations

import os
from typing import Any, Self

import numpy as np

from robsim.base.arrays import Array, as_bool, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.files.overrides import Changes
from robsim.kernels.control import command_limits
from robsim.run.control.clock import ControlClock
from robsim.run.control.drive_command import (
    Doing,
    DriveCommand,
    Health,
    classify_activity,
    list_active_limits,
)
from robsim.run.control.image_buffer import ImageBuffer
from robsim.run.experiment import Experiment, load_scenario
from robsim.run.experiment_paths import make_command_guard
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.servo.camera_target import CameraTarget
from robsim.servo.command import Decision
from robsim.servo.single_step import SingleStepController

EMPTY = make_read_only(np.empty(0))
BEYOND = 0.1  # of the range of a joint, by which it may be measured outside of it
PAUSE, PERIODS = 0.25, 5  # seconds and periods without a call, after which a robot stands


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
            raise InputError(f"expected an Experiment, got {format_value(experiment)}")
        if isinstance(experiment.task, SelfSimulatingTask):
            raise InputError("a mission has a controller for each phase: take one of its tasks")
        if experiment.varied:
            raise InputError("numbers differ from run to run: take one experiment, of_run(i)")
        self.experiment = experiment
        self.dt, self.scene = experiment.dt, experiment.scene
        bound, guard = (
            experiment.task.bind(self.scene),
            make_command_guard(experiment, experiment.safety),
        )
        self._alone = SingleStepController(bound, self.dt, guard)
        self._to_run = guard.safety.hold_to_run
        scale = bound.tolerance / bound.tolerances
        self._scale, self._tolerance = scale, bound.tolerance
        self._bounds = _compute_measurable_range(self.scene.limits)
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
    def sights(self) -> tuple[CameraTarget, ...]:
        """The cameras with their targets, in the order of the marks of a run."""
        return self._alone.controller.sights

    def reset(self) -> None:
        """Forget all that was measured, and any stop, as before the first call.

        The robot is taken to stand still.
        """
        bound = self._alone.controller
        self._blocks = self._alone.begin(1)
        self._images = ImageBuffer(self.scene, self.sights, bound.excused, bound.whole)
        self._clock = ControlClock(self.dt)
        self._decided = 0  # periods in which the robot might move: the time of paths
        self._anew = ""  # why what is remembered begins anew
        self._q = np.empty(0)
        self._last: DriveCommand | None = None

    def step(self, pixels: Any, q: Any, t: float, *, run: bool | None = None) -> DriveCommand:
        """Return what to command for the period that begins, and how the controller is.

        pixels   what is new in the images: (N, 2) of the marks (column, row), NaN for one that is
                 not seen; {number: (column, row)} of those that are; by names {target: ...},
                 {camera: ...} or {(camera, target): ...}, as a `TagDetector` gives them; any of these
                 as `Marks` with a time of their own, where the image is older than the joints; None
                 where there is no new image
        q        coordinates (nq,) of the scene as measured, or {robot: q}
        t        seconds, on a clock that need not begin at zero; the first call is the start
        run      whether the robot may move: by default it may, unless the safety says hold_to_run

        Calls may come early or late, and some may be left out: a period begins when its time comes,
        and within one the command stays. After a pause of a quarter of a second, and of five
        periods, the robot is taken to stand, and all that is remembered begins anew. The time of a
        path or a prescribed motion is that of the periods in which the robot might move.

        Depths that a scheme takes for true follow from the scene at the coordinates when the image
        was taken. Marks that are not seen stay where they were, and are left out of the features
        that can do without.

        InputError: what is given at the first call does not fit the scene. Later nothing is raised
        for data: the robot brakes, and `health.fault` says why.
        """
        self._images.nothing_new()
        try:
            passed = self._clock.told(t)
        except InputError as error:
            if self._last is None:
                raise
            if self._clock.turned_back:
                self._images.forget_times()
            return self._brake(str(error), self._clock.begins_without())
        if self._last is None:
            return self._begun(pixels, q, run)
        if passed * self.dt > max(PAUSE, PERIODS * self.dt):
            self._alone.rest(self._blocks)
            self._anew = f"no call for {passed * self.dt:.3g} s: what is remembered begins anew"
        try:
            return self._step(pixels, q, passed > 0, run)
        except Exception as error:  # noqa: BLE001  of whatever was given, or a user's law
            return self._brake(str(error) or type(error).__name__, passed > 0)

    def row(self) -> dict[str, float]:
        """Return what was measured and commanded at the last call, named as in `table`.

        A list of them is a log: `read_log(rows, experiment)` makes it a run.

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
        """Return what `step` commands while it may, with features and errors, the run last.

        InputError: what is given does not fit the scene.
        """
        self._images.nothing_new()
        self._step(pixels, q, self._clock.told(t) > 0, True)
        return self._alone.decision(self._blocks)

    def _begun(self, pixels: Any, q: Any, run: Any) -> DriveCommand:
        """Return the first command; after an error all is as before."""
        try:
            return self._step(pixels, q, True, run)
        except Exception:
            self.reset()
            raise

    def _step(self, pixels: Any, q: Any, begins: bool, run: Any) -> DriveCommand:
        """Take what was measured, and decide once in a period, when it begins."""
        released = not self._to_run if run is None else as_bool(run, "run")
        joints, now = self._joints(q), self._clock.now
        if begins:
            self._images.note(joints, now)
        unused = self._images.take(pixels, joints, now)
        self._q = joints
        if self._last is not None and not begins:
            health = self._last.health._replace(unused=unused, fault="")
            return self._last._replace(health=health)
        if not self._images.known:
            return self._still("waiting", unused)
        return self._command(released, unused)

    def _joints(self, q: Any) -> Array:
        """Return coordinates (nq,) of the scene, which may be a little beyond their limits."""
        nq = self.scene.nq
        if type(q) is np.ndarray and q.dtype == np.float64 and q.shape == (nq,):
            found = q.copy()
        else:
            found = self.scene.coordinates(q, "q", limits=False)
        if found.shape != (nq,):
            raise InputError(f"q: expected shape ({nq},), got {found.shape}")
        there = (found >= self._bounds[0]) & (found <= self._bounds[1])
        if not there.all():
            i = int(np.argmin(there))
            name, unit = self.scene.coordinate_names[i], self.scene.coordinate_units[i]
            low, high = self.scene.limits[i]
            raise InputError(
                f"q: joint '{name}' is {found[i]:.6g} {unit}, far outside its limits "
                f"[{low:.6g}, {high:.6g}] {unit}"
            )
        return found

    def _command(self, released: bool, unused: tuple[str, ...], fault: str = "") -> DriveCommand:
        """Return the command of the period, by the stages of the loop.

        Where what is remembered begins anew, the robot may not move in this period.
        """
        age, step = self._images.age(self._clock.now), self._decided
        if self._anew:
            released, step, fault = False, 0, "; ".join(filter(None, (fault, self._anew)))
        images = self._images.each.items()
        self._alone.take(self._blocks, self._q, images, age, float(released))
        self._alone.perform(self._blocks, step)
        self._decided, self._anew = self._decided + released, ""
        return self._told(unused, age, fault)

    def _told(self, unused: tuple[str, ...], age: float, fault: str) -> DriveCommand:
        """Return what the stages of the period have decided."""
        why, at_limit, error, qd, busy = self._alone.read(self._blocks)
        if why & command_limits.NOT_FINITE:
            self._anew = "not finite before: what is remembered begins anew"
        small = bool((np.abs(error * self._scale) < self._tolerance).all())
        free = not busy and not why & command_limits.HELD
        converged = small and free and self._images.complete
        limits = list_active_limits(why, at_limit, self.velocity_names) if why else ()
        stale = bool(why & command_limits.OLD_IMAGE)
        health = Health(converged, self._images.lost(), stale, age, limits, unused, fault)
        self._last = DriveCommand(
            make_read_only(qd), make_read_only(error), classify_activity(why, converged), health
        )
        return self._last

    def _still(self, phase: Doing, unused: tuple[str, ...], fault: str = "") -> DriveCommand:
        """Return that the robot is not to move, or how it brakes, without the stages."""
        age = self._images.age(self._clock.now)
        health = Health(lost=self._images.lost(), age=age, unused=unused, fault=fault)
        qd = self._alone.braked(self._blocks)
        self._last = DriveCommand(make_read_only(qd), EMPTY, phase, health)
        return self._last

    def _brake(self, fault: str, begins: bool) -> DriveCommand:
        """Return how the robot brakes, as what was given now does not serve."""
        assert self._last is not None
        if not begins:
            health = self._last.health._replace(unused=(), fault=fault)
            return self._last._replace(health=health)
        if not self._images.known:
            return self._still("waiting", (), fault)
        try:
            return self._command(False, (), fault)
        except Exception as error:  # noqa: BLE001  of a law or a feature of the user's own
            said = dict.fromkeys((fault, str(error) or type(error).__name__))
            return self._still("holding", (), "; ".join(said))


def _compute_measurable_range(limits: Array) -> Array:
    """Return the bounds (2, nq) of what joints can be measured at: a tenth beyond their limits."""
    low, high = limits.T
    with np.errstate(invalid="ignore"):
        beyond = np.nan_to_num(BEYOND * (high - low), nan=0.0, posinf=0.0)
    most = np.finfo(float).max  # of joints without limits
    return np.array([np.maximum(low - beyond, -most), np.minimum(high + beyond, most)])
