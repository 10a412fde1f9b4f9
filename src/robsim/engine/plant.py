"""The plant: joints that follow commands within their limits, and prescribed motions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array
from robsim.engine.chunk import Chunk
from robsim.engine.idle_joints import find_idle_coordinates, place_idle_bodies
from robsim.kernels.bodies import integration
from robsim.kernels.bodies.actuator_response import follow_commands
from robsim.kernels.control.control_law import copy_rows
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program
from robsim.robot.fk_stages import FKStages
from robsim.robot.integration_stages import (
    add_integration,
    add_python_integration,
    add_wheel_rolling,
)
from robsim.world.actuation import Actuation
from robsim.world.imperfections.joint_effect import JointEffectStage, JointRows
from robsim.world.scene import Scene

if TYPE_CHECKING:
    from robsim.engine.drive_stages import DriveStages
    from robsim.engine.driven_joints import DrivenJoints


class Plant:
    """Rows and stages of a program for the motion of a scene.

    q are the coordinates. qd are the velocities: commanded at `columns`, else prescribed. `rates`
    are the velocities of the joints, if they differ from qd. `idle` are the
    coordinates that keep their value, with their velocities, and `still` the poses of the bodies
    that only they carry.
    """

    def __init__(
        self,
        program: Program,
        actuation: Actuation,
        scene: Scene,
        columns: NDArray[np.int64],
        q0: Array,
        dt: float,
        seed: int,
        numbers: NDArray[np.int64],
        driven: DrivenJoints | None = None,
    ) -> None:
        self.program, self.actuation, self.scene, self.columns = program, actuation, scene, columns
        self.moves = has_actuation_dynamics(actuation, scene)
        self.seconds, self.seed, self.numbers = dt, np.uint64(seed), numbers
        self.start, self.q = q0, program.each(q0.T)
        self.qd, self.drift = program.rows(self.scene.nv), program.constant(self.scene.drift(0.0))
        acting = actuation.list_active()
        self.changes = any(each.effect.place is JointEffectStage.COMMANDED for each in acting)
        self.wanted = program.rows(self.scene.nv) if self.changes else self.qd
        self.speed = program.rows(self.scene.nv)  # velocities of joints with a lag
        self.rates = program.rows(self.scene.nv if self.moves else 0)
        self.dt = program.constant(dt)
        can_idle = driven is None and not self.changes
        self.idle = find_idle_coordinates(scene, columns, q0) if can_idle else {}
        self.still = place_idle_bodies(scene, self.idle.keys(), q0)
        self.placed = FKStages(program, scene.tree.joints, self.q, self.still)
        self.driven = None if driven is None else self._bind_drives(driven)

    def _bind_drives(self, driven: DrivenJoints) -> DriveStages:
        """Return the stages of the driven joints."""
        from robsim.engine.drive_stages import DriveStages  # late: few runs have drives

        return DriveStages(self, driven)

    def move(self) -> None:
        """Add the stages of a period: the joints move as commanded at the previous step."""
        self._add_integration(self.dt, self.placed, self.speed)

    def place_within_period(self, seconds: BlockRows) -> FKStages:
        """Add the stages that place all bodies at a time within the past period.

        `seconds` is the row of the time since the start of the period. Call it before `move`.
        """
        joints = self.scene.tree.joints
        placed = FKStages(self.program, joints, self._copy(self.q), self.still)
        self._add_integration(seconds, placed, self._copy(self.speed))
        placed.add()
        return placed

    def _add_integration(self, dt: BlockRows, placed: FKStages, speed: BlockRows) -> None:
        """Add the stages that integrate coordinates over a time, from velocities `speed`."""
        v = self._add_lag(dt, speed) if self.moves else self.qd
        if self.scene.tree.cars:
            self._add_steering(dt, placed, v, speed)
        joints, x = self.scene.tree.joints, placed.q
        rates: list[BlockRows | None] = list(v)
        for i in self.idle.values():
            rates[i] = None
        if self.driven is not None:
            self.driven.add(dt, x, speed, v, proceeds=x == self.q)
            for i in self.driven.columns:
                rates[i] = None
        add_integration(self.program, joints, x, rates, dt)
        add_wheel_rolling(self.program, joints, x, v, placed.ratio, dt)
        add_python_integration(self.program, joints, x, list(v), dt)

    def _copy(self, rows: BlockRows) -> BlockRows:
        """Add the stage that copies rows to new rows, and return these."""
        copy = self.program.rows(*rows.shape)
        self.program.add(copy_rows, rows=rows, to=copy)
        return copy

    def _add_steering(
        self, dt: BlockRows, placed: FKStages, v: BlockRows, speed: BlockRows
    ) -> None:
        """Steer cars once, at the start of a period, and let them move accordingly.

        The steering angle follows from the mean velocity of the whole period, even if the
        integration covers only a part of the period.
        """
        whole, add = v, self.program.add
        if dt != self.dt:
            whole = self._add_lag(self.dt, self._copy(self.speed))
        for row, velocity, s in self.scene.tree.cars:
            car = self.program.constant([s.wheelbase, s.limit, s.rate])
            angle, both = placed.q[row], slice(velocity, velocity + 2)
            add(integration.steer_car, dt=self.dt, angle=angle, v=whole[both], car=car)
            for rates in (v, speed):
                add(integration.apply_steering_angle, angle=angle, v=rates[both], wheelbase=car[0])
        placed.follow()

    def _add_lag(self, dt: BlockRows, speed: BlockRows) -> BlockRows:
        """Add the stages of joints with a lag; return the rows of their mean velocities.

        Velocities of other joints, commanded or not, are unchanged.
        """
        program, each = self.program, []
        lags = self.columns if self.actuation.moves else ()
        driven = () if self.driven is None else self.driven.columns
        mean = self._copy(self.wanted)
        for i in range(self.scene.nv):
            if i in lags:
                each.append((self.wanted[i], speed[i], mean[i]))
            elif i not in driven:
                program.add(copy_rows, rows=self.wanted[i : i + 1], to=speed[i : i + 1])
        if not each:
            return mean
        lag, *bounds = self.actuation.response(self.scene.nv)
        limits, rates = (program.numbers(each[self.columns], 1) for each in bounds)
        constants = {"lag": program.number(lag), "limits": limits, "rates": rates}
        program.add(follow_commands, dt=dt, **constants, each=each)
        return mean

    @property
    def torques(self) -> tuple[BlockRows, BlockRows] | tuple[()]:
        """The rows of the torques of drives and of their saturation; none without a drive."""
        return () if self.driven is None else (self.driven.torque, self.driven.saturation)

    def place(self) -> None:
        """Add the stages that place all bodies at q."""
        self.placed.add()

    def command(self, qd: BlockRows) -> None:
        """Add the stage of all velocities: commanded velocities from rows qd, else prescribed."""
        scene, program, commanded = self.scene, self.program, self.columns.tolist()
        rows = dict(zip(commanded, qd, strict=True))
        if scene.varies:
            program.call(self._prescribe)
        commands = [rows.get(column) for column in range(scene.nv)]
        program.add(
            integration.assemble_velocities, v=self.qd, prescribed=self.drift, commands=commands
        )
        if self.changes:
            program.add(copy_rows, rows=self.qd, to=self.wanted)
            self._add_effects(JointEffectStage.COMMANDED)
        if not self.moves:
            return
        driven = () if self.driven is None else self.driven.columns
        for i, prescribed in enumerate(scene.prescribed):
            own = self.drift if prescribed and i not in driven else self.speed
            program.add(copy_rows, rows=own[i : i + 1], to=self.rates[i : i + 1])
        for row, velocity, steering in scene.tree.cars:
            v, length = self.rates[velocity : velocity + 2], program.constant(steering.wheelbase)
            program.add(integration.apply_steering_angle, angle=self.q[row], v=v, wheelbase=length)

    def add_measured_joints(self) -> BlockRows:
        """Add the stages of the measured coordinates, and return their rows."""
        return self._add_effects(JointEffectStage.MEASURED).measured

    def _add_effects(self, place: JointEffectStage) -> JointRows:
        """Add the stages of the joint imperfections at a place, in their order."""
        rows = self.wanted, self.speed, self.q, self.q
        key = self.seconds, self.seed, self.numbers
        joints = JointRows(self.program, self.scene, self.columns, *rows, *key)
        for each in self.actuation.list_active():
            if each.effect.place is place:
                joints.stream = each.stream
                each.effect.add_stages(joints)
        return joints

    def _prescribe(self, chunk: Chunk, step: int) -> None:
        drift = self.scene.drift(step * self.seconds)[:, None]
        chunk.put(self.drift, np.repeat(drift, chunk.runs, axis=1))


def has_actuation_dynamics(actuation: Actuation, scene: Scene) -> bool:
    """Return whether joint velocities differ from commands, by a lag, limits or steering."""
    return actuation.moves or actuation.drive is not None or bool(scene.tree.cars)
