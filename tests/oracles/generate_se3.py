"""Oracle: exponentials of rotation vectors and twists, and a coefficient of log, by mpmath.

Program: mpmath (`pip install mpmath numpy`); the version is in "made_by".
Run:     python tests/oracles/generate_se3.py
Writes:  se3_mpmath.json, always the same numbers.

Each case has a rotation vector omega (rad) and a linear part v (m); both are exactly the float64
values in the file. R = exp([omega]x); quaternion (x, y, z, w) with w >= 0 up to an angle of pi;
T is the upper 3x4 part of exp of the twist (v, omega) held for a unit of time. All are sums of
the power series of a matrix exponential, so no formula for small or large angles enters. All
is good to 60 digits. The coefficient (1 - (t/2) cot(t/2)) / t^2 belongs to [omega]x^2 in the
inverse of the Jacobian of exp.
"""

import mpmath as mp
import numpy as np
from _store import store

mp.mp.dps = 80  # twenty digits more than are claimed


def exponential(A):
    """exp(A) as the sum of A^k / k!, to the working precision."""
    total = term = mp.eye(A.rows)
    k = 0
    while mp.mnorm(term, mp.inf) > mp.mpf(10) ** -75:
        k += 1
        term = term * A / k
        total += term
    return total


def cross_matrix(w):
    """[w]x with [w]x p = w x p."""
    x, y, z = w
    return mp.matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def twist_matrix(v, w):
    """The 4x4 matrix of the twist (v, w)."""
    A = mp.zeros(4)
    A[:3, :3] = cross_matrix(w)
    A[:3, 3] = mp.matrix(v)
    return A


def quaternion(w):
    """(x, y, z, w) of exp([w]x): qdot = (w / 2) q, solved over a unit of time from (0, 0, 0, 1)."""
    x, y, z = (c / 2 for c in w)
    rate = mp.matrix([[0, -z, y, x], [z, 0, -x, y], [-y, x, 0, z], [-x, -y, -z, 0]])
    return exponential(rate)[:, 3]


def floats(M):
    """The nearest float64 values, as nested lists."""
    return [[float(M[i, j]) for j in range(M.cols)] for i in range(M.rows)]


def case(kind, omega, v):
    """One stored case; `omega` and `v` are float64 and taken as exact."""
    w, t = [mp.mpf(float(x)) for x in omega], [mp.mpf(float(x)) for x in v]
    angle = mp.sqrt(sum(x * x for x in w))
    return {
        "kind": kind,
        "omega": [float(x) for x in omega],
        "v": [float(x) for x in v],
        "angle": float(angle),
        "pi_minus_angle": float(mp.pi - angle),
        "R": floats(exponential(cross_matrix(w))),
        "quaternion": [float(x) for x in quaternion(w)],
        "T": floats(exponential(twist_matrix(t, w))[:3, :]),
    }


def unit(rng):
    """A random direction."""
    x = rng.normal(size=3)
    return x / np.linalg.norm(x)


def inputs(rng):
    """(kind, rotation vector) of every case."""
    for angle in 10 ** rng.uniform(-12, np.log10(np.pi), 60):
        yield "log_uniform", unit(rng) * angle
    yield "zero", np.zeros(3)
    for k in range(1, 13):
        yield "near_pi", unit(rng) * (np.pi - 10.0**-k)
    for axis in np.vstack([np.eye(3), -np.eye(3)]):
        yield "pi", axis * np.pi
    for _ in range(4):
        yield "pi", unit(rng) * np.pi


def log_coefficients():
    """[angle, coefficient] for float64 angles up to pi."""
    angles = [
        *(10.0 ** np.linspace(-12, np.log10(np.pi), 60)[:-1]),
        *(np.pi - 10.0 ** -np.arange(13)),
    ]
    for angle in map(mp.mpf, map(float, angles)):
        yield [float(angle), float((1 - angle / 2 * mp.cot(angle / 2)) / angle**2)]


if __name__ == "__main__":
    rng = np.random.default_rng(4)
    about = (
        "omega (rad) and v (m) are exact float64 inputs; R = exp([omega]x), quaternion (x, y, z, "
        "w), T = upper 3x4 of exp of the twist (v, omega); pi_minus_angle tells on which side of "
        "pi the rounded vector lies; kinds: log_uniform, zero, near_pi (pi - 10**-k), pi; "
        "log_coefficients: pairs of an angle t and (1 - (t/2) cot(t/2)) / t^2"
    )
    cases = [case(kind, w, unit(rng) * rng.uniform(0.5, 1.5)) for kind, w in inputs(rng)]
    made_by = f"mpmath {mp.__version__}, {mp.mp.dps} digits, rounded to float64"
    document = {"made_by": made_by, "about": about, "log_coefficients": list(log_coefficients())}
    store("se3_mpmath.json", document | {"cases": cases})
