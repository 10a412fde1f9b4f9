"""Evaluation of the dynamics of a robot, for arrays of the user."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robsim.base.arrays import Array, as_floats
from robsim.base.errors import InputError
from robsim.kernels.dynamics import batch_dynamics, composite_bodies, joint_drives, runge_kutta
from robsim.kernels.dynamics.body_rows import FLOATING
from robsim.kernels.machine.block_rows import BlockRows
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.program import Program
from robsim.robot.dynamics_stages import DynamicsStages
from robsim.robot.link import Link
from robsim.robot.rigid_bodies import GRAVITY, Gravity, RigidBodies
from robsim.robot.robot_weights import (
    collect_bodies,
    describe_singular_joint,
    find_singular_joint,
    sum_joint_numbers,
)
from robsim.robot.tree import Tree

MOST_PROGRAMS = 64  # in the cache of a robot
PROBES = 16  # configurations at which the mass matrix is checked


class PreparedDynamics:
    """Compiled dynamics of one quantity: a program, and the block on which it works.

    Overlapping calls from several threads work on copies of the block.
    """

    fill_positions = staticmethod(batch_dynamics.fill_positions)
    fill_dynamics = staticmethod(batch_dynamics.fill_dynamics)
    fill_motion = staticmethod(batch_dynamics.fill_motion)

    def __init__(
        self, program: Program, output: BlockRows, stages: DynamicsStages, vector: Array
    ) -> None:
        addresses, at, p, block = program.prepared()
        first = int(stages.gravity) * WIDTH
        block[first : first + 3 * WIDTH] = np.repeat(vector, WIDTH)
        self.program, self.lock = program, Lock()  # the program owns the machine code
        head = [0, 0, program.size, len(addresses), int(output)]
        self.code, self.block = np.concatenate([head, addresses, at, p]), align_block(block)
        self.code[:2] = self.code.size, self.block.ctypes.data
        self.address = self.code.ctypes.data
        self.q_shape, self.v_shape = (stages.bodies.nq,), (stages.n,)
        self.shape = output.shape

    def fill(self, kernel: Callable[..., bool], *arguments: Any) -> bool:
        """Call a kernel with the address of the code, and return its result."""
        if self.lock.acquire(False):
            try:
                return kernel(self.address, *arguments)
            finally:
                self.lock.release()
        code, block = self.code.copy(), align_block(self.block)
        code[1] = block.ctypes.data
        return kernel(code.ctypes.data, *arguments)


def align_block(values: Array) -> Array:
    """Return a copy of a block that is aligned to vector registers."""
    memory = np.empty(values.size + WIDTH)
    start = -memory.ctypes.data % (8 * WIDTH) // 8
    block = memory[start : start + values.size]
    block[:] = values
    return block


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
        self.program.add(
            joint_drives.accelerate_motors, armature=self.armature, a=self.u, torque=tau
        )
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
        joints = ((link.name, link.joint) for link in links)
        self.armature = sum_joint_numbers(joints, tree, self.bodies, "armature")
        self._programs: dict[Any, PreparedDynamics] = {}

    def prepare(self, quantity: str, gravity: Gravity, *numbers: float) -> PreparedDynamics:
        """Return the compiled dynamics of a quantity.

        A quantity is the name of a method of `DynamicsProgram`, whose arguments are `numbers`. The
        acceleration of gravity is in axes of the frame that carries the base.
        """
        vector = read_gravity(gravity)
        key = quantity, vector.tobytes(), *numbers
        prepared = self._programs.get(key)
        if prepared is None:
            prepared = self._build(quantity, vector, *numbers)
            if len(self._programs) < MOST_PROGRAMS:
                self._programs[key] = prepared
        return prepared

    def _build(self, quantity: str, gravity: Array, *numbers: float) -> PreparedDynamics:
        """Return the compiled dynamics of a quantity."""
        parts = DynamicsProgram(self.bodies, self.armature)
        add: Callable[..., BlockRows] = getattr(parts, quantity)
        output = add(*numbers)
        local = (self.base.T * gravity).sum(axis=1)
        return PreparedDynamics(parts.program, output, parts.stages, local)

    @staticmethod
    def are_valid(values: Array) -> NDArray[np.bool_]:
        """Return whether results are finite, and not marked as impossible."""
        return np.asarray(np.abs(values) <= batch_dynamics.LARGEST)

    def check_positive(self, configurations: Array) -> None:
        """Raise InputError if no mass matrix at configurations (runs, nq) is positive definite."""
        n, runs = self.bodies.n, len(configurations)
        H = np.empty((runs, n, n))
        prepared = self.prepare("add_mass_matrix", GRAVITY)
        flat = configurations.reshape(-1), H.reshape(-1)
        prepared.fill(batch_dynamics.fill_positions, runs, *flat)
        joints = [find_singular_joint(self.bodies, matrix) for matrix in H]
        if joints and all(joint is not None for joint in joints):
            raise InputError(
                describe_singular_joint(self.robot, self.links, self.tree, joints[0] or 0)
            )

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
