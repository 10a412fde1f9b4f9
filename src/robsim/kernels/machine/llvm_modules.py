"""Modules of LLVM: parsed, optimised for a processor, and translated to machine code."""

from __future__ import annotations

from typing import Any

from llvmlite import binding as llvm

LLVM_VERSION: tuple[int, ...] = llvm.llvm_version_info
TRIPLE = llvm.get_process_triple()

if LLVM_VERSION[0] < 20:  # later ones initialise themselves
    llvm.initialize()
llvm.initialize_native_target()
llvm.initialize_native_asmprinter()


def make_target_machine(processor: str, features: str, triple: str = TRIPLE) -> Any:
    """Return LLVM's description of a processor, for code in memory."""
    target = llvm.Target.from_triple(triple)
    options: dict[str, Any] = {"opt": 3, "reloc": "default", "codemodel": "jitdefault"}
    return target.create_target_machine(cpu=processor, features=features, jit=True, **options)


def parse_module(code: bytes, machine: Any) -> Any:
    """Return the module of bitcode or of a text, for a target machine.

    Raise RuntimeError if it is neither, or belongs to a later version of LLVM.
    """
    if code[:2] == b"BC":
        module = llvm.parse_bitcode(code)
    else:
        text = code.decode().replace("TRIPLE", machine.triple, 1)
        module = llvm.parse_assembly(text.replace("LAYOUT", str(machine.target_data), 1))
    module.triple, module.data_layout = machine.triple, str(machine.target_data)
    return module


def optimise(module: Any, machine: Any) -> None:
    """Apply the passes of Numba. None of them changes a rounding."""
    if not hasattr(llvm, "create_pass_builder"):
        return _optimise_by_old_passes(module, machine)
    options = llvm.create_pipeline_tuning_options(speed_level=3)
    options.loop_vectorization = options.loop_interleaving = True
    options.slp_vectorization = False
    builder = llvm.create_pass_builder(machine, options)
    builder.getModulePassManager().run(module, builder)
    return None


def _optimise_by_old_passes(module: Any, machine: Any) -> None:
    """Apply the passes of LLVM before its new pass manager."""
    builder = llvm.create_pass_manager_builder()
    builder.opt_level, builder.inlining_threshold = 3, 275
    builder.loop_vectorize, builder.slp_vectorize = True, False
    passes = llvm.create_module_pass_manager()
    machine.add_analysis_passes(passes)
    builder.populate(passes)
    passes.run(module)
