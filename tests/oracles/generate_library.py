"""Oracle: arms of the robot library, from their published tables and from their makers' URDF.

Program: Pinocchio (`pip install pin`); the version used is in "made_by" of the file.
Run:     python tests/oracles/generate_library.py
Writes:  pinocchio_library.json, always the same numbers.

Units are metres and radians. `robots` holds poses of all links and the Jacobian of the last, by the
conventions of generate_mobile.py. `urdf` holds the pose of the flange in the base as Pinocchio's
own reader of URDF finds it, for joint lines that are copied here as they stand in

- ur5e: ros-industrial/universal_robot, ur_description, default_kinematics.yaml of the UR5e (commit
  6485dfa) between the fixed frames of its macro; its base is turned by half a turn about z against
  the base of the DH table, which `base` holds;
- lbr_iiwa14: IFL-CAMP/iiwa_stack, iiwa14.xacro (commit 052aa68);
- panda: example-robot-data 6.0.0, panda.urdf, to panda_link8;
- kinova_gen3: Kinovarobotics/ros_kortex, GEN3-7DOF-NOVISION_FOR_URDF_ARM_V12.urdf (commit 085b694);
  right angles are written there with five digits (1.5708), and lengths with a digit or two more
  than in the DH table, so kinova_gen3 is held twice: as it stands, and `rounded`, with right angles
  and lengths of whole tenths of a millimetre.
"""

import numpy as np
import pinocchio as pin
from _store import store
from generate_mobile import NOTHING, at, build, chain
from generate_pinocchio import MADE_BY, PI, rows, turn

RANDOM = 6  # configurations of each robot


def planar_3r():
    """Three revolute joints in a plane, links of half a metre."""
    table = rows(d=[0, 0, 0], a=[0.5, 0.5, 0.5], alpha=[0, 0, 0])
    return chain("base", "standard", ["upper", "fore", "hand"], ["revolute"] * 3, table)


def gantry():
    """Prismatic joints along x, y and z of the base, and a tool that points down."""
    to_x, to_y = turn("y", PI / 2), turn("x", -PI / 2)  # the z axis becomes the x or the y axis
    return [
        ("bridge", "base", "prismatic", to_x, to_x.inverse()),
        ("carriage", "bridge", "prismatic", to_y, to_y.inverse()),
        ("column", "carriage", "prismatic", NOTHING, NOTHING),
        ("tool", "column", "fixed", at(0, 0, 0, np.diag([1.0, -1.0, -1.0])), NOTHING),
    ]


def stanford_arm():
    """Stanford arm: Paul's and Spong's table with d1, d2, d6 of Stanford AIM-177."""
    d = [0.412, 0.154, 0, 0, 0, 0.263]
    alpha = [-PI / 2, PI / 2, 0, -PI / 2, PI / 2, 0]
    names = ["shoulder", "carriage", "boom", "wrist_roll", "wrist_bend", "tool"]
    kinds = ["revolute", "revolute", "prismatic", "revolute", "revolute", "revolute"]
    return chain("base", "standard", names, kinds, rows(d=d, a=[0] * 6, alpha=alpha))


def scara():
    """Adept One: Schilling's table."""
    table = rows(d=[0.877, 0, 0, 0.2], a=[0.425, 0.375, 0, 0], alpha=[PI, 0, 0, 0])
    kinds = ["revolute", "revolute", "prismatic", "revolute"]
    return chain("base", "standard", ["inner_arm", "outer_arm", "quill", "tool"], kinds, table)


def ur5e():
    """UR5e: the table of Universal Robots."""
    d, a = [0.1625, 0, 0, 0.1333, 0.0997, 0.0996], [0, -0.425, -0.3922, 0, 0, 0]
    names = ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "flange"]
    table = rows(d=d, a=a, alpha=[PI / 2, 0, 0, PI / 2, -PI / 2, 0])
    return chain("base", "standard", names, ["revolute"] * 6, table)


def lbr_iiwa14():
    """LBR iiwa 14 R820: the lengths of KUKA's specification."""
    d, right = [0.36, 0, 0.42, 0, 0.4, 0, 0.126], PI / 2
    alpha = [-right, right, right, -right, -right, right, 0]
    names = [*(f"link{i}" for i in range(1, 7)), "flange"]
    return chain("base", "standard", names, ["revolute"] * 7, rows(d=d, a=[0] * 7, alpha=alpha))


