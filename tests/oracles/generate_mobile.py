"""Oracle: trees with planar joints and unicycles by Pinocchio, held velocities by mpmath.

Program: Pinocchio (`pip install pin`) and mpmath; the versions are in "made_by" of each file.
Run:     python tests/oracles/generate_mobile.py
Writes:  pinocchio_mobile.json and arcs_mpmath.json, always the same numbers.

Units are metres and radians. Conventions:
- a link hangs from its parent by place . motion(q) . tail;
- the coordinates of a planar joint and of a unicycle are (x, y, theta); its velocities are
  (vx, vy, omega), or (v, omega), in the axes of the body that moves. Both are Pinocchio's
  JointModelPlanar, with q = (x, y, cos theta, sin theta); a unicycle leaves out the column of vy;
- a pose is the pose of the link frame in the base frame, a 4x4 matrix;
- a Jacobian has rows (v, omega): velocity of the origin of the link frame and angular velocity,
  both in base axes (Pinocchio's LOCAL_WORLD_ALIGNED).

The robots are built from the published constants, not from the files of the robot library.
"""

import mpmath as mp
import numpy as np
import pinocchio as pin
from _store import store
from generate_pinocchio import MADE_BY, PI, place_and_tail, rows, turn

NOTHING = pin.SE3.Identity()
MODELS = {
    "revolute": pin.JointModelRZ,
    "prismatic": pin.JointModelPZ,
    "planar": pin.JointModelPlanar,
    "unicycle": pin.JointModelPlanar,
}
FORWARD = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], dtype=float)  # of a camera: z along x


def at(x, y, z, R=None):
    """A pose at (x, y, z)."""
    return pin.SE3(np.eye(3) if R is None else R, np.array([x, y, z], dtype=float))


def tree():
    """Planar joints and a unicycle at random places, one on another, with arms between them."""
    rng = np.random.default_rng(7)
    plan = [
        ("deck", "base", "planar"),
        ("arm", "deck", "revolute"),
        ("cart", "arm", "planar"),
        ("slide", "cart", "prismatic"),
        ("rover", "deck", "unicycle"),
        ("mast", "rover", "revolute"),
    ]
    return [(*row, pin.exp6(rng.normal(size=6)), pin.exp6(rng.normal(size=6))) for row in plan]


def chain(parent, convention, names, kinds, table):
    """Links of a DH table, one behind the other."""
    links = []
    for name, kind, row in zip(names, kinds, table, strict=True):
        place, tail = place_and_tail(convention, row)
        if kind == "fixed":
            place, tail = place * tail, NOTHING
        links.append((name, parent, kind, place, tail))
        parent = name
    return links


def panda():
    """Franka Emika Panda: the table of the Franka Control Interface documentation."""
    d = [0.333, 0, 0.316, 0, 0.384, 0, 0, 0.107]
    a = [0, 0, 0, 0.0825, -0.0825, 0, 0.088, 0]
    alpha = [0, -PI / 2, PI / 2, PI / 2, -PI / 2, PI / 2, PI / 2, 0]
    names = [*(f"link{i}" for i in range(1, 8)), "flange"]
    return chain("base", "modified", names, ["revolute"] * 7 + ["fixed"], rows(d, a, alpha))


def mobile_arm():
    """A Puma of 0.7 times its size on a base that moves in the plane."""
    d, a = [0.2, 0, 0.105, 0.3, 0, 0.08], [0, 0.3, 0.014, 0, 0, 0]
    table = rows(d, a, alpha=[PI / 2, 0, -PI / 2, PI / 2, -PI / 2, 0])
    names = ["shoulder", "upper_arm", "forearm", "wrist_roll", "wrist_bend", "flange"]
    body = ("body", "base", "planar", NOTHING, NOTHING)
    plate = ("arm_base", "body", "fixed", at(0.12, 0, 0.26), NOTHING)
    return [body, plate, *chain("arm_base", "standard", names, ["revolute"] * 6, table)]


def holonomic_base():
    """A planar joint and a camera that looks forward."""
    mount = at(0.27, 0, 0.46, FORWARD)
    return [
        ("body", "base", "planar", NOTHING, NOTHING),
        ("camera_mount", "body", "fixed", mount, NOTHING),
    ]


def unicycle():
    """A unicycle and a camera that looks forward."""
    mount = at(0.14, 0, 0.38, FORWARD)
    return [
        ("body", "base", "unicycle", NOTHING, NOTHING),
        ("camera_mount", "body", "fixed", mount, NOTHING),
    ]


def pan_tilt():
    """Pan about the vertical, then tilt about the y axis, backward: positive looks up."""
    tilt = turn("x", PI / 2)
    return [
        ("pan", "base", "revolute", at(0, 0, 0.25), NOTHING),
        ("head", "pan", "revolute", tilt, tilt.inverse() * at(0, 0, 0, FORWARD)),
    ]


