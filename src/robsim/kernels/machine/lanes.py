"""Lanes: the same quantity of WIDTH runs in one vector register.

A kernel on lanes reads like a kernel for a single run: `x = a * b + c` computes WIDTH runs at once.
Each lane is rounded like a scalar, and operations are not contracted to fused multiply-adds. The
bits of a run therefore depend neither on the neighbouring runs nor on the machine. A block of
memory holds rows of WIDTH numbers, one number for each run; `get` and `put` move a row.

`sqrt`, `absolute`, `floor`, `copy_sign` and `where` also take single numbers, so that a formula is
written once for lanes and for arrays.
"""

from robsim.kernels.machine.intrinsics import Intrinsic

WIDTH = 8  # runs: one AVX-512 register, two of AVX2, four of NEON


def _operation(name: str) -> Intrinsic:
    return Intrinsic("lane_operations", name)


get, put = _operation("get"), _operation("put")
get_lane, replace_lane = _operation("get_lane"), _operation("replace_lane")
fill_lanes = _operation("fill_lanes")
sqrt, absolute, floor = _operation("sqrt"), _operation("absolute"), _operation("floor")
copy_sign = _operation("copy_sign")
where, any_lane, least_lane = _operation("where"), _operation("any_lane"), _operation("least_lane")
align_stack = _operation("align_stack")
