"""The quadratic program of a constrained command beside a call of daqp (see README.md).

    python benchmarks/quadratic_program.py

Both sides solve the same programs in turns, and both are called once for each program. The batch is
one call of a kernel for all programs. Times are processor times, the least of several turns.
"""

import time

import daqp
import numpy as np
import numpy.typing as npt

from robsim.kernels.control.quadratic_layout import count_quadratic_rows
from robsim.kernels.control.quadratic_program import SOLVED, solve_arrays
from robsim.kernels.machine.kernel import kernel
from robsim.kernels.machine.lanes import WIDTH

COUNT, TURNS, FAR = 2000, 15, 1e30
SIZES = (4, 16), (7, 40), (7, 64), (16, 64)
Array = npt.NDArray[np.float64]


@kernel
def solve_batch(H, wish, box, C, bound, solutions, scratch, states):
    """Solve many programs one after the other."""
    for i in range(wish.shape[0]):
        states[i] = solve_arrays(H[i], wish[i], box[i], C[i], bound[i], solutions[i], scratch)


def draw_programs(n: int, m: int) -> tuple[Array, ...]:
    """Programs with n unknowns within bounds and m rows, and wishes outside of them."""
    rng = np.random.default_rng(33)
    A = rng.normal(size=(COUNT, 8, n))
    H = np.einsum("bki,bkj->bij", A, A) + 1e-3 * np.eye(n)
    C, inner = rng.normal(size=(COUNT, m, n)), rng.uniform(-0.5, 0.5, (COUNT, n))
    bound = np.einsum("bmn,bn->bm", C, inner) - rng.uniform(0.0, 2.0, (COUNT, m))
    box = np.ones((COUNT, 2, n)) * [[-1.0], [1.0]]
    return H, 1.5 * rng.normal(size=(COUNT, n)), box, C, bound


def processor_time(call) -> int:
    """Processor time of a call in nanoseconds."""
    began = time.thread_time_ns()
    call()
    return time.thread_time_ns() - began


def measure(n: int, m: int) -> tuple[float, float, float]:
    """Microseconds for a program: by daqp, by a call of ours, and in a batch of ours."""
    programs = draw_programs(n, m)
    H, wish, box, C, bound = programs
    solutions = np.zeros((COUNT, 3 * n + m))
    scratch, states = np.zeros(count_quadratic_rows(n, m) * WIDTH), np.zeros(COUNT, dtype=np.int64)
    slope, kinds = -np.einsum("bij,bj->bi", H, wish), np.zeros(n + m, dtype=np.int32)
    upper = np.concatenate([box[:, 1], np.full((COUNT, m), FAR)], axis=1)
    lower, peer = np.concatenate([box[:, 0], bound], axis=1), np.zeros((COUNT, n))
    single = [tuple(each[i] for each in (*programs, solutions)) for i in range(COUNT)]
    peer_single = [tuple(each[i] for each in (H, slope, C, upper, lower)) for i in range(COUNT)]

    def solve_each() -> None:
        for arrays in single:
            solve_arrays(*arrays, scratch)

    def solve_each_by_daqp() -> None:
        for i, arrays in enumerate(peer_single):
            peer[i] = daqp.solve(*arrays, kinds)[0]

    calls = (
        solve_each_by_daqp,
        solve_each,
        lambda: solve_batch(*programs, solutions, scratch, states),
    )
    times = np.array([[processor_time(call) for call in calls] for _ in range(TURNS)])
    assert (states == SOLVED).all() and np.allclose(solutions[:, :n], peer, rtol=0, atol=1e-7)
    theirs, alone, batch = times.min(axis=0) / COUNT / 1e3
    return theirs, alone, batch


def main() -> None:
    """Print the table."""
    print("microseconds for a program; ratios to daqp's call")
    for n, m in SIZES:
        theirs, alone, batch = measure(n, m)
        print(
            f"n {n:2d}, m {m:2d}: daqp {theirs:5.1f}, alone {alone:5.1f} ({alone / theirs:.2f}), "
            f"batch {batch:5.1f} ({batch / theirs:.2f})"
        )


if __name__ == "__main__":
    main()