def kinova_gen3():
    """Gen3 with seven joints: the classical table of Kinova's user guide, with its row 0."""
    d = [-0.2848, -0.0118, -0.4208, -0.0128, -0.3143, 0, -0.1674]
    table = rows(d=d, a=[0] * 7, alpha=[PI / 2] * 6 + [PI], theta=[0] + [PI] * 6)
    names = [*["shoulder", "half_arm_1", "half_arm_2", "forearm", "wrist_1", "wrist_2", "flange"]]
    first = ("base_dh", "base", "fixed", turn("x", PI), NOTHING)
    return [first, *chain("base_dh", "standard", names, ["revolute"] * 7, table)]


HOMES = {  # degrees and metres
    planar_3r: [90, -60, -60],
    gantry: [0, 0, 0.35],
    stanford_arm: [0, 90, 0.6, 0, 60, 0],
    scara: [45, 75, 0.1, 90],
    ur5e: [0, -110, -100, -60, 90, 0],
    lbr_iiwa14: [0, 45, 0, -90, 0, 45, 0],
    kinova_gen3: [0, 15, 180, -130, 0, 55, 90],
}

# joint lines of URDF files: xyz, rpy, axis; None for the axis of a fixed joint
UR5E = [
    ((0, 0, 0), (0, 0, PI), None),
    ((0, 0, 0.1625), (0, 0, 0), (0, 0, 1)),
    ((0, 0, 0), (1.570796327, 0, 0), (0, 0, 1)),
    ((-0.425, 0, 0), (0, 0, 0), (0, 0, 1)),
    ((-0.3922, 0, 0.1333), (0, 0, 0), (0, 0, 1)),
    ((0, -0.0997, -2.044881182297852e-11), (1.570796327, 0, 0), (0, 0, 1)),
    (
        (0, 0.09959999999999999, -2.042830148012698e-11),
        (1.570796326589793, 3.141592653589793, 3.141592653589793),
        (0, 0, 1),
    ),
    ((0, 0, 0), (0, -PI / 2, -PI / 2), None),
    ((0, 0, 0), (PI / 2, 0, PI / 2), None),
]
IIWA14 = [
    ((0, 0, 0.1575), (0, 0, 0), (0, 0, 1)),
    ((0, 0, 0.2025), (PI / 2, 0, PI), (0, 0, 1)),
    ((0, 0.2045, 0), (PI / 2, 0, PI), (0, 0, 1)),
    ((0, 0, 0.2155), (PI / 2, 0, 0), (0, 0, 1)),
    ((0, 0.1845, 0), (-PI / 2, PI, 0), (0, 0, 1)),
    ((0, 0, 0.2155), (PI / 2, 0, 0), (0, 0, 1)),
    ((0, 0.081, 0), (-PI / 2, PI, 0), (0, 0, 1)),
    ((0, 0, 0.045), (PI, PI, PI), None),
]
PANDA = [
    ((0, 0, 0.333), (0, 0, 0), (0, 0, 1)),
    ((0, 0, 0), (-1.5707963267948966, 0, 0), (0, 0, 1)),
    ((0, -0.316, 0), (1.5707963267948966, 0, 0), (0, 0, 1)),
    ((0.0825, 0, 0), (1.5707963267948966, 0, 0), (0, 0, 1)),
    ((-0.0825, 0.384, 0), (-1.5707963267948966, 0, 0), (0, 0, 1)),
    ((0, 0, 0), (1.5707963267948966, 0, 0), (0, 0, 1)),
    ((0.088, 0, 0), (1.5707963267948966, 0, 0), (0, 0, 1)),
    ((0, 0, 0.107), (0, 0, 0), None),
]
GEN3 = [
    ((0, 0, 0.15643), (3.1416, 2.7629e-18, -4.9305e-36), (0, 0, 1)),
    ((0, 0.005375, -0.12838), (1.5708, 2.1343e-17, -1.1102e-16), (0, 0, 1)),
    ((0, -0.21038, -0.006375), (-1.5708, 1.2326e-32, -2.9122e-16), (0, 0, 1)),
    ((0, 0.006375, -0.21038), (1.5708, -6.6954e-17, -1.6653e-16), (0, 0, 1)),
    ((0, -0.20843, -0.006375), (-1.5708, 2.2204e-16, -6.373e-17), (0, 0, 1)),
    ((0, 0.00017505, -0.10593), (1.5708, 9.2076e-28, -8.2157e-15), (0, 0, 1)),
    ((0, -0.10593, -0.00017505), (-1.5708, -5.5511e-17, 9.6396e-17), (0, 0, 1)),
    ((0, 0, -0.0615250000000001), (3.14159265358979, 1.09937075168372e-32, 0), None),
]


