"""Oracle: closed loops of image-based visual servoing with a free camera, by plain NumPy.

Program: NumPy and SciPy (`pip install numpy scipy`); the versions are in "made_by".
Run:     python tests/oracles/generate_loops.py        (about half a minute)
Writes:  loops.json, always the same numbers up to rounding of the linear algebra.

A loop of the textbook form and nothing else: four points, s the normalised coordinates x0 y0 x1
y1 ..., e = s - s_goal, V = -gain pinv(L) e, a velocity V = (v, omega) in camera axes held over
dt, T <- T expm([V] dt). T is the pose of the camera in the world (4x4). Depths are exact. L is
`current`, `desired` (L of the goal view) or `mean` (half their sum). The error at time k dt is
that before the k-th command. Poses in words are position (m) | rotation vector (rad).

Each result stands beside `reference`: the closed form or the number known for the case.
"""

import numpy as np
import scipy
from _store import store
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

LAWS = ("current", "desired", "mean")


def pose(position, rotation_vector):
    """4x4 pose."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(rotation_vector).as_matrix()
    T[:3, 3] = position
    return T


def inverse(T):
    """Inverse of a pose."""
    R, p = T[:3, :3], T[:3, 3]
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = R.T, -R.T @ p
    return result


def square(half_side):
    """The corners of a square on Z = 0."""
    a = half_side
    return np.array([[-a, -a, 0], [a, -a, 0], [a, a, 0], [-a, a, 0]], float)


def observe(T_w_c, points):
    """Normalised coordinates (4, 2) and depths (4,) of world points."""
    p = (points - T_w_c[:3, 3]) @ T_w_c[:3, :3]
    return p[:, :2] / p[:, 2:], p[:, 2]


def interaction_matrix(s, Z):
    """L (8, 6) of points: Chaumette and Hutchinson, Visual servo control part I, eq. (11)."""
    blocks = [
        [[-1 / z, 0, x / z, x * y, -(1 + x * x), y], [0, -1 / z, y / z, 1 + y * y, -x * y, -x]]
        for (x, y), z in zip(s, Z, strict=True)
    ]
    return np.array(blocks).reshape(-1, 6)


def twist_matrix(V):
    """The 4x4 matrix of the twist (v, omega)."""
    v1, v2, v3, x, y, z = V
    return np.array([[0, -z, y, v1], [z, 0, -x, v2], [-y, x, 0, v3], [0, 0, 0, 0]])


def servo(points, goal, start, law, gain, dt, steps):
    """Run the loop; yields (k, pose, e, depths) before every command and after the last."""
    s_goal, Z_goal = observe(goal, points)
    L_goal = interaction_matrix(s_goal, Z_goal)
    T = start.copy()
    for k in range(steps + 1):
        s, Z = observe(T, points)
        e = (s - s_goal).ravel()
        yield k, T, e, Z
        L = interaction_matrix(s, Z)
        used = {"current": L, "desired": L_goal, "mean": (L + L_goal) / 2}[law]
        V = -gain * np.linalg.pinv(used) @ e
        T = T @ expm(twist_matrix(V) * dt)


def sample(k, dt, T, e):
    """One stored moment of a run."""
    return {
        "step": k,
        "time": round(k * dt, 9),
        "T_w_c": T.tolist(),
        "error": e.tolist(),
        "error_norm": float(np.linalg.norm(e)),
    }


def run(points, goal, start, law, gain, dt, keep):
    """The loop up to the last step of `keep`: samples at these steps and the depths met."""
    samples, nearest, farthest = [], np.inf, -np.inf
    for k, T, e, Z in servo(points, goal, start, law, gain, dt, max(keep)):
        nearest, farthest = min(nearest, Z.min()), max(farthest, Z.max())
        if k in keep:
            samples.append(sample(k, dt, T, e))
    return {
        "law": law,
        "final_error_norm": samples[-1]["error_norm"],
        "final_position": T[:3, 3].tolist(),
        "final_rotation_vector": Rotation.from_matrix(T[:3, :3]).as_rotvec().tolist(),
        "smallest_depth": float(nearest),
        "largest_depth": float(farthest),
        "samples": samples,
    }


def scene(name, points, goal, start, gain, dt, keep, laws, reference):
    """One case: the scene, the known quantities and the runs."""
    return {
        "name": name,
        "points": points.tolist(),
        "goal_T_w_c": goal.tolist(),
        "start_T_w_c": start.tolist(),
        "gain": gain,
        "dt": dt,
        "reference": reference,
        "runs": [run(points, goal, start, law, gain, dt, keep) for law in laws],
    }


def visp_tutorial():
    """The image-based tutorial of ViSP: given are poses of the object in the camera."""
    goal = inverse(pose([0, 0, 0.75], [0, 0, 0]))
    start = inverse(pose([0.15, -0.1, 1.0], np.radians([10, -10, 50])))
    keep = {0, 1, 2, 5, 10, 25, 50, 100, 149}
    reference = {"error_norm_at_5.96_s": 0.0230}
    return scene(
        "visp_tutorial", square(0.1), goal, start, 0.5, 0.04, keep, ("current",), reference
    )


def trap_four_points():
    """A local minimum of four points in a plane (data of Colotti and others)."""
    xy = np.array([[-0.02, 0.05], [0.06, 0.04], [0.10, -0.07], [-0.05, -0.03]])
    points = np.hstack([xy, np.zeros((4, 1))])
    goal = pose([-0.11, -0.24, -0.97], [-0.2, 0.2, 1.4])
    start = pose([0, 0, -1], [0, 0, 0])
    reference = {
        "current": "trapped, error norm 0.00231, near "
        "(0.1336, 0.2517, -0.9603 | 0.0412, -0.3486, 1.3667)",
        "desired": "converges",
        "mean": "converges",
    }
    return trap("trap_four_points", points, goal, start, reference)


def trap_tilted_square():
    """A local minimum of a square seen obliquely at the goal."""
    root = 0.70711
    goal = pose([root, 0, -root], [0, -0.7854, 0])
    start = pose([-root, 0, -root], [0, 0.7854, 0])
    reference = {
        "current": "trapped, error norm 0.02755, at (-0.68896, 0, -0.76256 | 0, 0.72494, 0)",
        "desired": "converges",
        "mean": "converges",
    }
    return trap("trap_tilted_square", square(0.1), goal, start, reference)


def trap(name, points, goal, start, reference):
    """A minute at 20 ms with the three laws."""
    keep = {0, 1, 10, 50, 100, 250, 500, 1000, 3000}
    return scene(name, points, goal, start, 1.0, 0.02, keep, LAWS, reference)


def retreat(degrees):
    """A square parallel to the image, a metre away, and a pure rotation about the optical axis."""
    goal = pose([0, 0, -1], [0, 0, 0])
    start = pose([0, 0, -1], [0, 0, np.radians(degrees)])
    keep = {0, 1, 100, 1000, 2000, 4000, 10000, 20000}
    reference = retreat_limits(np.radians(degrees))
    name = f"retreat_{degrees}_deg"
    return scene(name, square(0.25), goal, start, 1.0, 0.0005, keep, LAWS, reference)


def retreat_limits(theta0):
    """Depths on the way for dt -> 0 (Z = 1 at the goal).

    Current: largest 1 / cos(theta0 / 2). Desired: Z = 1 - (theta0 - theta) tan(theta / 2); its
    smallest value is cos(m) with m + sin(m) = theta0. Mean: constant.
    """
    m = brentq(lambda x: x + np.sin(x) - theta0, 0, np.pi, xtol=1e-15)
    return {
        "current_largest_depth": float(1 / np.cos(theta0 / 2)),
        "desired_smallest_depth": float(np.cos(m)),
        "mean_depth": 1.0,
    }


if __name__ == "__main__":
    cases = [visp_tutorial(), trap_four_points(), trap_tilted_square()]
    cases += [retreat(degrees) for degrees in (30, 60, 90, 120)]
    about = (
        "free camera, four points, V = -gain pinv(L) e held over dt; T_w_c: pose of the camera in "
        "the world; lengths m, angles rad, times s, gain per second; error: normalised s - s_goal "
        "as x0 y0 x1 y1 ...; depths are the extremes over all points and steps"
    )
    made_by = f"NumPy {np.__version__}, SciPy {scipy.__version__}"
    store("loops.json", {"made_by": made_by, "about": about, "cases": cases})
