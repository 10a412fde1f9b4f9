"""Derivatives of the motion of driven joints about rest, from the sub-steps of the simulation."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from robsim.analysis.linearisation.linear_plant import StateMap
from robsim.base.arrays import Array, is_any_nonzero
from robsim.base.errors import InputError
from robsim.engine.driven_joints import DrivenJoints
from robsim.engine.plant import Plant
from robsim.kernels.dynamics.joint_drives import add_torques
from robsim.kernels.machine.program import Blocks, Program
from robsim.run.experiment import Experiment
from robsim.world.actuation import Actuation

STEPS = 1e-4, 1e-7  # steps of central differences in the units of each row; the latter if curved
ROUGHNESS = 0.02  # largest ratio of second to first difference of a smooth motion
INSTANT = 1e-9  # seconds in which the state hardly changes
UNLIMITED = 1e100  # torque in N m or N; finite, as derivatives of infinite numbers are NaN


class LinearJoints(DrivenJoints):
    """Driven joints without Coulomb friction and without limits of torques."""

    def numbers(self, part: str) -> Array:
        """Return armature, damping or friction (n,) of the joints; the friction is zero."""
        numbers = super().numbers(part)
        return 0.0 * numbers if part == "friction" else numbers

    @cached_property
    def limits(self) -> Array:
        """Largest torques (n,), which no drive reaches."""
        return np.full(len(self.joints), UNLIMITED)


class DriveProgram:
    """Compiled motion of driven joints over a time, at the end of an experiment.

    Inputs are velocities of the scene, and torques (m,) in addition to the torques of the drives.
    """

    def __init__(self, derivatives: DriveDerivatives, seconds: float) -> None:
        of, self.program = derivatives, Program()
        scene, actuation = of.experiment.scene, of.actuation
        settings = of.experiment.dt, 0, np.zeros(1, dtype=np.int64), of.joints
        q = of.q.T
        self.plant = Plant(self.program, actuation, scene, of.columns, q, *settings)
        assert self.plant.driven is not None
        self.stages, self.step = self.plant.driven, of.last_step
        self.push = self.program.rows(len(of.joints.names))
        self.stages.add_torques = self._push_after(self.stages.add_torques)
        self.plant.place()
        time = self.program.constant(seconds)
        self.stages.add(time, self.plant.q, self.plant.speed, self.plant.qd, proceeds=True)
        self.segments = self.program.segments()

    def _push_after(self, own: Callable[[], None]) -> Callable[[], None]:
        """Return a function that adds the torques of the drives and the additional torques."""

        def add() -> None:
            own()
            torque = self.stages.drive_rows.torque
            self.program.add(add_torques, more=self.push, torque=torque)

        return add

    @property
    def coordinates(self) -> list[int]:
        """The rows of the coordinates of the joints."""
        return [int(self.plant.q[i]) for i in self.stages.joints.coordinates]

    def command_rows(self, columns: NDArray[np.int64]) -> list[int]:
        """Return the rows of commanded velocities."""
        return [int(self.plant.wanted[i]) for i in columns]

    def read_torques(self) -> Array:
        """Return the torques (m,) of the drives at the start."""
        return self._perform(np.zeros((0, 1)), []).first(self.stages.drive_rows.torque)

    def differentiate(
        self, inputs: list[int], outputs: list[int], step: float = STEPS[0]
    ) -> tuple[Array, Array]:
        """Return derivatives (outputs, inputs), and second differences over the step."""
        count = len(inputs)
        errors = np.concatenate([np.eye(count), -np.eye(count), np.zeros((count, 1))], axis=1)
        blocks = self._perform(step * errors, inputs)
        values = np.stack([blocks.get(row, 1)[0] for row in outputs])
        ahead, behind, rest = values[:, :count], values[:, count:-1], values[:, -1:]
        return (ahead - behind) / (2.0 * step), (ahead + behind - 2.0 * rest) / step

    def _perform(self, errors: Array, inputs: list[int]) -> Blocks:
        """Return the rows of B runs after the motion, with errors (inputs, B) of rows."""
        blocks = Blocks(self.program, np.zeros(max(errors.shape[1], 1), dtype=np.int64))
        for row, values in zip(inputs, errors, strict=True):
            blocks.put(row, blocks.get(row, 1) + values)
        for part in self.segments:
            part(blocks, self.step)
        return blocks


@dataclass(frozen=True, eq=False)
class DriveDerivatives:
    """Derivatives of driven joints about rest, at coordinates q (nq, 1) of a scene.

    Central differences of the simulated sub-steps give the map of the whole state: the coordinates
    of the m driven joints, the commanded coordinates of other joints, and every row that a drive
    keeps from one sub-step to the next. Coulomb friction and limits of torques are left out.
    Payloads are those at the end of the experiment.
    """

    experiment: Experiment
    columns: NDArray[np.int64]  # of the n commanded velocities
    q: Array
    joints: DrivenJoints

    @classmethod
    def of(cls, experiment: Experiment, columns: NDArray[np.int64], q: Array) -> Self:
        """Return the derivatives of an experiment whose actuation has a drive."""
        actuation = _keep_drive(experiment.actuation)
        joints = LinearJoints.of(experiment.scene, actuation, columns, experiment.dt)
        return cls(experiment, columns, q, joints)

    @property
    def actuation(self) -> Actuation:
        """The actuation with its drive alone."""
        return _keep_drive(self.experiment.actuation)

    @property
    def last_step(self) -> int:
        """The number of the last period of the experiment."""
        return max(int(np.floor(self.experiment.duration / self.experiment.dt)), 1)

    @cached_property
    def moved(self) -> NDArray[np.int64]:
        """Velocities of the scene that are commanded, then those that drives move beside them."""
        others = [i for i in self.joints.velocities if i not in self.columns]
        return np.array([*self.columns, *others], dtype=np.int64)

    @cached_property
    def ideal(self) -> list[int]:
        """The commanded velocities of joints without a drive."""
        return [int(i) for i in self.columns if i not in self.joints.velocities]

    @cached_property
    def inner(self) -> list[int]:
        """The rows of the inner state: rows that a command changes, and that change the motion."""
        return find_inner_state(DriveProgram(self, self.experiment.dt), self._driven_commands)

    @property
    def _driven_commands(self) -> NDArray[np.int64]:
        return np.array([i for i in self.columns if i in self.joints.velocities], dtype=np.int64)

    @property
    def output(self) -> Array:
        """The motion (moved, s) in the state."""
        driven, m = self.joints.velocities, len(self.joints.names)
        output = np.zeros((len(self.moved), m + len(self.ideal) + len(self.inner)))
        for row, column in enumerate(self.moved.tolist()):
            at = driven.index(column) if column in driven else m + self.ideal.index(column)
            output[row, at] = 1.0
        return output

    @cached_property
    def static_torques(self) -> Array:
        """Torques (m,) of the drives at rest, with the command zero and the initial integrals."""
        return DriveProgram(self, INSTANT).read_torques()

    @property
    def uncompensated_friction(self) -> Array:
        """Coulomb torques (m,) that the drives do not compensate."""
        share = np.asarray(self.joints.drive.model.friction, dtype=np.float64).reshape(-1)[0]
        result: Array = max(1.0 - float(share), 0.0) * self.true_joints.numbers("friction")
        return result

    @cached_property
    def true_joints(self) -> DrivenJoints:
        """The driven joints with friction and limits."""
        times = self.actuation, self.columns, self.experiment.dt
        return DrivenJoints.of(self.experiment.scene, *times)

    @cached_property
    def missing_torques(self) -> Array:
        """Torques (m,) of the drives at rest, minus the torques that hold the weight."""
        return self.static_torques - self.loads

    @cached_property
    def loads(self) -> Array:
        """True gravity loads (m,) at the end of the experiment."""
        from robsim.engine.static_torques import StaticTorques  # late: it compiles dynamics

        time = self.experiment.duration
        present = tuple(
            replace(load, attached=0.0, released=None)
            for load in self.joints.loads
            if load.attached <= time and (load.released is None or load.released > time)
        )
        joints = replace(self.joints, loads=present)
        return StaticTorques(joints, self.q).load[:, 0]

    def map_over(self, seconds: float) -> StateMap:
        """Return the map of the whole state over a time, at most a period."""
        if seconds not in self._maps:
            self._maps[seconds] = self._differentiate(seconds)
        return self._maps[seconds]

    @cached_property
    def _maps(self) -> dict[float, StateMap]:
        return {}

    def _differentiate(self, seconds: float) -> StateMap:
        program = DriveProgram(self, seconds)
        state = [*program.coordinates, *self.inner]
        commands = program.command_rows(self._driven_commands)
        push = [int(program.push) + i for i in range(len(self.joints.names))]
        inputs = [*state, *commands, *push]
        for step in STEPS:
            slopes, bends = program.differentiate(inputs, state, step)
            if not _is_rough(slopes, bends):
                break
        self._check_smooth(slopes, bends)
        s, n = len(state), len(commands)
        A, B, E = slopes[:, :s], slopes[:, s : s + n], slopes[:, s + n :]
        return self._add_ideal_joints(A, B, E, seconds)

    def _add_ideal_joints(self, A: Array, B: Array, E: Array, seconds: float) -> StateMap:
        """Return the map with the motions of commanded joints without a drive, before inner."""
        m, more, s, n = len(self.joints.names), len(self.ideal), len(A), len(self.columns)
        rows = [*range(m), *range(m + more, s + more)]
        whole = StateMap(np.eye(s + more), np.zeros((s + more, n)), np.zeros((s + more, m)))
        whole.of_state[np.ix_(rows, rows)] = A
        driven = [i for i, column in enumerate(self.columns) if column not in self.ideal]
        whole.of_command[np.ix_(rows, driven)] = B
        whole.of_torque[rows] = E
        for i, column in enumerate(self.ideal):
            whole.of_command[m + i, self.columns.tolist().index(column)] = seconds
        return whole

    def _check_smooth(self, slopes: Array, bends: Array) -> None:
        """Raise InputError if the motion has no derivative."""
        name = self.joints.drive.label
        if not (np.isfinite(slopes).all() and np.isfinite(bends).all()):
            raise InputError(f"advise: the torques of {name} near rest are not finite")
        if _is_rough(slopes, bends):
            raise InputError(
                f"advise: the torques of {name} have no derivative at rest (as with a dead zone), "
                "and so the loop has no linear map: simulate it"
            )


def find_inner_state(program: DriveProgram, columns: NDArray[np.int64]) -> list[int]:
    """Return the rows that commands change, and on which the later motion depends."""
    block, coordinates = program.stages.state, program.coordinates
    rows = list(range(int(block), int(block) + block.size))
    inputs = [*coordinates, *program.command_rows(columns)]
    kept: list[int] = []
    while True:
        slopes, _ = program.differentiate([*inputs, *kept], rows)
        changed = [row for row, each in zip(rows, slopes, strict=True) if each.any()]
        if set(changed) <= set(kept):
            break
        kept = sorted({*kept, *changed})
    while True:
        slopes, _ = program.differentiate(kept, [*coordinates, *kept])
        used = [row for row, each in zip(kept, slopes.T, strict=True) if each.any()]
        if len(used) == len(kept):
            return kept
        kept = used


def _is_rough(slopes: Array, bends: Array) -> bool:
    """Return whether second differences are large beside first differences."""
    return bool((np.abs(bends) > ROUGHNESS * np.abs(slopes).max(axis=0)).any())


def _keep_drive(actuation: Actuation) -> Actuation:
    """Return the actuation with its drive, sub-steps and payloads alone."""
    idle = replace(actuation, effects=()) if actuation.effects else actuation
    return replace(idle, encoder=0.0) if is_any_nonzero(idle.encoder) else idle