def rounded(table):
    """Right angles, and lengths of whole tenths of a millimetre as in Kinova's table.

    That table leaves out the 0.175 mm of joints 6 and 7.
    """
    lengths = [np.where(np.abs(xyz) < 2e-4, 0, np.round(xyz, 4)) for xyz, _, _ in table]
    angles = [PI / 2 * np.round(np.array(rpy) / (PI / 2)) for _, rpy, _ in table]
    return [(*pair, axis) for *pair, (_, _, axis) in zip(lengths, angles, table, strict=True)]


def urdf(table):
    """The text of a URDF file with these joints, links massless."""

    def words(numbers):
        return " ".join(repr(float(x)) for x in numbers)

    lines = ['<link name="link_0"/>']
    for i, (xyz, rpy, axis) in enumerate(table):
        kind = "fixed" if axis is None else "continuous"
        along = "" if axis is None else f'<axis xyz="{words(axis)}"/>'
        lines.append(
            f'<link name="link_{i + 1}"/><joint name="joint_{i + 1}" type="{kind}">'
            f'<parent link="link_{i}"/><child link="link_{i + 1}"/>{along}'
            f'<origin xyz="{words(xyz)}" rpy="{words(rpy)}"/></joint>'
        )
    return f'<robot name="arm">{"".join(lines)}</robot>'


def in_pinocchio(model, q):
    """q in the form of the model: (cos, sin) for joints that turn without end."""
    turns = [j.nq == 2 for j in model.joints[1:]]
    each = zip(turns, q, strict=True)
    return np.concatenate([[np.cos(x), np.sin(x)] if two else [x] for two, x in each])


def flange_case(model, q):
    """The pose of the last link at q."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, in_pinocchio(model, q))
    return {"q": q.tolist(), "pose": data.oMf[model.nframes - 1].homogeneous.tolist()}


def described(name, table, rng, base=NOTHING):
    """The flange of one robot according to a URDF; ours is base . theirs."""
    model = pin.buildModelFromXML(urdf(table))
    n = sum(axis is not None for *_, axis in table)
    cases = [flange_case(model, rng.uniform(-PI, PI, n)) for _ in range(RANDOM)]
    return {"name": name, "base": base.homogeneous.tolist(), "cases": cases}


def case(model, frames, names, q):
    """Poses of all links and the Jacobian of the last."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    last = frames[names[-1]]
    J = pin.computeFrameJacobian(model, data, q, last, pin.LOCAL_WORLD_ALIGNED)
    poses = [data.oMf[frames[name]].homogeneous.tolist() for name in names]
    return {"q": q.tolist(), "poses": poses, "jacobian": J.tolist()}


def robot(maker, home, rng):
    """Everything stored about one robot: at home, then at random configurations."""
    links = maker()
    model, frames = build(links)
    names, kinds = [link[0] for link in links], [link[2] for link in links if link[2] != "fixed"]
    turns = np.array([kind == "revolute" for kind in kinds])
    first = np.where(turns, np.radians(home), home)
    qs = [first, *(rng.uniform(-1, 1, len(home)) * np.where(turns, PI, 1) for _ in range(RANDOM))]
    return {
        "name": maker.__name__,
        "links": names,
        "kinds": kinds,
        "cases": [case(model, frames, names, q) for q in qs],
    }


def write():
    """pinocchio_library.json."""
    rng = np.random.default_rng(11)
    about = (
        "robots: poses[k] is the 4x4 pose of link k in the base, jacobian (6 x nv) that of the "
        "last link, rows (v, omega) in base axes; the first case is home; urdf: the pose of the "
        "flange by the maker's URDF, to be multiplied by base from the left"
    )
    robots = [robot(maker, home, rng) for maker, home in HOMES.items()]
    urdfs = [
        described("ur5e", UR5E, rng, turn("z", PI)),
        described("lbr_iiwa14", IIWA14, rng),
        described("panda", PANDA, rng),
        described("kinova_gen3", GEN3, rng),
        described("kinova_gen3 rounded", rounded(GEN3), rng),
    ]
    whole = {"made_by": MADE_BY, "about": about, "robots": robots, "urdf": urdfs}
    store("pinocchio_library.json", whole)


if __name__ == "__main__":
    write()
