"""Oracle: a planar arm of two joints whose torques follow from the image of a fixed camera.

Program: SciPy, DOP853 at a relative tolerance of 1e-13.
Run:     python tests/oracles/generate_torque_law.py
Writes:  torque_law_scipy.json

The equations of motion of the arm are in closed form, in _planar_arm.py. The torque is

    tau = -J_s' K f(e) - Kv qdot + c g(q),

with f(e) = e (Kelly 1996, "Robust asymptotically stable visual servoing of planar robots") or
f(e) = w tanh(e/w), and J_s of a camera whose roll is believed wrong by `roll_error`. c is the share
of gravity that is compensated. While neither is wrong, the energy

    V = 1/2 qdot' M qdot + U(e),  U = 1/2 K e'e  or  K w^2 sum ln cosh(e/w),

falls at the rate qdot' Kv qdot, which is integrated beside the motion.
"""

import numpy as np
from _planar_arm import DAMPING, GOAL, believed_jacobian, coriolis, image, inertia, weight
from _store import store
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

TIMES = np.linspace(0.0, 2.0, 21)
CASES = {
    "linear": {},
    "rolled_camera": {"roll": 0.7},
    "saturated": {"width": 0.05, "stiffness": 400.0},
    "wrong_roll": {"roll": 0.7, "roll_error": 0.6},
    "light_gravity": {"share": 0.9},
    "no_gravity": {"share": 0.0, "stiffness": 600.0},
}


def solve(roll=0.0, roll_error=0.0, stiffness=300.0, width=None, share=1.0):
    """Return the trajectory of a case."""
    goal, _ = image(GOAL, roll)

    def spring(q):
        """The error of the image, and the torque of the law."""
        s, _ = image(q, roll)
        believed = believed_jacobian(q, roll, roll_error)
        e = s - goal
        f = e if width is None else width * np.tanh(e / width)
        return e, -stiffness * believed.T @ f

    def rates(t, x):
        q, v = x[:2], x[2:4]
        tau = spring(q)[1] - DAMPING * v + (share - 1.0) * weight(q) - coriolis(q, v)
        return np.concatenate([v, np.linalg.solve(inertia(q), tau), [v @ (DAMPING * v)]])

    def energy(q, v):
        e, _ = spring(q)
        if width is None:
            potential = 0.5 * stiffness * e @ e
        else:
            potential = stiffness * width**2 * np.log(np.cosh(e / width)).sum()
        return 0.5 * v @ inertia(q) @ v + potential

    start = np.array([0.1, 0.3, 0.0, 0.0, 0.0])
    found = solve_ivp(
        rates, (0.0, TIMES[-1]), start, "DOP853", TIMES, rtol=1e-13, atol=1e-15, max_step=0.01
    )
    assert found.success
    q, v, lost = found.y[:2].T, found.y[2:4].T, found.y[4]
    V = np.array([energy(*each) for each in zip(q, v, strict=True)])
    if share == 1.0 and not roll_error:
        assert np.abs(V + lost - V[0]).max() < 1e-11
    rest = fsolve(lambda q: spring(q)[1] + (share - 1.0) * weight(q), q[-1], xtol=1e-12)
    return {
        **{"roll": roll, "roll_error": roll_error, "stiffness": stiffness, "width": width},
        **{"share": share, "q": q.tolist(), "v": v.tolist(), "energy": V.tolist()},
        **{"lost": lost.tolist(), "rest": rest.tolist(), "rest_error": spring(rest)[0].tolist()},
    }


if __name__ == "__main__":
    store(
        "torque_law_scipy.json",
        {
            "times": TIMES.tolist(),
            "cases": [{"name": name, **solve(**case)} for name, case in CASES.items()],
        },
    )
