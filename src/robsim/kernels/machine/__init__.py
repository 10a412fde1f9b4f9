"""The machine: compiled stages and programs of them, lanes, memory, and kept machine code."""
