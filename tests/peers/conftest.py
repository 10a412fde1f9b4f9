"""Other programs that read what we write: `pip install '.[oracles,mesh,ros,vision]'`, then
`pytest tests/peers`.

If one of them is not installed, no test that needs it is collected, and pytest reports it on top;
it fails if these tests alone were selected.
"""

import functools
import importlib.util
from importlib import metadata

import numpy as np
import pytest

import robsim as rs
from robsim.robot.urdf.vocabulary import make_safe_name

PEERS = {  # by the files of tests that take them
    "test_[!bv]*.py": ("mujoco", "pinocchio", "yourdfpy", "rtbdata"),
    "test_bag*.py": ("rosbags", "mcap"),
    "test_quadratic_*.py": ("daqp", "scipy"),
    "test_vision_*.py": ("cv2", "pyapriltags", "yaml"),
}
LACKING = {
    name: files
    for files, names in PEERS.items()
    for name in names
    if importlib.util.find_spec(name) is None
}
collect_ignore_glob = sorted(set(LACKING.values()))


def pytest_report_header():
    left = [f"{files} (without {name})" for name, files in LACKING.items()]
    return f"tests/peers: left out: {', '.join(left)}" if left else None


class Pinocchio:
    """A URDF file as Pinocchio reads it, in the names and coordinates of our robot.

    Without `mimic` it ignores that coordinates follow others, and receives all of ours.
    """

    def __init__(self, path, robot, mimic=True):
        import pinocchio

        self.pin, self.robot = pinocchio, robot
        self.model = pinocchio.buildModelFromUrdf(str(path), mimic=mimic)
        self.data = self.model.createData()
        every = zip(self.model.names, self.model.joints, strict=True)
        self.joints = [
            (make_safe_name(name, "joint"), joint) for name, joint in list(every)[1:] if joint.nq
        ]
        self.speeds = {name: i for i, name in enumerate(robot.velocity_names)}

    def at(self, q):
        """Place all that there is."""
        values = dict(zip(self.robot.coordinate_names, q, strict=True))
        waiting = [link for link in self.robot.links if link.joint.follows is not None]
        while waiting:
            link = next(link for link in waiting if link.joint.follows.of in values)
            follows = link.joint.follows
            values[link.joint.name or link.name] = (
                follows.ratio * values[follows.of] + follows.offset
            )
            waiting = [other for other in waiting if other.name != link.name]
        self.q = self.pin.neutral(self.model)
        for name, joint in self.joints:
            self.q[joint.idx_q : joint.idx_q + joint.nq] = self._coordinates(name, joint, values)
        self.pin.framesForwardKinematics(self.model, self.data, self.q)
        return self

    def _coordinates(self, name, joint, values):
        if joint.nq == 1:
            return values[name]
        if joint.nq == 2:  # continuous
            return np.cos(values[name]), np.sin(values[name])
        if joint.nq == 4:  # planar
            x, y, theta = (values[f"{name}.{part}"] for part in ("x", "y", "theta"))
            return x, y, np.cos(theta), np.sin(theta)
        return [values[name + part] for part in (".x", ".y", ".z", ".qx", ".qy", ".qz", ".qw")]

    def frames(self):
        """Our name and the number of each frame of a link."""
        kind = self.pin.FrameType.BODY
        every = enumerate(self.model.frames)
        return {make_safe_name(f.name, "link"): i for i, f in every if f.type == kind}

    def pose(self, frame):
        return self.data.oMf[frame].homogeneous

    def jacobian(self, frame):
        """In the order of our velocities."""
        axes = self.pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        theirs = self.pin.computeFrameJacobian(self.model, self.data, self.q, frame, axes)
        theirs = theirs.reshape(6, -1)
        J = np.zeros((6, self.robot.nv))
        for label, joint in self.joints:
            columns = [i for key, i in self.speeds.items() if key in (label, *self._parts(label))]
            J[:, columns] = theirs[:, joint.idx_v : joint.idx_v + joint.nv]
        return J

    @staticmethod
    def _parts(label):
        return [f"{label}.{part}" for part in ("vx", "vy", "vz", "wx", "wy", "wz", "omega")]


@pytest.fixture
def pinocchio_reads():
    return Pinocchio


@pytest.fixture
def some_coordinates():
    """Random coordinates, within the limits if there are any."""

    def drawn(robot, runs=3):
        rng = np.random.default_rng(robot.nq)
        low, high = np.clip(robot.limits.T, -3.0, 3.0)
        q = rng.uniform(low, np.maximum(high, low), (runs, robot.nq))
        for i, name in enumerate(robot.coordinate_names):
            if name.endswith(".qx"):
                q[:, i : i + 4] = rng.normal(size=(runs, 4))
                q[:, i : i + 4] /= np.linalg.norm(q[:, i : i + 4], axis=1, keepdims=True)
        return q

    return drawn


