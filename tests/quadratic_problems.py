"""Random quadratic programs, degenerate ones among them, and their exact conditions."""

import numpy as np

from robsim.kernels.control.constrained_command import constrain_command, count_constraint_rows
from robsim.kernels.control.quadratic_layout import count_quadratic_rows
from robsim.kernels.control.quadratic_program import solve_arrays
from robsim.kernels.machine.lanes import WIDTH
from robsim.kernels.machine.program import Blocks, Program

MOST_UNKNOWNS, MOST_ROWS = 16, 64


def make_problem(rng):
    """H, wish, low, high, C and bound of a random program; about a quarter has no solution."""
    n, m = int(rng.integers(1, MOST_UNKNOWNS + 1)), int(rng.integers(0, MOST_ROWS + 1))
    A = rng.normal(size=(int(rng.integers(1, n + 4)), n))
    H = A.T @ A
    H = H * n / np.trace(H) + 10.0 ** rng.uniform(-6, 0) * np.eye(n)
    wish, inner = rng.normal(size=n) * 10.0 ** rng.uniform(-2, 1), rng.uniform(-1, 1, n)
    low, high = inner - rng.exponential(1.0, n), inner + rng.exponential(1.0, n)
    fixed = rng.random(n) < 0.1
    low[fixed] = high[fixed] = inner[fixed]
    low[rng.random(n) < 0.1], high[rng.random(n) < 0.1] = -np.inf, np.inf
    C = rng.normal(size=(m, n))
    if rng.random() < 0.3:  # parallel rows, zero rows
        C = np.round(C)
    if rng.random() < 0.3:
        C *= rng.random((m, n)) < 0.4
    room = rng.exponential(0.5, m)
    if rng.random() < 0.25:  # many constraints meet at one point
        room[rng.random(m) < 0.7] = 0.0
    bound = C @ inner - room
    if m >= 2:
        add_related_rows(rng, inner, C, bound)
    hidden = rng.random(m) < 0.1 * rng.integers(0, 2)
    C[hidden], bound[hidden] = 0.0, -np.inf
    if m and rng.random() < 0.27:
        add_contradiction(rng, high, C, bound)
    return H, wish, low, high, C, bound


def add_related_rows(rng, inner, C, bound):
    """Multiples of rows, and equal rows of opposite direction."""
    for _ in range(int(rng.integers(0, 5))):
        i, j = rng.integers(0, len(bound), 2)
        factor = 2.0 ** rng.integers(-3, 4)
        C[i], bound[i] = factor * C[j], factor * bound[j]
    for _ in range(int(rng.integers(0, 4))):
        i, j = rng.choice(len(bound), 2, replace=False)
        bound[j] = C[j] @ inner
        C[i], bound[i] = -C[j], -bound[j]


def add_contradiction(rng, high, C, bound):
    """A row that some others, or an upper bound, exclude."""
    m, n = C.shape
    i, excess = int(rng.integers(0, m)), 10.0 ** rng.uniform(-3, 1)
    j = int(rng.integers(0, n))
    if rng.random() < 0.3 and np.isfinite(high[j]):
        C[i] = np.eye(n)[j]
        bound[i] = high[j] + excess
        return
    others = [k for k in rng.permutation(m)[:5] if k != i and np.isfinite(bound[k])]
    y = rng.exponential(1.0, len(others))
    C[i], bound[i] = -y @ C[others], -y @ bound[others] + excess


def solve(H, wish, low, high, C, bound):
    """State, solution and multipliers of a program."""
    n, m = len(wish), len(bound)
    solution, box = np.zeros(3 * n + m), np.stack([low, high])
    scratch = np.full(count_quadratic_rows(n, m) * WIDTH, np.nan)
    state = solve_arrays(H, wish, box, C, bound, solution, scratch)
    return state, solution[:n], solution[n:]


def violation(low, high, C, bound, x):
    """Largest violation of a constraint, of a row as the distance of x from its half-space."""
    length = np.linalg.norm(C, axis=1)
    rows = (bound - C @ x) / np.where(length > 0.0, length, 1.0)
    return max(0.0, *(low - x), *(x - high), *rows)


def kkt_errors(H, wish, low, high, C, bound, x, y):
    """Errors of the stationarity, relative to the multipliers, and of the complementarity."""
    n = len(x)
    slope = H @ (x - wish) - y[:n] + y[n : 2 * n] - y[2 * n :] @ C
    length = np.linalg.norm(C, axis=1)
    rows = (C @ x - bound) / np.where(length > 0.0, length, 1.0)
    room = np.concatenate([x - low, high - x, rows])[y > 0.0]
    return abs(slope).max() / (1.0 + y.max()), abs(room).max(initial=0.0)


def certificate_error(low, high, C, bound, y):
    """Size of the combined gradient over the excess of the combined bound; infinite without one."""
    n = len(low)
    used = y > 0.0
    gradients = np.concatenate([np.eye(n), -np.eye(n), C])[used]
    excess = y[used] @ np.concatenate([low, -high, bound])[used]
    return abs(y[used] @ gradients).max() / excess if excess > 0.0 and y.min() >= 0.0 else np.inf


def constrain(A, wish, low, high, C, bound, levels, eps=1e-6, price=1e6):
    """Results of the stage `constrain_command` for runs along the first axis, by their names."""
    program, (runs, n), m = Program(), wish.shape, len(levels)

    def rows(values):
        return program.each(np.moveaxis(values, 0, -1))

    found = {
        "qd": program.rows(n),
        "multipliers": program.rows(2 * n + m),
        "slack": program.rows(m),
        "unmet": program.rows(),
    }
    program.add(
        constrain_command,
        A=rows(A),
        eps=program.constant(eps),
        wish=rows(wish),
        low=rows(low),
        high=rows(high),
        C=rows(C),
        bound=rows(bound),
        levels=program.constant(levels),
        price=program.constant(price),
        scratch=program.scratch(count_constraint_rows(n, m)),
        **found,
    )
    blocks = Blocks(program, np.arange(runs))
    for part in program.segments():
        part(blocks, 0)
    return {name: np.moveaxis(blocks.get(each), -1, 0) for name, each in found.items()}
