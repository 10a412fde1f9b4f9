"""Calls of stages from other kernels by a symbol.

Numba copies the code of a callee into its caller, and LLVM optimises this code again in every
caller. Long code with many callers, such as least squares, is therefore compiled once as a stage.
"""

from robsim.kernels.machine.intrinsics import Intrinsic
from robsim.kernels.machine.machine_code import LINKED
from robsim.kernels.machine.stages import CompiledStage


def link_stage(stage: CompiledStage) -> Intrinsic:
    """Return a function (w, numbers) that performs a stage at step 0, for calls in kernels."""
    LINKED[stage.symbol] = stage
    return Intrinsic("linked_calls", "make_linked_call", stage)
