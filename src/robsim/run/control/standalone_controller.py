"""The controller of an experiment on its own: one command for each measurement."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from robsim.base.arrays import Array, as_bool, make_read_only
from robsim.base.errors import InputError, format_value
from robsim.features.images.taken_pictures import store_pictures
from robsim.files.overrides import Changes
from robsim.kernels.control import command_limits
from robsim.run.control.clock import ControlClock
from robsim.run.control.drive_command import (
    EMPTY,
    Doing,
    DriveCommand,
    Health,
    classify_activity,
    list_active_limits,
)
from robsim.run.control.frame_input import FrameBuffer
from robsim.run.control.image_buffer import ImageBuffer
from robsim.run.control.mark_input import Marks, Pixels
from robsim.run.experiment import Coordinates, Experiment, load_scenario
from robsim.run.experiment_paths import make_command_guard
from robsim.run.mission_protocol import SelfSimulatingTask
from robsim.servo.camera_target import CameraTarget
from robsim.servo.command import Decision
from robsim.servo.constraints.start_check import check_constraints
from robsim.servo.single_step import SingleStepController
from robsim.servo.task_controller import TaskController

BEYOND = 0.1  # tolerance of measured joints outside their limits, as a share of their range
LATENESS = 1e-3  # periods: tolerance of the longest time of a command, as clocks are not exact
PAUSE, PERIODS = 0.25, 5  # seconds and periods without a call after which the robot stands still


class Controller:
    """Controller of an experiment on its own, for a real robot or a loop of your own.

    It performs the same stages as a simulation, from the image to the command within the limits of
    the experiment's `Safety`. Between calls it stores the memory of the scheme (a depth filter,
    Broyden's matrix, an estimated motion). The scene of the experiment is the controller's model.
    The imperfections of the experiment, sensing and actuation, are properties of the simulated
    world and have no effect here.

    Parameters
    ----------
    experiment : Experiment
        Experiment with a scene, a task and a single start.

    Attributes
    ----------
    experiment : Experiment
        The experiment.
    dt : float
        Control period in seconds.
    velocity_names : tuple of str
        Names of the commanded velocities.
    command_quantity : {"velocity", "torque"}
        Quantity of the command. Torques are in N m and N; the drive adds damping and gravity.
    cameras : tuple of str
        Names of the cameras that the task uses.

    Raises
    ------
    InputError
        If the task is a mission, or if there are several runs.

    Examples
    --------
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
        check_constraints(bound)
        guard.check_command_quantity(bound)
        self.command_quantity = bound.command_quantity
        self._standalone = SingleStepController(bound, self.dt, guard)
        self._safety, self._longest_hold = guard.safety, guard.hold
        self._longest_pause = max(PAUSE, PERIODS * self.dt, guard.hold)
        self._scale, self._tolerance = bound.tolerance_scale, bound.tolerance
        self._bounds = _compute_measurable_range(self.scene.limits)
        self.velocity_names = tuple(self.scene.velocity_names[i] for i in bound.columns)
        self.reset()

    @classmethod
    def from_file(cls, path: str | os.PathLike[str], set: Changes = ()) -> Self:
        """Return the controller of a scenario file.

        Parameters
        ----------
        path : str or path
            TOML file.
        set : dict or sequence of str, optional
            Changes, as in `load_scenario`.

        Returns
        -------
        Controller
            The controller.

        Raises
        ------
        FileError
            If the file cannot be read or is not valid.
        """
        return cls(load_scenario(path, set))

    @property
    def cameras(self) -> tuple[str, ...]:
        """The names of the cameras, each once."""
        return self._images.reader.cameras

    @property
    def pictured_cameras(self) -> tuple[str, ...]:
        """The names of the cameras with features of pictures, each once."""
        return tuple(dict.fromkeys(sight.eye.name for sight in self._frames.sights))

    @property
    def sights(self) -> tuple[CameraTarget, ...]:
        """The pairs of camera and target, in the order of the marks of a run."""
        return self._standalone.controller.sights

    @property
    def bound_task(self) -> TaskController:
        """The task bound to the scene, with its detectors and believed cameras."""
        return self._standalone.controller

    def reset(self) -> None:
        """Forget all measurements and any stop, as before the first call.

        The robot is assumed to stand still.
        """
        bound = self._standalone.controller
        self._blocks = self._standalone.begin(1)
        self._images = ImageBuffer(self.scene, self.sights, bound.optional_pairs, bound.whole)
        self._frames = FrameBuffer([s for s in self.sights if s.key in bound.pictured_pairs])
        self._clock = ControlClock(self.dt)
        self._released_periods = 0  # periods with a released robot: the time of paths
        self._command_time = math.inf  # time of the call with the current command; none yet
        self._reset_reason = ""  # reason for a reset of the memory, or ""
        self._rests_first = False  # whether the robot comes to rest before that reset
        self._q = np.empty(0)
        self._last: DriveCommand | None = None

    def step(
        self,
        pixels: Pixels | Marks | None,
        q: Coordinates,
        t: float,
        *,
        run: bool | None = None,
        images: Mapping[str, ArrayLike] | None = None,
    ) -> DriveCommand:
        """Return the command for the period that begins, and the health of the controller.

        Calls may be early, late or missing: periods begin at fixed times, and the command does not
        change within a period. After a pause of more than 0.25 s and five periods, the robot
        is assumed to stand still, and the memory of the scheme is reset; with `driver_holds` of the
        safety the robot first brakes to rest. If a command acted longer than `call_interval` of the
        safety allows, the robot brakes for a period. The time of a path or a
        prescribed motion counts the periods with a released robot.

        True depths of a scheme are computed from the scene at the coordinates at the capture time.
        Marks that are not seen keep their last pixels; features that do not need all marks ignore
        them.

        Parameters
        ----------
        pixels : array_like of shape (N, 2), dict, Marks or None
            New image data: pixels (column, row) of the marks, NaN for a mark that is not seen; or
            {number: (column, row)} of the seen marks; or these by names, as {target: ...},
            {camera: ...} or {(camera, target): ...}, the output of a `TagDetector`. Use `Marks` for
            images that are older than the joints. None: there is no new image.
        q : array_like of shape (nq,), or dict
            Measured coordinates of the scene, or {robot: q}.
        t : float
            Time in seconds, on any clock. The first call defines the start.
        run : bool, optional
            Whether the robot may move. Default: True, unless the safety sets `hold_to_run`.
        images : dict of camera names to array_like of uint8, optional
            New pictures for features of pictures, taken at this time: grey values (h, w), or
            colours (h, w, 3) in the order red, green, blue. They replace the marks of their camera.

        Returns
        -------
        DriveCommand
            Velocities, error, activity and health.

        Raises
        ------
        InputError
            If the data of the first call do not fit the scene. Later calls do not raise for data:
            the robot brakes, and `health.fault` gives the error.
        """
        self._images.clear_new()
        try:
            passed = self._clock.advance(t)
        except Exception as error:  # of the time, or of its conversion
            if self._last is None:
                raise
            if self._clock.turned_back:
                self._command_time = self._clock.now
                self._images.forget_times()
            begins = self._clock.begins_without_time()
            return self._brake(str(error) or type(error).__name__, begins)
        if self._last is None:
            return self._begin(pixels, images, q, run)
        if passed * self.dt > self._longest_pause:
            self._rests_first = self._safety.driver_holds
            if not self._rests_first:
                self._standalone.rest(self._blocks)
            self._reset_reason = (
                f"no call for {passed * self.dt:.3g} s: the memory of the scheme is reset"
            )
        try:
            return self._step(pixels, images, q, passed > 0, run)
        except Exception as error:  # noqa: BLE001  errors of the data or of a user's law
            return self._brake(str(error) or type(error).__name__, passed > 0)

    def row(self) -> dict[str, float | str]:
        """Return the measurements and the command of the last call, with the names of `to_table`.

        A list of rows is a log: `read_log(rows, experiment)` converts it to a run.

        Returns
        -------
        dict of str to float or str
            `time` in seconds; `phase`, `limits` (separated by semicolons) and `fault` of the
            command; coordinates `q[...]`, commanded velocities or torques `qd[...]`, and for each
            new image its capture time `image_time[camera,target]` in seconds and its `pixels[...]`;
            NaN without a new image.

        Raises
        ------
        InputError
            If there was no call yet.
        """
        if self._last is None:
            raise InputError("row: call step first")
        qd = np.zeros(self.scene.nv)
        qd[self._standalone.controller.columns] = self._last_numbers
        parts = ("q", self.scene.coordinate_names, self._q), ("qd", self.scene.velocity_names, qd)
        health = self._last.health
        row: dict[str, float | str] = {
            "time": self._clock.now,
            "phase": self._last.phase,
            "limits": "; ".join(health.limits),
            "fault": health.fault,
        }
        for of, names, values in parts:
            row |= {f"{of}[{name}]": x for name, x in zip(names, values.tolist(), strict=True)}
        for (camera, target), seconds in self._images.list_new_image_times().items():
            row[f"image_time[{camera},{target}]"] = seconds
        for i, pair in enumerate(self._images.collect_new_pixels().tolist()):
            row |= {f"pixels[{i},column]": pair[0], f"pixels[{i},row]": pair[1]}
        return row

    def last_decision(self) -> Decision:
        """Return the decision of the last call of `step`, with the run as the last axis.

        Raises
        ------
        InputError
            If no command has been computed yet.
        """
        if self._last is None or not self._images.are_known:
            raise InputError("no command yet: call step with an image first")
        return self._standalone.decision(self._blocks)

    def decide(self, pixels: Pixels | Marks | None, q: Coordinates, t: float) -> Decision:
        """Return the decision of `step` for a released robot, with features and errors, run last.

        Returns
        -------
        Decision
            Command, features, errors and Jacobians, with the run as the last axis.

        Raises
        ------
        InputError
            If the data do not fit the scene.
        """
        self._images.clear_new()
        self._step(pixels, None, q, self._clock.advance(t) > 0, True)
        return self._standalone.decision(self._blocks)

    def _begin(self, pixels: Any, images: Any, q: Any, run: Any) -> DriveCommand:
        """Return the first command; after an error the controller is reset."""
        try:
            return self._step(pixels, images, q, True, run)
        except Exception:
            self.reset()
            raise

    def _step(self, pixels: Any, images: Any, q: Any, begins: bool, run: Any) -> DriveCommand:
        """Store the measurements, and decide once in a period, at its start."""
        released = not self._safety.hold_to_run if run is None else as_bool(run, "run")
        joints, now = self._joints(q), self._clock.now
        if begins:
            self._images.store_joints(joints, now)
        unused = self._images.take(pixels, joints, now)
        arrived = self._frames.take(images)
        for sight in (each for each in self._frames.sights if each.eye.name in arrived):
            self._images.take_picture(sight, joints, now)
        self._q = joints
        if self._last is not None and not begins:
            return self._repeat_command(unused, "")
        if not self._images.are_known:
            return self._make_stop("waiting", unused)
        return self._command(released, unused)

    def _joints(self, q: Any) -> Array:
        """Return coordinates (nq,) of the scene, which may slightly exceed their limits."""
        nq = self.scene.nq
        if type(q) is np.ndarray and q.dtype == np.float64 and q.shape == (nq,):
            joints = q.copy()
        else:
            joints = self.scene.coordinates(q, "q", limits=False)
        if joints.shape != (nq,):
            raise InputError(f"q: expected shape ({nq},), got {joints.shape}")
        in_range = (joints >= self._bounds[0]) & (joints <= self._bounds[1])
        if not in_range.all():
            i = int(np.argmin(in_range))
            name, unit = self.scene.coordinate_names[i], self.scene.coordinate_units[i]
            low, high = self.scene.limits[i]
            raise InputError(
                f"q: joint '{name}' is {joints[i]:.6g} {unit}, far outside its limits "
                f"[{low:.6g}, {high:.6g}] {unit}"
            )
        return joints

    def _command(self, released: bool, unused: tuple[str, ...], fault: str = "") -> DriveCommand:
        """Return the command of the period, computed by the stages of the loop.

        A robot that continued its last command in a pause brakes to rest, and the memory is reset
        in each of these periods.
        """
        age, reset_reason = self._images.age(self._clock.now), self._reset_reason
        self._perform(released, age)
        command = self._make_command(unused, age, "; ".join(filter(None, (fault, reset_reason))))
        self._rests_first = self._rests_first and bool(self._last_numbers.any())
        if self._rests_first:
            self._reset_reason = reset_reason
        return command

    def _perform(self, released: bool, age: float) -> None:
        """Perform the stages of the period.

        In a period that resets the memory the robot may not move.
        """
        step = self._released_periods
        if self._reset_reason:
            released, step = False, 0
        images = self._images.each.items()
        permission = -1.0 if released and self._is_late() else float(released)
        self._standalone.take(self._blocks, self._q, images, age, permission)
        store_pictures(self._blocks, self._frames.release())
        self._standalone.perform(self._blocks, step)
        self._released_periods, self._reset_reason = self._released_periods + (permission > 0), ""
        self._command_time = self._clock.now
        if self._standalone.read_reasons(self._blocks) & command_limits.NOT_FINITE:
            self._reset_reason = "not finite before: the memory of the scheme is reset"

    @property
    def _last_numbers(self) -> Array:
        """The last commanded velocities or torques (n,)."""
        assert self._last is not None
        return self._last.numbers

    def _is_late(self) -> bool:
        """Return whether the last command acted longer than the safety allows."""
        excess = self._clock.now - self._command_time - self._longest_hold
        return self._safety.call_interval is not None and excess > LATENESS * self.dt

    def _make_command(self, unused: tuple[str, ...], age: float, fault: str) -> DriveCommand:
        """Return the command and the health that the stages of the period have computed."""
        why, at_limit, error, qd, busy = self._standalone.read(self._blocks)
        small = bool((np.abs(error * self._scale) < self._tolerance).all())
        free = not busy and not why & command_limits.HELD
        converged = small and free and self._images.complete
        limits = list_active_limits(why, at_limit, self.velocity_names) if why else ()
        limits += self._standalone.name_active_constraints(self._blocks)
        stale = bool(why & command_limits.OLD_IMAGE)
        health = Health(
            converged, self._images.list_lost_marks(), stale, age, limits, unused, fault
        )
        activity = classify_activity(why, converged)
        self._last = self._fill_command(make_read_only(qd), make_read_only(error), activity, health)
        return self._last

    def _fill_command(
        self, command: Array, error: Array, phase: Doing, health: Health
    ) -> DriveCommand:
        """Return a command with the numbers as velocities, or as torques."""
        if self.command_quantity == "torque":
            return DriveCommand(EMPTY, error, phase, health, command)
        return DriveCommand(command, error, phase, health)

    def _make_stop(self, phase: Doing, unused: tuple[str, ...], fault: str = "") -> DriveCommand:
        """Return a command that stops the robot, without the stages of the loop."""
        age = self._images.age(self._clock.now)
        health = Health(lost=self._images.list_lost_marks(), age=age, unused=unused, fault=fault)
        self._command_time = self._clock.now
        qd = self._standalone.compute_braking(self._blocks)
        self._last = self._fill_command(make_read_only(qd), EMPTY, phase, health)
        return self._last

    def _repeat_command(self, unused: tuple[str, ...], fault: str) -> DriveCommand:
        """Return the command of the period again, with the state of the data of this call."""
        assert self._last is not None
        health = self._last.health._replace(unused=unused, fault=fault)
        self._last = self._last._replace(health=health)
        return self._last

    def _brake(self, fault: str, begins: bool) -> DriveCommand:
        """Return a braking command, because the data of this call cannot be used."""
        assert self._last is not None
        if not begins:
            return self._repeat_command((), fault)
        if not self._images.are_known:
            return self._make_stop("waiting", (), fault)
        try:
            return self._command(False, (), fault)
        except Exception as error:  # noqa: BLE001  errors of a user's law or feature
            faults = dict.fromkeys((fault, str(error) or type(error).__name__))
            return self._make_stop("holding", (), "; ".join(faults))


def _compute_measurable_range(limits: Array) -> Array:
    """Return bounds (2, nq) of measured joints: their limits, widened by a tenth."""
    low, high = limits.T
    with np.errstate(invalid="ignore"):
        beyond = np.nan_to_num(BEYOND * (high - low), nan=0.0, posinf=0.0)
    most = np.finfo(float).max  # for joints without limits
    return np.array([np.maximum(low - beyond, -most), np.minimum(high + beyond, most)])
