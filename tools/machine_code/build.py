"""Write the archives of machine code: `python tools/machine_code/build.py FOLDER`.

It needs Numba 0.61 and llvmlite 0.44, whose LLVM 15 writes bitcode that all later ones read. On
another system than Linux on x86-64 it writes the bitcode alone. Two builds write the same bytes.
"""

import platform
import re
import sys
from pathlib import Path

from llvm_code import list_needs, make_bitcode, make_object
from numba_texts import record_numba_texts
from plain_modules import PlainModules

from robsim.kernels.machine.code_archive import BITCODE, CodeArchive, pack_archive
from robsim.kernels.machine.llvm_modules import LLVM_VERSION
from robsim.kernels.machine.processor_levels import LEVELS, OBJECTS_FOR
from robsim.kernels.machine.sources import digest_of_all

LLVM = 15
FOREIGN = re.compile(rb"Py[A-Z]|numba|NRT_|/home/|/tmp/|site-packages")


def build_archives(folder):
    """Write the archives to a folder."""
    if LLVM_VERSION[0] != LLVM:
        raise SystemExit(f"LLVM {LLVM} writes the bitcode, llvmlite 0.44; this is {LLVM_VERSION}")
    texts = record_numba_texts()
    plain = PlainModules(texts)
    bitcode = {symbol: make_bitcode(plain.make(symbol)) for symbol in texts.functions}
    needs = {symbol: list_needs(code) for symbol, code in bitcode.items()}
    _write(folder, BITCODE, bitcode, needs)
    if (sys.platform, platform.machine().lower()) == OBJECTS_FOR:
        for level in LEVELS:
            objects = {symbol: make_object(code, level) for symbol, code in bitcode.items()}
            _write(folder, level, objects, needs)


def _write(folder, name, parts, needs):
    """Write an archive, unless it has a trace of Python, of Numba or of this machine."""
    for symbol, code in parts.items():
        if found := FOREIGN.search(code):
            raise SystemExit(f"{symbol} for {name} has {found[0]!r}")
    archive = CodeArchive(digest_of_all(), LLVM, parts, needs)
    (folder / f"{name}.lzma").write_bytes(pack_archive(archive))


if __name__ == "__main__":
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    build_archives(out)