def gripper():
    """A case that no robot of the library has: a coordinate follows a follower."""
    turn = rs.joints.Joint(
        "revolute", rs.Pose.at(0, 0, 0.1, rpy=(0.1, 0.2, 0.3)), rs.Pose.at(0.1, 0.2)
    )
    slide = rs.joints.Joint("prismatic", rs.Pose.at(rpy=(0, 1, 0)), limits=(0.0, 0.04), name="grip")
    other = rs.joints.Joint(
        "prismatic", rs.Pose.at(rpy=(0, -1, 0)), follows=rs.joints.Mimic("grip", -0.5, 0.1)
    )
    nail = rs.joints.Joint(
        "revolute", tail=rs.Pose.at(0.1), follows=rs.joints.Mimic("right", 3.0, 0.2)
    )
    links = [
        rs.joints.Link("base"),
        rs.joints.Link("palm", "base", turn, (rs.shapes.Ball(0.1, mass=1),)),
        rs.joints.Link("left", "palm", slide, (rs.Block(0.1, 0.02, 0.03, "r"),)),
        rs.joints.Link("right", "palm", other),
        rs.joints.Link("nail", "right", nail),
    ]
    return rs.Robot("gripper", links)


def mixture():
    """Joints of all kinds, everywhere constant poses on both sides of the motion; a body flies."""
    rng = np.random.default_rng(3)

    def joint(kind, **more):
        place, tail = (rs.Pose.at(*rng.normal(size=3), rpy=rng.normal(size=3)) for _ in range(2))
        return rs.joints.Joint(kind, place, tail, **more)

    brick = rs.Block(0.1, 0.2, 0.3, mass=2).at(rs.Pose.at(0.1, rpy=(1, 2, 3)))
    links = [
        rs.joints.Link("base"),
        rs.joints.Link("deck", "base", joint("planar"), (brick,)),
        rs.joints.Link(
            "plate", "deck", joint("fixed"), (rs.Wheel(0.1, 0.2, mass=1), rs.shapes.Ball(0.1))
        ),
        rs.joints.Link("arm", "plate", joint("revolute", effort=3.0)),
        rs.joints.Link("shelf", "base", joint("fixed")),
        rs.joints.Link("drone", "shelf", joint("floating"), (rs.CameraBody(0.1, 0.2, 0.3),)),
        rs.joints.Link("slide", "drone", joint("prismatic", name="lift", limits=(-1.0, 3.0))),
    ]
    return rs.Robot("mixture", links)


def expressible(robot):
    kinds = {"fixed", "revolute", "prismatic", "floating", "planar"}
    joints = [link.joint for link in robot.links]
    return all(j.kind in kinds and isinstance(j.follows, rs.joints.Mimic | None) for j in joints)


# packages of URDF files: the packages of the extra `oracles`, and more that are tested if they are
# installed (`pip install --no-deps airo-models armar ...`; they weigh 0.6 GB, most of it meshes)
PUBLISHERS = (
    "example-robot-data",
    "rtb-data",
    "airo-models",
    "armar",
    "dexmate-urdf",
    "differentiable-robot-model",
    "gym-ignition-models",
    "hello-robot-stretch-urdf",
    "hello-robot-stretch4-urdf",
    "jvrc-description",
    "orca-arm",
    "pybullet",
    "robot-properties-fingers",
    "synriard",
    "upkie-description",
    "urdfenvs",
)
OBJECTS = "random_urdfs"  # of pybullet: a thousand things, one link each


def pytest_generate_tests(metafunc):
    """`written`: each robot that the formats can express. `published`: the files of packages."""
    if "written" in metafunc.fixturenames:
        metafunc.parametrize("written", expressible_robots(), ids=lambda robot: robot.name)
    if "published" in metafunc.fixturenames:
        files = published_files()
        metafunc.parametrize("published", files.values(), ids=files)


@functools.cache
def expressible_robots():
    """The robots of the library that the formats can express, a gripper, and one of all joints."""
    library = [rs.robots.load(name) for name in rs.robots.names()]
    return [*(robot for robot in library if expressible(robot)), gripper(), mixture()]


@functools.cache
def published_files():
    """The path of each file, by a name for it: its package, two folders above it, its own name."""
    found = {}
    for package in PUBLISHERS:
        for file in sorted(_files(package)):
            if file.suffix == ".urdf" and OBJECTS not in file.parts:
                found["/".join([package, *file.parts[-3:-1], file.stem])] = file.locate()
    return found


def _files(package):
    try:
        return metadata.files(package) or []
    except metadata.PackageNotFoundError:
        return []


@pytest.fixture
def every_published():
    """The names of the files, by their package."""
    names = list(published_files())
    found = {package: [n for n in names if n.startswith(f"{package}/")] for package in PUBLISHERS}
    return {package: names for package, names in found.items() if names}


# bags


@pytest.fixture(scope="session")
def rhino():
    return rs.load_scenario(rs.examples.path("chapter_6_1")).with_(duration=1.0)


@pytest.fixture(scope="session")
def run(rhino):
    return rhino.run()


@pytest.fixture(scope="session")
def bag(run, tmp_path_factory):
    """A bag of `run`, which `rhino` describes, as a file."""
    return rs.logs.write_bag(run, tmp_path_factory.mktemp("bags") / "run.mcap")


@pytest.fixture
def content(bag):
    """All messages of `bag`: (topic, type, time, message)."""
    from bagging import read_messages  # here, as it needs rosbags

    return list(read_messages(bag))
