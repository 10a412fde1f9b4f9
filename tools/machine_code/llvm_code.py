"""Bitcode and machine code of plain modules, by LLVM alone."""

from llvmlite import binding as llvm

from robsim.kernels.machine.llvm_modules import make_target_machine, optimise, parse_module


def make_bitcode(text):
    """Return the bitcode of a plain module, after cheap passes that suit every processor.

    The passes inline the functions of the module and remove what nothing uses. Names are removed.
    """
    module = parse_module(text.encode(), make_target_machine("", ""))
    passes = llvm.create_module_pass_manager()
    passes.add_sroa_pass()
    passes.add_function_inlining_pass(275)
    passes.add_sroa_pass()
    passes.add_instruction_combining_pass()
    passes.add_cfg_simplification_pass()
    passes.add_gvn_pass()
    passes.add_dead_code_elimination_pass()
    passes.add_global_dce_pass()
    passes.add_dead_arg_elimination_pass()
    passes.add_strip_symbols_pass()
    passes.run(module)
    module.triple = module.data_layout = ""
    return module.as_bitcode()


def make_object(bitcode, processor):
    """Return the machine code of bitcode for a processor."""
    machine = make_target_machine(processor, "")
    module = parse_module(bitcode, machine)
    optimise(module, machine)
    return machine.emit_object(module)


def list_needs(bitcode):
    """Return the symbols that the functions of bitcode call, without LLVM's own."""
    module = llvm.parse_bitcode(bitcode)
    names = (each.name for each in module.functions if each.is_declaration)
    return sorted(name for name in names if not name.startswith("llvm."))
