"""A robot with a camera in plain NumPy, driven by `rs.Controller`, and faults of both.

Nothing here calls RobSim but the controller: kinematics, lens and clock are written anew.
"""

from dataclasses import dataclass, field, replace

import numpy as np

import robsim as rs

UR5 = np.array(
    [
        [0, 0.0892, 0, np.pi / 2],
        [0, 0, -0.425, 0],
        [0, 0, -0.392, 0],
        [0, 0.1093, 0, np.pi / 2],
        [0, 0.09475, 0, -np.pi / 2],
        [0, 0.0825, 0, 0],
    ]
)
HOME = np.array([0.2, -1.6, 1.5, -1.4, -1.5, 0.3])
MARKS = np.array([[-0.09, -0.08, 0], [0.1, -0.08, 0], [0.08, 0.09, 0], [-0.09, 0.1, 0.0]])
K = np.array([[560.0, 0, 322.0], [0, 560.0, 238.0], [0, 0, 1]])
DT = 0.04
JOINTS = tuple(f"link{i}" for i in range(1, 7))


def rotation(w):
    """The rotation matrix of a rotation vector (Rodrigues)."""
    w = np.asarray(w, float)
    angle = np.linalg.norm(w)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = w / angle
    W = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * W + (1 - np.cos(angle)) * W @ W


