"""Stages of the dynamics of rigid bodies in a program."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from robsim.kernels.dynamics import (
    articulated_bodies,
    composite_bodies,
    newton_euler,
    relative_placement,
)
from robsim.kernels.dynamics.body_rows import FLOATING, PRISMATIC, REVOLUTE, ROWS
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.program import Program
from robsim.robot.rigid_bodies import RigidBodies

STANDARD_GRAVITY = (0.0, 0.0, -9.81)  # m/s^2, z upwards
_PLACING = {
    REVOLUTE: relative_placement.place_on_revolute,
    PRISMATIC: relative_placement.place_on_prismatic,
    FLOATING: relative_placement.place_on_floating,
}


class DynamicsStages:
    """Rows of a program with the dynamics of bodies at joint coordinates q (nq,).

    Add `place` after q changes, and the other stages after it.

    Attributes
    ----------
    gravity : BlockRows of shape (3,)
        Acceleration of gravity in axes of the world, in m/s^2; initially (0, 0, -9.81).
    inertias : BlockRows of shape (bodies, 10)
        Moments of the bodies, see `RigidBodies`; other stages may write them.
    rotations : BlockRows of shape (carriers, 3, 3)
        Rotations of the carriers in the world. The plant writes them, except for the world.
    turning : BlockRows of shape (carriers, 3)
        Angular velocities of the carriers, in their own axes, in rad/s.
    accelerations : BlockRows of shape (carriers, 3)
        Accelerations of the origins of the carriers, in their own axes, in m/s^2.
    """

    def __init__(self, program: Program, bodies: RigidBodies, q: BlockRows) -> None:
        self.program, self.bodies, self.q = program, bodies, q
        carriers, self.n = len(bodies.carriers), bodies.n
        self.gravity = program.constant(STANDARD_GRAVITY)
        self.inertias = program.numbers(bodies.inertias, 2)
        self.places = program.numbers(bodies.places, 3)
        self.rotations = program.constant(np.tile(np.eye(3), (carriers, 1, 1)))
        self.turning, self.accelerations = program.rows(carriers, 3), program.rows(carriers, 3)
        self.rows = program.rows(len(bodies.bodies), ROWS)

    @cached_property
    def _ratios(self) -> BlockRows:
        """Rows of the ratios of the bodies on joints."""
        return self.program.constant([self.bodies.bodies[i].ratio for i in self.bodies.jointed])

    def place(self) -> None:
        """Add the stages that place bodies in their parents, after a change of q."""
        coordinates, mimicking = [], []
        for i in self.bodies.jointed:
            body, x = self.bodies.bodies[i], self.q[self.bodies.bodies[i].coordinate]
            if body.mimics:
                source, x = x, self.program.rows()
                ratio, offset = (
                    self.program.constant(body.ratio),
                    self.program.constant(body.offset),
                )
                mimicking.append((source, ratio, offset, x))
            coordinates.append(x)
        if mimicking:
            self.program.add(relative_placement.follow_coordinates, each=mimicking)
        for kind, stage in _PLACING.items():
            each = [
                (self.places[i], x, self.rows[i])
                for i, x in zip(self.bodies.jointed, coordinates, strict=True)
                if self.bodies.bodies[i].kind == kind
            ]
            if each:
                self.program.add(stage, each=each)

    def add_inverse(
        self,
        v: BlockRows | None,
        a: BlockRows | None,
        tau: BlockRows,
        inertias: BlockRows | None = None,
        gravity: BlockRows | None = None,
    ) -> None:
        """Add the stages of the forces tau (n,) for velocities v (n,) and accelerations a (n,).

        None for v or a means zero. `inertias` and `gravity` replace the rows with these names.
        """
        self._move_carriers(gravity)
        inertias = self.inertias if inertias is None else inertias
        speeds, rates = self._spread(v), self._spread(a)
        forces = self._select(tau) if not self.bodies.mimics else self._new_body_rows()
        each = [
            (*self._head(i), self.rows[i], inertias[i], speed, rate, force)
            for i, speed, rate, force in zip(
                self.bodies.jointed, speeds, rates, forces, strict=True
            )
        ]
        if each:
            self.program.add(newton_euler.compute_joint_forces, each=each)
        if self.bodies.mimics:
            self._collect(forces, tau)

    def add_mass_matrix(self, H: BlockRows, inertias: BlockRows | None = None) -> None:
        """Add the stages of the mass matrix H (n, n) of the bodies, without armatures."""
        bodies, inertias = self.bodies, self.inertias if inertias is None else inertias
        first, columns = len(bodies.carriers), self._body_columns
        own = self.program.rows(columns[-1], columns[-1]) if bodies.mimics else H
        each = []
        for k, i in enumerate(bodies.jointed):
            body = bodies.bodies[i]
            column = columns[k] if bodies.mimics else body.velocity
            above = max(body.parent - first, -1)
            rows = self.rows[i], self.rows[body.parent], inertias[i]
            each.append((body.kind, above, column, *rows))
        self.program.add(composite_bodies.compute_mass_matrix, H=own, each=each)
        if bodies.mimics:
            table = [(ratio, column) for _, ratio, column in self._list_velocity_rows()]
            self.program.add(composite_bodies.merge_mimicking_joints, bodies=own, H=H, each=table)

    def add_forward(
        self, v: BlockRows, tau: BlockRows, diagonal: BlockRows | None, a: BlockRows
    ) -> None:
        """Add the stages of the accelerations a (n,) under the forces tau (n,).

        `diagonal` (n,) is added to the mass matrix: the armature of each joint, and with implicit
        integration the slopes of the forces times the step. Floating and mimicking joints are
        solved with the mass matrix, other joints with articulated bodies.
        """
        if self.bodies.mimics or self.bodies.floats:
            self._solve_forward(v, tau, diagonal, a)
            return
        self._move_carriers(None)
        each = []
        for i in self.bodies.jointed:
            j = self.bodies.bodies[i].velocity
            added = None if diagonal is None else diagonal[j]
            rows = self.rows[i], self.inertias[i], v[j], tau[j], added, a[j]
            each.append((*self._head(i), *rows))
        if each:
            self.program.add(articulated_bodies.accelerate_joints, each=each)

    def _solve_forward(
        self, v: BlockRows, tau: BlockRows, diagonal: BlockRows | None, a: BlockRows
    ) -> None:
        """Add the stages that solve for accelerations with the mass matrix."""
        n, rows = self.n, self.program.rows
        H, L, bias = rows(n, n), rows(n, n), rows(n)
        self.add_inverse(v, None, bias)
        self.add_mass_matrix(H)
        results = {"L": L, "a": a}
        self.program.add(
            composite_bodies.solve_mass_matrix,
            H=H,
            tau=tau,
            bias=bias,
            diagonal=diagonal,
            **results,
        )

    def _move_carriers(self, gravity: BlockRows | None) -> None:
        """Add the stage of the motion of the carriers."""
        count = len(self.bodies.carriers)
        each = [
            (self.rotations[i], self.turning[i], self.accelerations[i], self.rows[i])
            for i in range(count)
        ]
        own = self.gravity if gravity is None else gravity
        self.program.add(relative_placement.move_carriers, gravity=own, each=each)

    def _head(self, i: int) -> tuple[int, int, BlockRows]:
        """Return kind, whether the parent is on a joint, and rows of the parent of a body."""
        body = self.bodies.bodies[i]
        loads = body.parent >= len(self.bodies.carriers)
        return body.kind, int(loads), self.rows[body.parent]

    def _select(self, values: BlockRows) -> list[BlockRows]:
        """Return the first row of values (n,) of each body on a joint."""
        bodies = self.bodies
        return [values[bodies.bodies[i].velocity] for i in bodies.jointed]

    @cached_property
    def _body_columns(self) -> list[int]:
        """First index of each body on a joint among the velocities of all bodies; their number."""
        counts = [6 if self.bodies.bodies[i].kind == FLOATING else 1 for i in self.bodies.jointed]
        return [0, *np.cumsum(counts).tolist()]

    def _new_body_rows(self) -> list[BlockRows]:
        """Return new rows of a number for each velocity of each body; the first of each body."""
        rows = self.program.rows(self._body_columns[-1])
        return [rows[k] for k in self._body_columns[:-1]]

    def _list_velocity_rows(self) -> list[tuple[int, BlockRows, int]]:
        """Return index, row of the ratio, and column of each velocity of each body."""
        table = []
        for k, i in enumerate(self.bodies.jointed):
            body, first = self.bodies.bodies[i], self._body_columns[k]
            count = self._body_columns[k + 1] - first
            table += [(first + c, self._ratios[k], body.velocity + c) for c in range(count)]
        return table

    def _spread(self, values: BlockRows | None) -> Sequence[BlockRows | None]:
        """Return the first row of each body of velocities or accelerations (n,)."""
        if values is None:
            return [None] * len(self.bodies.jointed)
        if not self.bodies.mimics:
            return self._select(values)
        rows = self._new_body_rows()
        each = [
            (values[column], ratio, BlockRows(rows[0] + k))
            for k, ratio, column in self._list_velocity_rows()
        ]
        self.program.add(relative_placement.follow_rates, each=each)
        return rows

    def _collect(self, forces: Sequence[BlockRows], tau: BlockRows) -> None:
        """Add the stage that adds the forces of the bodies to those of the velocities."""
        each = [
            (BlockRows(forces[0] + k), ratio, column)
            for k, ratio, column in self._list_velocity_rows()
        ]
        self.program.add(relative_placement.collect_forces, tau=tau, each=each)
