"""A simulated robot cell without a controller: it takes commands, and gives measurements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_floats
from robsim.base.errors import InputError, format_value
from robsim.engine.chunk import Chunk
from robsim.engine.image_stream import ImageStream
from robsim.engine.loop import Loop
from robsim.engine.plant import Plant
from robsim.features.images.taken_pictures import find_pictures
from robsim.kernels.machine.program import Program, PythonStage
from robsim.servo.camera_target import CameraTarget, PairKey
from robsim.world.scene import Scene


@dataclass(frozen=True, eq=False)
class CellInstant:
    """The state of a simulated cell at one control instant, and its measurements.

    Attributes
    ----------
    step : int
        Number of the instant.
    time : float
        Seconds since the start.
    q : ndarray of shape (nq,)
        Coordinates, as they truly are.
    measured : ndarray of shape (nq,)
        Coordinates by the encoders.
    rates : ndarray of shape (nv,)
        Velocities in the past period.
    torque : ndarray of shape (nv,) or (0,)
        Torques of the drives; empty without a drive.
    pixels : dict of (str, str) to ndarray of shape (N, 2)
        Image coordinates by camera and target; NaN for a mark outside of the image, or hidden.
    arrived : bool
        Whether a new image arrives at this instant.
    image_time : float
        Time in seconds at which the newest image was taken.
    pictures : dict of str to ndarray of shape (h, w)
        New grey picture of each camera that the task uses pictures of.

    Examples
    --------
    >>> from robsim import examples, load_scenario
    >>> now = load_scenario(examples.path("eye_in_hand")).cell().now
    >>> now.arrived, now.image_time, now.pixels["camera", "plate"][0].round(1).tolist()
    (True, 0.0, [579.9, 316.8])
    """

    step: int
    time: float
    q: Array
    measured: Array
    rates: Array
    torque: Array
    pixels: Mapping[PairKey, Array]
    arrived: bool
    image_time: float
    pictures: Mapping[str, NDArray[np.uint8]]


class SimulatedCell:
    """The plant and the sensors of a single run, which advance by one period at a time.

    The cell has every imperfection of the run: errors of the scene that the controller believes in,
    delays, noise, lag and drives. With the commands of the controller for the measurements of each
    instant it moves as the run, bit for bit. It has no end: marks may leave the image, and joints
    may leave their limits.

    Parameters
    ----------
    loop : Loop
        Loop of a single run, from `Experiment.loop_from_start`.

    Attributes
    ----------
    scene : Scene
        Scene as it truly is.
    dt : float
        Control period in seconds.
    sights : tuple of CameraTarget
        Cameras and targets of the task.
    columns : ndarray of int
        Indices of the commanded velocities.
    now : CellInstant
        Present instant.

    Raises
    ------
    InputError
        If the loop has several runs.

    Examples
    --------
    >>> from robsim import examples, load_scenario
    >>> cell = SimulatedCell(load_scenario(examples.path("eye_in_hand")).loop_from_start())
    >>> start = cell.now.q
    >>> later = cell.advance([0.1] * cell.columns.size)
    >>> later.step, (later.q - start).round(6).tolist()
    (1, [0.004, 0.004, 0.004, 0.004, 0.004, 0.004, 0.004])
    """

    now: CellInstant

    def __init__(self, loop: Loop) -> None:
        if not isinstance(loop, Loop):
            raise InputError(f"expected the loop of an experiment, got {format_value(loop)}")
        if len(loop.q0) != 1:
            raise InputError(f"a cell is a single run, and there are {len(loop.q0)}: take one")
        self._loop, controller = loop, loop.controller
        program = self._program = Program()
        motion = loop.actuation, loop.scene, controller.columns, loop.q0
        plant = Plant(program, *motion, loop.dt, loop.seed, loop.runs, loop.driven)
        detection = controller.detectors, controller.believed_sights, controller.picture_sights
        optional = frozenset(sight.key for sight in self.sights)  # no mark ends the run
        imperfections = loop.sensing, loop.steps, optional
        images = ImageStream(program, plant, self.sights, *imperfections, *detection)
        self._plant, self._images = plant, images
        self._lay_out_stages()
        self.reset()

    def _lay_out_stages(self) -> None:
        """Add the stages of a period: the motion, the measurement and the command."""
        program, plant, images = self._program, self._plant, self._images
        images.remember()
        plant.move()
        moved = len(program.calls)
        plant.place()
        images.add_image_stages()
        self._inputs = images.measure()
        measured = len(program.calls)
        self._command = program.rows(self.columns.size)
        plant.command(self._command)
        self._motion = program.segments(0, moved)
        self._measurement = program.segments(moved, measured)
        self._response = program.segments(measured)

    @property
    def scene(self) -> Scene:
        """The scene, as it truly is."""
        return self._loop.scene

    @property
    def dt(self) -> float:
        """The control period in seconds."""
        return self._loop.dt

    @property
    def sights(self) -> tuple[CameraTarget, ...]:
        """The cameras and targets of the task."""
        return self._loop.controller.sights

    @property
    def columns(self) -> NDArray[np.int64]:
        """The indices of the commanded velocities."""
        return self._loop.controller.columns

    def reset(self) -> CellInstant:
        """Return to the start, and return its instant."""
        self._blocks, self._step = Chunk(self._program, np.arange(1)), 0
        return self._measure()

    def advance(self, qd: Sequence[float] | Array) -> CellInstant:
        """Move for one period with commanded velocities, and return the next instant.

        Parameters
        ----------
        qd : array_like of shape (n,)
            Commanded velocities in rad/s and m/s, or torques if the task commands torques.

        Returns
        -------
        CellInstant
            Next instant.

        Raises
        ------
        InputError
            If the numbers do not fit the commanded joints.
        """
        command = as_floats(qd, "qd", (self.columns.size,))
        self._blocks.fill(self._command, command)
        self._perform(self._response)
        self._step += 1
        self._perform(self._motion)
        return self._measure()

    def _perform(self, segments: Sequence[PythonStage]) -> None:
        """Perform stages at the present step."""
        for part in segments:
            part(self._blocks, self._step)

    def _measure(self) -> CellInstant:
        """Perform the measurement at the present step, and store its instant."""
        self._perform(self._measurement)
        first, plant, images = self._blocks.first, self._plant, self._images
        age, delay = (float(first(row)) for row in (images.age, images.delay))
        time, latency = self._step * self.dt, float(first(images.latency))
        taken = time - latency - (age - delay) * self.dt
        rates = plant.rates if plant.rates.size else plant.qd
        torque = first(plant.torques[0]) if plant.torques else np.empty(0)
        parts = first(plant.q), first(self._inputs.q), first(rates), torque
        pixels, pictures = self._read_pixels(), self._read_pictures()
        self.now = CellInstant(self._step, time, *parts, pixels, age <= delay, taken, pictures)
        return self.now

    def _read_pixels(self) -> dict[PairKey, Array]:
        """Return the pixels (N, 2) of each camera and target, NaN for marks that are not seen."""
        views = {}
        for key, view in self._inputs.views.items():
            pixels = self._blocks.first(view.pixels)
            if view.hidden is not None:
                pixels[self._blocks.first(view.hidden) != 0.0] = np.nan
            views[key] = pixels
        return views

    def _read_pictures(self) -> dict[str, NDArray[np.uint8]]:
        """Return the new picture (h, w) of each camera whose pictures the task uses."""
        taken = {name: find_pictures(self._blocks, name) for name in self._images.pictured}
        return {name: each.grey[0] for name, each in taken.items() if each and len(each.runs)}