def transform(position=(0, 0, 0), w=(0, 0, 0)):
    """The matrix (4, 4) of a position and a rotation vector."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation(w), position
    return T


def flange(q, rows=UR5):
    """The pose (4, 4) of the last link: the product of Rz(theta) Tz(d) Tx(a) Rx(alpha)."""
    T = np.eye(4)
    for angle, (theta, d, a, alpha) in zip(q, rows, strict=True):
        c, s, ca, sa = np.cos(theta + angle), np.sin(theta + angle), np.cos(alpha), np.sin(alpha)
        rows_of_A = [c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d]
        T = T @ np.array([*rows_of_A, [0, 0, 0, 1]])
    return T


def project(X, K, lens):
    """The pixels (N, 2) of points X (N, 3) in camera axes, by k1, k2, p1, p2 as in OpenCV."""
    x, y = X[:, 0] / X[:, 2], X[:, 1] / X[:, 2]
    k1, k2, p1, p2 = lens
    r2 = x * x + y * y
    f = 1 + k1 * r2 + k2 * r2**2
    u = x * f + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    v = y * f + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.stack([K[0, 0] * u + K[0, 2], K[1, 1] * v + K[1, 2]], axis=1)


@dataclass(frozen=True)
class Cell:
    """An arm, a camera and a target: the camera on the flange, or the target on it."""

    mount: np.ndarray  # pose of the camera on the flange, or in the world
    place: np.ndarray  # pose of the target in the world, or on the flange
    in_hand: bool = True
    K: np.ndarray = field(default_factory=lambda: K)
    lens: tuple = (0.0, 0.0, 0.0, 0.0)
    marks: np.ndarray = field(default_factory=lambda: MARKS)
    flange: object = flange  # kinematics of the arm
    project: object = project

    def look(self, q):
        """The pixels (N, 2) of the marks at joints q."""
        A = self.flange(q)
        T = np.linalg.inv(A @ self.mount) @ self.place
        if not self.in_hand:
            T = np.linalg.inv(self.mount) @ A @ self.place
        X = self.marks @ T[:3, :3].T + T[:3, 3]
        return np.where(X[:, 2:] > 0.02, self.project(X, self.K, self.lens), np.nan)


def cell(in_hand=True):
    """A cell with the target half a metre in front of the camera at HOME."""
    A = flange(HOME)
    if in_hand:
        mount = transform((0.03, -0.05, 0.06), (0.1, -0.15, 0.4))
        return Cell(mount, A @ mount @ transform((0, 0, 0.5), (0.2, -0.1, 0.3)))
    place = transform((0.02, 0.01, 0.08), (0.1, 0.2, 0.5))
    away = transform((0, 0, 0.6), (0.3, 2.9, 0.1))
    return Cell(A @ place @ np.linalg.inv(away), place, in_hand=False)


def experiment(of, start, **settings):
    """The experiment that a user writes for a cell without faults."""
    arm = rs.Robot.from_dh(UR5, name="arm", home=HOME, links=JOINTS)
    on = ("arm.link6", "world") if of.in_hand else ("world", "arm.link6")
    eye = rs.MountedCamera("camera", rs.Camera(K, (640, 480)), on[0], rs.Pose(of.mount))
    plate = rs.Object("plate", marks=of.marks, pose=rs.Pose(of.place), on=on[1])
    task = rs.IBVS(HOME, gain=1.0, interaction="mean")
    return rs.Experiment(rs.Scene([arm], [plate], [eye]), task, start, dt=DT, **settings)


@dataclass
class Drive:
    """The faults of one drive, besides faults of the cell, and the state of the real joints."""

    noise: float = 0.0  # px
    jitter: float = 0.0  # of the clock, as a share of a period
    dropped: float = 0.0  # share of images
    gap: tuple = (0, 0)  # periods without an image
    factor: np.ndarray = field(default_factory=lambda: np.ones(6))  # of the drives
    lag: np.ndarray = field(default_factory=lambda: np.zeros(6))  # seconds
    image_delay: int = 0  # periods
    command_delay: int = 0
    offset: np.ndarray = field(default_factory=lambda: np.zeros(6))  # true minus measured
    stamp: float = 0.0  # seconds by which the stamps of images are late
    swap: tuple = ()  # columns that change places in the log
    wires: tuple = ()  # joints that change places between command and motion
    axes: bool = False  # the log has (row, column)
    steps: int = 220


def record(made, real, faults, seed=0, start=None):
    """Drive a cell by the controller of an experiment; return the columns of the log."""
    rng, controller = np.random.default_rng(seed), rs.Controller(made)
    q = np.array(made.start if start is None else start, float) + faults.offset
    v, old_q, old_qd, table, when = np.zeros(6), [], [], [], 0.0
    image = None
    for k in range(faults.steps):
        nominal = k * DT
        t = nominal + faults.jitter * DT * rng.uniform(-0.5, 0.5) * (k > 0)
        q = q + v * (t - when)
        when = t
        old_q.append(q.copy())
        seen = old_q[max(k - faults.image_delay, 0)]
        pixels = real.look(seen) + faults.noise * rng.standard_normal((len(real.marks), 2))
        lost = k and (rng.random() < faults.dropped or faults.gap[0] <= k < faults.gap[1])
        outside = not ((pixels >= 0) & (pixels <= [639, 479])).all()
        image = None if lost or (outside and k) else pixels
        measured = q - faults.offset
        command = controller.step(image, measured, t)
        qd = np.array(command.velocities)
        table.append((t, measured, qd, image))
        old_qd.append(qd)
        told = old_qd[k - faults.command_delay] if k >= faults.command_delay else 0 * qd
        if faults.wires:
            told = told.copy()
            told[list(faults.wires)] = told[list(faults.wires[::-1])]
        goal = faults.factor * told
        left = np.where(faults.lag > 0, np.exp(-DT / np.maximum(faults.lag, 1e-9)), 0.0)
        v = goal + left * (v - goal)
    return columns_of(table, faults, len(real.marks))


def columns_of(table, faults, marks):
    """The columns of a log; images with wrong stamps have rows of their own."""
    names = [f"q[{n}]" for n in JOINTS] + [f"qd[{n}]" for n in JOINTS]
    pixel_names = [f"pixels[{i},{axis}]" for i in range(marks) for axis in ("column", "row")]
    rows = []
    for t, q, qd, image in table:
        flat = np.full(2 * marks, np.nan)
        if image is not None:
            flat = (image[:, ::-1] if faults.axes else image).ravel()
        state = dict(zip(names, [*q, *qd], strict=True))
        seen = dict(zip(pixel_names, flat, strict=True))
        if faults.stamp:
            empty, blank = dict.fromkeys(names, np.nan), dict.fromkeys(pixel_names, np.nan)
            rows += [{"time": t, **state, **blank}, {"time": t + faults.stamp, **empty, **seen}]
        else:
            rows.append({"time": t, **state, **seen})
    rows.sort(key=lambda row: row["time"])
    first = rows[0]["time"]
    log = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    log["time"] = log["time"] - first
    for one, other in [faults.swap] if faults.swap else []:
        log[one], log[other] = log[other], log[one]
    return log


def start_near(rng, size=0.25):
    """A start at some distance from HOME."""
    return HOME + rng.uniform(-1, 1, 6) * size * np.array([0.6, 0.5, 0.5, 0.8, 0.8, 1.5])


def unit(rng):
    """A random direction."""
    v = rng.standard_normal(3)
    return v / np.linalg.norm(v)


def either(rng, low, high):
    """A random number of either sign."""
    return rng.choice([-1, 1]) * rng.uniform(low, high)


def turn_mount(real, drive, rng):
    """A mount that is turned or moved."""
    angle, length = np.radians(rng.uniform(8, 20)), rng.uniform(0.02, 0.04)
    error = transform(w=angle * unit(rng)) if rng.random() < 0.5 else transform(length * unit(rng))
    return replace(real, mount=real.mount @ error), drive, ("mount",)


def zoom(real, drive, rng):
    """Another focal length."""
    f = 1 + either(rng, 0.13, 0.25)
    scale = np.array([[f, 1, 1], [1, f, 1], [1, 1, 1]])
    return replace(real, K=real.K * scale), drive, ("focal length",)


def offset_joint(real, drive, rng):
    """An encoder with an offset."""
    i, size = rng.integers(6), np.radians(either(rng, 3, 8))
    return real, replace(drive, offset=size * (np.arange(6) == i)), ("offset", f"'{JOINTS[i]}'")


def delay_images(real, drive, rng):
    """Images that come late, with the time at which they come."""
    return real, replace(drive, image_delay=int(rng.integers(3, 7))), ("image times", "delay")


def delay_commands(real, drive, rng):
    """Commands that are executed late."""
    return real, replace(drive, command_delay=int(rng.integers(3, 7))), ("command delay",)


def scale_drives(real, drive, rng):
    """Drives, or one drive, with another factor."""
    size = rng.choice([rng.uniform(0.5, 0.85), rng.uniform(1.15, 1.4)])
    i, every = rng.integers(6), rng.random() < 0.5
    factor = np.full(6, size) if every else np.where(np.arange(6) == i, size, 1.0)
    return real, replace(drive, factor=factor), ("factor", "" if every else f"'{JOINTS[i]}'")


def move_target(real, drive, rng):
    """A target that stands elsewhere."""
    turned = np.radians(rng.uniform(0, 15)) * unit(rng)
    error = transform(rng.uniform(0.03, 0.08) * unit(rng), turned)
    return replace(real, place=real.place @ error), drive, ("target",)


def shift_stamps(real, drive, rng):
    """Stamps of images by another clock."""
    return real, replace(drive, stamp=either(rng, 3, 6) * DT), ("image times", "stamps")


def bend_lens(real, drive, rng):
    """A lens with distortion."""
    lens = (either(rng, 0.2, 0.4), rng.uniform(-0.1, 0.1), 0.0, 0.0)
    return replace(real, lens=lens), drive, ("distortion",)


def reverse_joint(real, drive, rng):
    """A joint that moves backwards."""
    i = rng.integers(6)
    factor = np.where(np.arange(6) == i, -1.0, 1.0)
    return real, replace(drive, factor=factor), ("reversed", f"'{JOINTS[i]}'")


def slow_joint(real, drive, rng):
    """A joint that is slow, or that follows late."""
    i = rng.integers(6)
    one, name = np.arange(6) == i, f"'{JOINTS[i]}'"
    if rng.random() < 0.5:
        return real, replace(drive, lag=rng.uniform(0.2, 0.5) * one), ("lag", name)
    return real, replace(drive, factor=np.where(one, rng.uniform(0.2, 0.6), 1.0)), ("factor", name)


def swap_columns(real, drive, rng):
    """Two columns of the log, or two wires of the robot, that change places."""
    i, j = rng.choice(6, 2, replace=False)
    which, both = rng.integers(4), ("swapped", f"'{JOINTS[i]}'", f"'{JOINTS[j]}'")
    if which == 0:
        return real, replace(drive, axes=True), ("swapped", "column", "row")
    if which == 1:
        return real, replace(drive, wires=(i, j)), both
    part = ("q", "qd")[which - 2]
    return real, replace(drive, swap=(f"{part}[{JOINTS[i]}]", f"{part}[{JOINTS[j]}]")), both


def lose_images(real, drive, rng):
    """Images that are lost now and then, or for a while."""
    if rng.random() < 0.5:
        return real, replace(drive, dropped=rng.uniform(0.4, 0.7)), ("lost",)
    begin = int(rng.integers(10, 40))
    return real, replace(drive, gap=(begin, begin + int(rng.integers(15, 40)))), ("lost",)


FAULTS = {
    "mount": turn_mount,
    "focal length": zoom,
    "joint offset": offset_joint,
    "late images": delay_images,
    "late commands": delay_commands,
    "drive factor": scale_drives,
    "moved target": move_target,
    "wrong stamps": shift_stamps,
    "distortion": bend_lens,
    "reversed joint": reverse_joint,
    "slow joint": slow_joint,
    "swapped columns": swap_columns,
    "lost images": lose_images,
}
