"""Oracle: poses and Jacobians of DH arms, and steps of a free-flying body, by Pinocchio.

Program: Pinocchio (`pip install pin`); the version used is in "made_by" of each file.
Run:     python tests/oracles/generate_pinocchio.py
Writes:  pinocchio_dh.json and pinocchio_freeflyer.json, always the same numbers.

Units are metres and radians. Conventions:
- standard DH: T = Rz(theta) Tz(d) Tx(a) Rx(alpha);
  modified (Craig): T = Rx(alpha) Tx(a) Rz(theta) Tz(d);
- a row is (theta, d, a, alpha); the coordinate of an R joint is added to theta, of a P joint to d;
- a pose is the pose of the link frame in the base frame, a 4x4 matrix;
- a Jacobian has rows (v, omega): velocity of the origin of the link frame and angular velocity,
  both in base axes (Pinocchio's LOCAL_WORLD_ALIGNED);
- a free-flyer's q is (x, y, z, qx, qy, qz, qw), its twist V is (v, omega) in body axes.

Every joint is one of Pinocchio's own (JointModelRZ, JointModelPZ) and every link frame a frame
that hangs from it: all poses and Jacobians below are computed by Pinocchio.

Poses and Jacobians are good to a few 1e-16. The free-flyer's positions are good to 1e-13 only: at
angles of 1e-4 to 1e-2 rad Pinocchio loses digits (5e-14 seen against 80-digit arithmetic).
"""

import numpy as np
import pinocchio as pin
from _store import store

MADE_BY = f"Pinocchio {pin.__version__}"
PI = np.pi


def rhino_xr4():
    """Rhino XR-4: the published table of the XR-3 (Schilling, Fundamentals of Robotics)."""
    d = [0.2604, 0, 0, 0, 0.1683]
    a = [0, 0.2286, 0.2286, 0.0095, 0]
    return "standard", "RRRRR", rows(d=d, a=a, alpha=[-PI / 2, 0, 0, -PI / 2, 0])


def puma560():
    """Puma 560 with its base frame on the floor."""
    d = [0.67183, 0, 0.15005, 0.4318, 0, 0]
    a = [0, 0.4318, 0.0203, 0, 0, 0]
    return "standard", "RRRRRR", rows(d=d, a=a, alpha=[PI / 2, 0, -PI / 2, PI / 2, -PI / 2, 0])


def planar_2r():
    """Two revolute joints in a plane, links of one metre."""
    return "standard", "RR", rows(d=[0, 0], a=[1, 1], alpha=[0, 0])


def panda_like():
    """A 7R arm with the proportions of the Franka Panda, in modified DH."""
    d = [0.333, 0, 0.316, 0, 0.384, 0, 0]
    a = [0, 0, 0, 0.0825, -0.0825, 0, 0.088]
    alpha = [0, -PI / 2, PI / 2, PI / 2, -PI / 2, PI / 2, PI / 2]
    return "modified", "RRRRRRR", rows(d=d, a=a, alpha=alpha)


def mixed_rprrp():
    """Revolute and prismatic joints with random constants in every column."""
    rng = np.random.default_rng(5)
    theta, alpha = rng.uniform(-PI, PI, (2, 5))
    d, a = rng.uniform(-0.5, 0.5, (2, 5))
    return "standard", "RPRRP", rows(d=d, a=a, alpha=alpha, theta=theta)


def rows(d, a, alpha, theta=None):
    """Columns to rows (theta, d, a, alpha)."""
    theta = np.zeros(len(d)) if theta is None else theta
    return [[float(x) for x in row] for row in zip(theta, d, a, alpha, strict=True)]


def turn(axis, angle):
    """Rotation about a coordinate axis."""
    return pin.SE3(pin.utils.rotate(axis, angle), np.zeros(3))


def shift(x, z):
    """Translation in the plane of x and z."""
    return pin.SE3(np.eye(3), np.array([x, 0.0, z]))


def place_and_tail(convention, row):
    """The constants before and after a joint's motion: T = place * motion(q) * tail.

    The motion is about or along z, so it commutes with Rz(theta) and Tz(d) of its own row.
    """
    theta, d, a, alpha = row
    along_z = turn("z", theta) * shift(0, d)
    if convention == "standard":
        return pin.SE3.Identity(), along_z * shift(a, 0) * turn("x", alpha)
    return turn("x", alpha) * shift(a, 0), along_z


