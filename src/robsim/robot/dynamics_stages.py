"""Stages of the dynamics of rigid bodies in a program."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

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
from robsim.robot.rigid_bodies import GRAVITY as GRAVITY
from robsim.robot.rigid_bodies import RigidBodies

_PLACING = {
    REVOLUTE: relative_placement.place_on_revolute,
    PRISMATIC: relative_placement.place_on_prismatic,
    FLOATING: relative_placement.place_on_floating,
}


class CarrierRows(NamedTuple):
    """Rows of a body whose motion is given."""

    body: int  # of the tree
    rotation: BlockRows  # (9,) in the world, row by row
    omega: BlockRows  # (3,) in the axes of the body
    acceleration: BlockRows  # (3,) of the origin in the axes of the body, without gravity


class DynamicsStages:
    """Rows of a program with the dynamics of bodies at joint coordinates q (nq,).

    Add `place` after q changes, and the other stages after it.

    Attributes
    ----------
    gravity : BlockRows of shape (3,)
        Acceleration of gravity in axes of the world, in m/s^2; initially (0, 0, -9.81).
    inertias : BlockRows of shape (bodies, 10)
        Moments of the bodies, see `RigidBodies`; other stages may write them.
    carriers : list of CarrierRows
        Carriers, at first without rotation and at rest.
    """

    def __init__(self, program: Program, bodies: RigidBodies, q: BlockRows) -> None:
        self.program, self.bodies, self.q, self.n = program, bodies, q, bodies.n
        self.gravity = program.constant(GRAVITY)
        self.inertias = program.numbers(bodies.inertias, 2)
        self.places = program.numbers(bodies.place, 3)
        rows = program.rows
        self.carriers = [
            CarrierRows(body, program.constant(np.eye(3).ravel()), rows(3), rows(3))
            for body in bodies.carriers
        ]
        self.ratios = program.constant([each.ratio for each in bodies.bodies])
        self.offsets = program.constant([each.offset for each in bodies.bodies])
        count = len(bodies.carriers)
        states = list(rows(count + len(bodies.bodies), ROWS))
        self.carrier_states, self.states = states[:count], states[count:]
        self.parents = [states[each.parent] for each in bodies.bodies]

    def place(self) -> None:
        """Add the stages that place bodies in their parents, after a change of q."""
        x = [self.q[body.coordinate] for body in self.bodies.bodies]
        mimicking = [i for i, body in enumerate(self.bodies.bodies) if body.mimics]
        if mimicking:
            own = self.program.rows(len(mimicking))
            each = [
                (x[i], self.ratios[i], self.offsets[i], row)
                for i, row in zip(mimicking, own, strict=True)
            ]
            self.program.add(relative_placement.follow_coordinates, each=each)
            for i, row in zip(mimicking, own, strict=True):
                x[i] = row
        for kind, stage in _PLACING.items():
            chosen = [i for i, body in enumerate(self.bodies.bodies) if body.kind == kind]
            if chosen:
                rows = [(self.places[i], x[i], self.states[i]) for i in chosen]
                self.program.add(stage, each=rows)

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
        has_mimics = self.bodies.has_mimics
        forces = self._new_body_rows() if has_mimics else self._select(tau)
        rows = [(*self._head(i), inertias[i]) for i in range(len(forces))]
        if v is None and a is None and self.bodies.carriers == (0,):  # all bodies are at rest
            rest = [(*row, force) for row, force in zip(rows, forces, strict=True)]
            self.program.add(newton_euler.compute_gravity_forces, each=rest)
        else:
            parts = zip(rows, self._spread(v), self._spread(a), forces, strict=True)
            each = [(*row, *others) for row, *others in parts]
            self.program.add(newton_euler.compute_joint_forces, each=each)
        if has_mimics:
            self._collect(forces, tau)

    def add_mass_matrix(self, H: BlockRows, inertias: BlockRows | None = None) -> None:
        """Add the stages of the mass matrix H (n, n) of the bodies, without armatures."""
        bodies, inertias = self.bodies, self.inertias if inertias is None else inertias
        own, first = H, len(bodies.carriers)
        columns = [body.velocity for body in bodies.bodies]
        if bodies.has_mimics:
            count = self._body_columns[-1]
            own, columns = self.program.rows(count, count), self._body_columns[:-1]
        each = [
            (*(body.kind, max(body.parent - first, -1), columns[i]), self.states[i], *rows)
            for i, (body, *rows) in enumerate(
                zip(bodies.bodies, self.parents, inertias, strict=True)
            )
        ]
        self.program.add(composite_bodies.compute_mass_matrix, H=own, each=each)
        if bodies.has_mimics:
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
        if self.bodies.has_mimics or self.bodies.has_floating:
            self._solve_forward(v, tau, diagonal, a)
            return
        self._move_carriers(None)
        each = []
        for i, body in enumerate(self.bodies.bodies):
            j = body.velocity
            added = None if diagonal is None else diagonal[j]
            each.append((*self._head(i), self.inertias[i], v[j], tau[j], added, a[j]))
        if each:
            self.program.add(articulated_bodies.accelerate_joints, each=each)

    def add_potential_energy(self, energy: BlockRows) -> None:
        """Add the stage of the potential energy in a single row, if the carriers do not turn."""
        each = [(*self._head(i)[1:], self.inertias[i]) for i in range(len(self.states))]
        gravity = self.gravity
        self.program.add(
            composite_bodies.compute_potential_energy, gravity=gravity, energy=energy, each=each
        )

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
        each = [
            (*carrier[1:], state)
            for carrier, state in zip(self.carriers, self.carrier_states, strict=True)
        ]
        own = self.gravity if gravity is None else gravity
        self.program.add(relative_placement.move_carriers, gravity=own, each=each)

    def _head(self, i: int) -> tuple[int, int, BlockRows, BlockRows]:
        """Return kind, whether the parent is on a joint, and rows of the parent and of a body."""
        body = self.bodies.bodies[i]
        loads = body.parent >= len(self.carriers)
        return body.kind, int(loads), self.parents[i], self.states[i]

    def _select(self, values: BlockRows) -> list[BlockRows]:
        """Return the first row of values (n,) of each body on a joint."""
        return [values[body.velocity] for body in self.bodies.bodies]

    @cached_property
    def _body_columns(self) -> list[int]:
        """First index of each body on a joint among the velocities of all bodies; their number."""
        counts = [6 if body.kind == FLOATING else 1 for body in self.bodies.bodies]
        return [0, *np.cumsum(counts).tolist()]

    def _new_body_rows(self) -> list[BlockRows]:
        """Return new rows of a number for each velocity of each body; the first of each body."""
        rows = self.program.rows(self._body_columns[-1])
        return [rows[k] for k in self._body_columns[:-1]]

    def _list_velocity_rows(self) -> list[tuple[int, BlockRows, int]]:
        """Return index, row of the ratio, and column of each velocity of each body."""
        table = []
        for i, body in enumerate(self.bodies.bodies):
            first, end = self._body_columns[i : i + 2]
            numbers = range(end - first)
            table += [(first + c, self.ratios[i], body.velocity + c) for c in numbers]
        return table

    def _spread(self, values: BlockRows | None) -> Sequence[BlockRows | None]:
        """Return the first row of each body of velocities or accelerations (n,)."""
        if values is None:
            return [None] * len(self.bodies.bodies)
        if not self.bodies.has_mimics:
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
