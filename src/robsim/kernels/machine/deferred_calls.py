"""Calls of linked stages. Their code is found when a kernel first calls them.

Few runs need the code of singular values or of distorted pixels, and a kernel with a call of it
does not load or compile it. The kernel calls a small function in place of the stage. As long as the
address of the stage is unknown, the function asks Python for it. Python code raises
KeyboardInterrupt for Ctrl-C, which cannot pass through machine code. The function therefore asks
again, and interrupts the main thread afterwards.
"""

from __future__ import annotations

import ctypes
import sys
from typing import Any

_TEXT = """
target triple = "TRIPLE"
target datalayout = "LAYOUT"
@known = internal global i64 0
define void @"SYMBOL.call"(i64* %p, double* %w, i64 %step) {
entry:
  %a = load atomic i64, i64* @known acquire, align 8
  %is_known = icmp ne i64 %a, 0
  br i1 %is_known, label %call, label %find
call:
  %stage = inttoptr i64 %a to void (i64*, double*, i64)*
  tail call void %stage(i64* %p, double* %w, i64 %step)
  ret void
find:
  %is_interrupted = phi i1 [false, %entry], [true, %find]
  %f = inttoptr i64 FIND to i64 ()*
  %b = call i64 %f()
  %is_missing = icmp eq i64 %b, 0
  br i1 %is_missing, label %find, label %first_call
first_call:
  store atomic i64 %b, i64* @known release, align 8
  %found = inttoptr i64 %b to void (i64*, double*, i64)*
  call void %found(i64* %p, double* %w, i64 %step)
  br i1 %is_interrupted, label %interrupt, label %end
interrupt:
  %i = inttoptr i64 INTERRUPT to void ()*
  call void %i()
  br label %end
end:
  ret void
}
"""
_FIND = ctypes.CFUNCTYPE(ctypes.c_int64)


class DeferredCall:
    """The function that machine code calls in place of a linked stage.

    Attributes
    ----------
    name : str
        Name of the function.
    text : str
        Its LLVM code, which holds addresses of this process.
    """

    def __init__(self, symbol: str, stage: Any, failing_stage: int) -> None:
        self._stage, self._failing_stage = stage, failing_stage
        self._callback = _FIND(self._find)  # the machine code needs it as long as the process lives
        self.name = f"{symbol}.call"
        find = ctypes.cast(self._callback, ctypes.c_void_p).value
        interrupt = ctypes.cast(ctypes.pythonapi.PyErr_SetInterrupt, ctypes.c_void_p).value
        text = _TEXT.replace("SYMBOL", symbol).replace("FIND", str(find))
        self.text = text.replace("INTERRUPT", str(interrupt))

    def _find(self) -> int:
        """Return the address of the stage, or 0 if Ctrl-C interrupted the search.

        If the code cannot be made, report the error and return the address of a stage that fails.
        """
        try:
            return int(self._stage.address)
        except KeyboardInterrupt:
            return 0
        except Exception:  # noqa: BLE001  no exception can pass through machine code
            sys.excepthook(*sys.exc_info())
            return self._failing_stage