def build(convention, joints, table):
    """A Pinocchio model made joint by joint, and the ids of its link frames."""
    model, parent, tail, frames = pin.Model(), 0, pin.SE3.Identity(), []
    for k, (kind, row) in enumerate(zip(joints, table, strict=True), start=1):
        place, next_tail = place_and_tail(convention, row)
        joint = pin.JointModelRZ() if kind == "R" else pin.JointModelPZ()
        parent = model.addJoint(parent, joint, tail * place, f"joint_{k}")
        tail = next_tail
        frame = pin.Frame(f"link_{k}", parent, tail, pin.FrameType.OP_FRAME)
        frames.append(model.addFrame(frame))
    return model, frames


def configurations(name, joints, rng):
    """q = 0, the Rhino's home, then random ones: ten in all."""
    first = [np.zeros(len(joints))]
    if name == "rhino_xr4":
        first.append(np.radians([0, -90, 90, 0, -90]))
    low = np.where(np.array(list(joints)) == "R", -PI, -0.5)
    return first + [rng.uniform(low, -low) for _ in range(10 - len(first))]


def arm_case(model, frames, middle, q):
    """Poses of all links and the Jacobians of the last and of the middle one."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    poses = [data.oMf[f].homogeneous.tolist() for f in frames]

    def jacobian(frame):
        return pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED).tolist()

    return {
        "q": q.tolist(),
        "poses": poses,
        "jacobian_last": jacobian(frames[-1]),
        "jacobian_middle": jacobian(frames[middle - 1]),
    }


def arm(name, convention, joints, table, rng):
    """Everything stored about one arm; links are counted from 1, as joints are."""
    model, frames = build(convention, joints, table)
    middle = (len(joints) + 1) // 2
    cases = [arm_case(model, frames, middle, q) for q in configurations(name, joints, rng)]
    return {
        "name": name,
        "convention": convention,
        "joints": joints,
        "rows": table,
        "middle_link": middle,
        "cases": cases,
    }


def write_arms():
    """pinocchio_dh.json."""
    rng = np.random.default_rng(1)
    makers = [rhino_xr4, puma560, planar_2r, panda_like, mixed_rprrp]
    about = (
        "rows (theta, d, a, alpha) in m and rad; poses[k] is the 4x4 pose of link k + 1 in the "
        "base; jacobian_last and jacobian_middle (6 x n) are those of the last link and of link "
        "middle_link (counted from 1): rows (v, omega) of the link origin in base axes"
    )
    arms = [arm(make.__name__, *make(), rng) for make in makers]
    store("pinocchio_dh.json", {"made_by": MADE_BY, "about": about, "robots": arms})


def free_flyer_case(model, angle, rng, moving=True):
    """One step of a free body that turns by `angle` and shifts by up to a metre."""
    position, quaternion = rng.uniform(-2, 2, 3), unit(rng, 4)
    dt = rng.uniform(0.001, 0.1)
    v = unit(rng, 3) * rng.uniform(0.1, 1) / dt if moving else np.zeros(3)
    q = np.concatenate([position, quaternion])
    twist = np.concatenate([v, unit(rng, 3) * angle / dt])
    q_next = pin.integrate(model, q, twist * dt)
    return {"q": q.tolist(), "V": twist.tolist(), "dt": dt, "q_next": q_next.tolist()}


def unit(rng, n):
    """A random direction in n dimensions."""
    x = rng.normal(size=n)
    return x / np.linalg.norm(x)


def write_free_flyer():
    """pinocchio_freeflyer.json: 40 angles from 1e-12 to 3.1 rad, then no rotation, then rest."""
    rng = np.random.default_rng(2)
    model = pin.Model()
    model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "free")
    cases = [free_flyer_case(model, angle, rng) for angle in np.geomspace(1e-12, 3.1, 40)]
    cases += [free_flyer_case(model, 0.0, rng), free_flyer_case(model, 0.0, rng, moving=False)]
    about = (
        "q_next = pin.integrate(model, q, V * dt); q is (x, y, z, qx, qy, qz, qw), V is (v, omega) "
        "in body axes, SI units; a quaternion and its negative are the same rotation"
    )
    store("pinocchio_freeflyer.json", {"made_by": MADE_BY, "about": about, "cases": cases})


if __name__ == "__main__":
    write_arms()
    write_free_flyer()
