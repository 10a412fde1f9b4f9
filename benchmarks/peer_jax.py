"""How long JAX takes for a run and step of the batch of numpy_baseline.py, compiled for all runs.

Run it with a Python of its own: `pip install jax`. The step is written for one run and mapped over
all of them; least squares go by a Cholesky factorisation of the normal equations, in 64 bits.
Prints one line of JSON: seconds per run and step.
"""

import json
import time

import jax
import jax.numpy as jnp
import numpy as np
import numpy_baseline as baseline

RUNS, STEPS, DT, GAIN = 4096, 100, 0.04, 5.0
ROWS = [tuple(map(float, row)) for row in baseline.PUMA560]


def poses(q):
    """Poses of the base and of every link, as lists of rotations (3, 3) and places (3,)."""
    R, p = [jnp.eye(3)], [jnp.zeros(3)]
    for (theta, d, a, alpha), angle in zip(ROWS, q, strict=True):
        c, s, ca, sa = jnp.cos(theta + angle), jnp.sin(theta + angle), np.cos(alpha), np.sin(alpha)
        turn = jnp.array([[c, -s * ca, s * sa], [s, c * ca, -c * sa], [0.0, sa, ca]])
        p.append(p[-1] + R[-1] @ jnp.array([a * c, a * s, d]))
        R.append(R[-1] @ turn)
    return R, p


def step(q, points, s_goal):
    """The coordinates (6,) one period later."""
    R, p = poses(q)
    J = jnp.stack(
        [jnp.concatenate([jnp.cross(R[i][:, 2], p[6] - p[i]), R[i][:, 2]]) for i in range(6)], 1
    )
    back = R[6].T
    J = jnp.concatenate([back @ J[:3], back @ J[3:]])
    X, Y, Z = back @ (points - p[6]).T
    x, y, zero = X / Z, Y / Z, jnp.zeros(4)
    top = jnp.stack([-1 / Z, zero, x / Z, x * y, -(1 + x * x), y], 1)
    low = jnp.stack([zero, -1 / Z, y / Z, 1 + y * y, -x * y, -x], 1)
    A = jnp.stack([top, low], 1).reshape(8, 6) @ J
    e = jnp.stack([x, y], 1).reshape(8) - s_goal
    return q - DT * GAIN * jax.scipy.linalg.cho_solve(jax.scipy.linalg.cho_factor(A.T @ A), A.T @ e)


def main() -> None:
    """Print the time."""
    jax.config.update("jax_enable_x64", True)
    q0, points, s_goal = baseline.scene(RUNS)
    every = jax.vmap(step, in_axes=(0, None, None))
    run = jax.jit(lambda q: jax.lax.fori_loop(0, STEPS, lambda i, q: every(q, points, s_goal), q))
    found = np.asarray(run(q0))
    expected = baseline.simulate(q0, STEPS, DT, GAIN, points, s_goal)
    if np.abs(found - expected).max() > 1e-9:
        raise SystemExit("JAX has another arm")
    times = []
    for _ in range(5):
        start = time.perf_counter()
        run(q0).block_until_ready()
        times.append(time.perf_counter() - start)
    print(json.dumps({"jax": jax.__version__, "seconds_per_step": min(times) / RUNS / STEPS}))


if __name__ == "__main__":
    main()
