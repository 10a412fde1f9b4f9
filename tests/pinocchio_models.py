"""Models of Pinocchio with the joints and inertias of a robot without mimics."""

import numpy as np
import pinocchio as pin

KINDS = {
    "revolute": pin.JointModelRZ,
    "prismatic": pin.JointModelPZ,
    "floating": pin.JointModelFreeFlyer,
}


class PinocchioDynamics:
    """Dynamics of a robot by Pinocchio, in the order of the robot's velocities."""

    def __init__(self, robot):
        self.robot, self.model = robot, pin.Model()
        self.where = {robot.links[0].name: (0, pin.SE3.Identity())}
        children = {}
        for link in robot.links[1:]:
            children.setdefault(link.parent, []).append(link)
        self._add_children(children, robot.links[0].name)
        self.data = self.model.createData()
        moving = [link for link in robot.links if link.joint.moves]
        joints = [self.model.joints[self.model.getJointId(link.name)] for link in moving]
        self.q_index = np.concatenate([range(j.idx_q, j.idx_q + j.nq) for j in joints]).astype(int)
        self.v_index = np.concatenate([range(j.idx_v, j.idx_v + j.nv) for j in joints]).astype(int)
        self.model.armature[self.v_index] = np.concatenate(
            [[link.joint.armature] * len(link.joint.parts.velocities) for link in moving]
        )

    def _add_children(self, children, parent):
        for link in children.get(parent, ()):
            self._add(link)
            self._add_children(children, link.name)

    def _add(self, link):
        number, offset = self.where[link.parent]
        place, tail = (
            pin.SE3(np.array(pose.matrix)) for pose in (link.joint.place, link.joint.tail)
        )
        if link.joint.moves:
            model = KINDS[link.joint.kind]()
            number = self.model.addJoint(number, model, offset * place, link.name)
            self.where[link.name] = number, tail
        else:
            self.where[link.name] = number, offset * place * tail
        weight = link.inertial
        if weight is not None and number:
            inertia = pin.Inertia(weight.mass, np.array(weight.centre), np.array(weight.tensor))
            self.model.appendBodyToJoint(number, inertia, self.where[link.name][1])

    def evaluate(self, q, v, a, tau):
        """Return all quantities for single vectors, by name."""
        Q, V, A, T = np.zeros(self.model.nq), *np.zeros((3, self.model.nv))
        Q[self.q_index], V[self.v_index], A[self.v_index], T[self.v_index] = q, v, a, tau
        model, data, own = self.model, self.data, self.v_index
        M = pin.crba(model, data, Q)
        M = np.triu(M) + np.triu(M, 1).T
        return {
            "inverse_dynamics": pin.rnea(model, data, Q, V, A)[own].copy(),
            "gravity": pin.computeGeneralizedGravity(model, data, Q)[own].copy(),
            "mass_matrix": M[np.ix_(own, own)],
            "forward_dynamics": pin.aba(model, data, Q, V, T)[own].copy(),
            "kinetic_energy": pin.computeKineticEnergy(model, data, Q, V),
            "potential_energy": pin.computePotentialEnergy(model, data, Q),
        }