def build(links):
    """A Pinocchio model, the joint and the frame of each link."""
    model, on = pin.Model(), {"base": (0, NOTHING)}
    for name, parent, kind, place, tail in links:
        joint, offset = on[parent]
        if kind == "fixed":
            on[name] = joint, offset * place * tail
        else:
            on[name] = model.addJoint(joint, MODELS[kind](), offset * place, name), tail
    frames = {
        name: model.addFrame(pin.Frame(f"frame of {name}", *where, pin.FrameType.OP_FRAME))
        for name, where in on.items()
    }
    return model, frames


def in_plane(kind):
    """Whether a joint has the coordinates (x, y, theta)."""
    return kind in ("planar", "unicycle")


def case(model, frames, links, q):
    """Poses of all links and the Jacobian of each; q in our form."""
    theirs, columns, rest = np.zeros(model.nq), [], list(q)
    for name, _, kind, _, _ in links:
        if kind == "fixed":
            continue
        joint = model.joints[model.getJointId(name)]
        mine = [rest.pop(0) for _ in range(3 if in_plane(kind) else 1)]
        if in_plane(kind):
            mine = [*mine[:2], np.cos(mine[2]), np.sin(mine[2])]
        theirs[joint.idx_q : joint.idx_q + joint.nq] = mine
        kept = [0, 2] if kind == "unicycle" else range(joint.nv)
        columns += [joint.idx_v + i for i in kept]
    data = model.createData()
    pin.framesForwardKinematics(model, data, theirs)
    made = {"q": list(map(float, q)), "poses": [], "jacobians": []}
    for name, *_ in links:
        made["poses"].append(data.oMf[frames[name]].homogeneous.tolist())
        J = pin.computeFrameJacobian(model, data, theirs, frames[name], pin.LOCAL_WORLD_ALIGNED)
        made["jacobians"].append(J[:, columns].tolist())
    return made


def robot(maker, home, rng):
    """Everything stored about one robot: at home, then eight random configurations."""
    links = maker()
    model, frames = build(links)
    random = [rng.uniform(-2, 2, len(home)) for _ in range(8)]
    return {
        "name": maker.__name__,
        "links": [
            {
                "name": name,
                "parent": parent,
                "kind": kind,
                "place": place.homogeneous.tolist(),
                "tail": tail.homogeneous.tolist(),
            }
            for name, parent, kind, place, tail in links
        ],
        "cases": [case(model, frames, links, q) for q in [home, *random]],
    }


def write_robots():
    """pinocchio_mobile.json."""
    rng = np.random.default_rng(8)
    homes = {
        tree: np.zeros(12),
        panda: np.radians([0, -45, 0, -135, 0, 90, 45]),
        mobile_arm: np.radians([0, 0, 0, 0, 60, -165, 0, -75, 0]),
        holonomic_base: np.zeros(3),
        unicycle: np.zeros(3),
        pan_tilt: np.zeros(2),
    }
    about = (
        "links hang from their parent by place . motion(q) . tail; poses[k] is the 4x4 pose of "
        "link k in the base, jacobians[k] (6 x nv) has rows (v, omega) of its origin in base axes; "
        "the first case of each robot is its home"
    )
    robots = [robot(maker, home, rng) for maker, home in homes.items()]
    store("pinocchio_mobile.json", {"made_by": MADE_BY, "about": about, "robots": robots})


def arc(q, v, dt):
    """The coordinates after v = (vx, vy, omega) was held for dt: a matrix exponential."""
    x, y, theta = map(mp.mpf, q)
    vx, vy, omega = (mp.mpf(part) * mp.mpf(dt) for part in v)
    c, s = mp.cos(theta), mp.sin(theta)
    before = mp.matrix([[c, -s, x], [s, c, y], [0, 0, 1]])
    after = before * mp.expm(mp.matrix([[0, -omega, vx], [omega, 0, vy], [0, 0, 0]]))
    return [float(after[0, 2]), float(after[1, 2]), float(theta + omega)]


def write_arcs():
    """arcs_mpmath.json: turns of 0 and of 1e-300 to 20 rad, either way; sideways and not."""
    mp.mp.dps = 60
    rng = np.random.default_rng(9)
    sizes = [0.0, 1e-300, 1e-16, 1e-12, *np.geomspace(1e-9, 20, 24)]
    cases = []
    for angle in [*sizes, *(-x for x in sizes[1:])]:
        for sideways in (1.0, 0.0):
            q, dt = rng.uniform(-2, 2, 3), float(rng.uniform(0.01, 2))
            v = np.append(rng.uniform(-1, 1, 2) * [1, sideways], angle / dt)
            stored = {"q": q.tolist(), "v": v.tolist(), "dt": dt}
            cases.append({**stored, "q_next": arc(**stored)})
    about = (
        "q_next = (x, y, theta) after the velocity v = (vx, vy, omega) of a body in the plane, in "
        "its own axes, was held for dt: the exponential of the 3x3 twist with 60 digits; theta is "
        "not wrapped; every second case has vy = 0"
    )
    made_by = f"mpmath {mp.__version__}"
    store("arcs_mpmath.json", {"made_by": made_by, "about": about, "cases": cases})


if __name__ == "__main__":
    write_robots()
    write_arcs()
