"""Evaluation of the dynamics of a robot, for arrays of the user."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from robsim.base.arrays import Array, as_floats
from robsim.base.errors import InputError
from robsim.kernels.dynamics import batch_dynamics, composite_bodies, runge_kutta
from robsim.kernels.dynamics.body_rows import FLOATING
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.program import Program
from robsim.robot.dynamics_stages import GRAVITY, DynamicsStages
from robsim.robot.link import Link
from robsim.robot.rigid_bodies import RigidBodies
from robsim.robot.robot_weights import check_mass_matrices, collect_bodies, sum_armatures
from robsim.robot.tree import Tree

Gravity = Sequence[float] | Array
PROBES = 16  # configurations at which the mass matrix is checked


class DynamicsProgram:
    """Program with the dynamics of a robot; its first rows are inputs, followed by constants."""

    def __init__(self, bodies: RigidBodies, armature: Array) -> None:
        self.program = Program()
        self.q, self.v = self.program.rows(bodies.nq), self.program.rows(bodies.n)
        self.u = self.program.rows(bodies.n)  # accelerations or forces
        self.armature = self.program.constant(armature)
        self.stages = DynamicsStages(self.program, bodies, self.q)

    def add_mass_matrix(self) -> BlockRows:
        """Add the mass matrix with armatures."""
        H = self.program.rows(self.stages.n, self.stages.n)
        self.stages.place()
        self.stages.add_mass_matrix(H)
        self.program.add(composite_bodies.add_to_diagonal, diagonal=self.armature, H=H)
        return H

    def add_gravity(self) -> BlockRows:
        """Add the gravity load."""
        tau = self.program.rows(self.stages.n)
        self.stages.place()
        self.stages.add_inverse(None, None, tau)
        return tau

    def add_inverse(self) -> BlockRows:
        """Add the forces of a motion."""
        tau = self.program.rows(self.stages.n)
        self.stages.place()
        self.stages.add_inverse(self.v, self.u, tau)
        self.program.add(composite_bodies.add_scaled, factor=self.armature, x=self.u, y=tau)
        return tau

    def add_forward(self) -> BlockRows:
        """Add the accelerations under forces."""
        a = self.program.rows(self.stages.n)
        self.stages.place()
        self.stages.add_forward(self.v, self.u, self.armature, a)
        return a

    def add_potential_energy(self) -> BlockRows:
        """Add the potential energy."""
        energy = self.program.rows()
        self.stages.place()
        self.stages.add_potential_energy(energy)
        return energy

    def add_kinetic_energy(self) -> BlockRows:
        """Add the kinetic energy."""
        H, energy = self.program.rows(self.stages.n, self.stages.n), self.program.rows()
        self.stages.place()
        self.stages.add_mass_matrix(H)
        rows = {"H": H, "armature": self.armature, "v": self.v, "energy": energy}
        self.program.add(composite_bodies.compute_kinetic_energy, **rows)
        return energy

    def add_runge_kutta(self, step: float) -> BlockRows:
        """Add a step of the Runge-Kutta method of order 4; q and v are the state."""
        program, nq, n = self.program, self.stages.bodies.nq, self.stages.n
        h = program.constant(step)
        x = BlockRows(self.q, (nq + n,))
        slope, start, total = program.rows(nq + n), program.rows(nq + n), program.rows(nq + n)
        program.add(runge_kutta.begin_step, x=x, start=start, total=total)
        single, floating = self._list_rates(slope[:nq])
        for number in range(4):
            self.stages.place()
            self.stages.add_forward(self.v, self.u, self.armature, slope[nq:])
            program.add(runge_kutta.compute_coordinate_rates, single=single, floating=floating)
            rows = {"slope": slope, "start": start, "x": x, "total": total, "h": h}
            program.add(runge_kutta.advance_state, number=number, **rows)
        if floating:
            each = [q for q, _, _ in floating]
            program.add(runge_kutta.normalize_quaternions, each=[(q,) for q in each])
        return x

    def _list_rates(self, rates: BlockRows) -> tuple[list[Any], list[Any]]:
        """Return the rows of the rates of single coordinates, and of floating joints."""
        single, floating = [], []
        for body in self.stages.bodies.bodies:
            q, v = body.coordinate, body.velocity
            if body.mimics:
                continue
            if body.kind == FLOATING:
                floating.append((self.q[q : q + 7], self.v[v : v + 6], rates[q : q + 7]))
            else:
                single.append((self.v[v], rates[q]))
        return single, floating


class DynamicsEvaluator:
    """Compiled dynamics of a robot.

    Attributes
    ----------
    robot : str
        Name of the robot in messages, with its file.
    bodies : RigidBodies
        Bodies of the robot.
    armature : ndarray of shape (nv,)
        Inertias of rotors.
    """

    def __init__(self, robot: str, links: Sequence[Link], tree: Tree, base: Array) -> None:
        self.robot, self.links, self.tree, self.base = robot, links, tree, base
        self.bodies = collect_bodies(robot, links, tree)
        self.armature = sum_armatures(links, tree, self.bodies)
        self._programs: dict[Any, tuple[Any, ...]] = {}

    def prepare(self, quantity: str, gravity: Gravity, *numbers: float) -> tuple[Any, ...]:
        """Return the first arguments of the kernel that evaluates a quantity.

        A quantity is the name of a method of `DynamicsProgram`, whose arguments are `numbers`. The
        acceleration of gravity is in axes of the frame that carries the base.
        """
        usual = gravity is GRAVITY
        key = quantity, None if usual else tuple(np.ravel(gravity).tolist()), *numbers
        arguments = self._programs.get(key)
        if arguments is None:
            arguments = self._build(quantity, read_gravity(gravity), *numbers)
            if usual or len(self._programs) < 64:
                self._programs[key] = arguments
        return arguments

    def _build(self, quantity: str, gravity: Array, *numbers: float) -> tuple[Any, ...]:
        """Return addresses, offsets and numbers of stages, constants, number of rows and output."""
        parts = DynamicsProgram(self.bodies, self.armature)
        add: Callable[..., BlockRows] = getattr(parts, quantity)
        output = add(*numbers)
        addresses, at, p, block = parts.program.prepared()
        first = int(parts.stages.gravity) * WIDTH
        local = (self.base.T * gravity).sum(axis=1)
        block[first : first + 3 * WIDTH] = np.repeat(local, WIDTH)
        used = max(int(rows) + values.size for rows, values in parts.program.same)
        constants = np.ascontiguousarray(block[: used * WIDTH])
        # a program has addresses of tables only while it lives
        return addresses, at, p, constants, parts.program.size, int(output), parts.program

    def check_positive(self, configurations: Array) -> None:
        """Raise InputError unless the mass matrix is positive definite at configurations."""
        n, runs = self.bodies.n, len(configurations)
        H = np.empty((runs, n, n))
        none = np.empty(0)
        arguments = self.prepare("add_mass_matrix", GRAVITY)[:6]
        batch_dynamics.fill_dynamics(
            *arguments, runs, configurations.reshape(-1), none, none, H.reshape(-1)
        )
        check_mass_matrices(self.robot, self.links, self.tree, self.bodies, H)

    @cached_property
    def probes(self) -> Array:
        """Deviations (PROBES, nv) of configurations for `check_positive`, the first is zero."""
        draws = np.random.Generator(np.random.PCG64(0)).uniform(-3.0, 3.0, (PROBES, self.tree.nv))
        draws[0] = 0.0
        return draws


def read_gravity(gravity: Gravity) -> Array:
    """Return an acceleration of gravity as an array (3,); InputError for another shape."""
    vector = as_floats(gravity, "gravity", (3,))
    if vector.ndim != 1:
        raise InputError(f"gravity: expected three numbers in m/s^2, got shape {vector.shape}")
    return vector
